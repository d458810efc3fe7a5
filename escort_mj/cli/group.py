"""How the command line lists its commands."""

from __future__ import annotations

import re
from typing import Any

import typer
from typer.core import TyperGroup

from escort_mj.version import __version__

SECTIONS = {
    "Run and inspect": (
        "run",
        "check",
        "validate",
        "show",
        "metrics",
        "render",
        "report",
        "view",
        "rerun",
        "diff",
        "shrink",
        "judge",
    ),
    "Compare and search": ("compare", "sweep", "gains", "tune", "falsify", "reproduce"),
    "Write and convert": ("new", "export", "schema"),
    "Bring your own": ("check-robot", "check-plugin"),
    "Inspect the installation": ("list", "doctor"),
}
"""The commands as the help lists them."""


class Commands(TyperGroup):
    """The commands, listed in sections with whole sentences."""

    def invoke(self, ctx: Any) -> Any:
        """Run a command; of a wrong argument it says what was found, and the nearest word that is allowed."""
        try:
            return super().invoke(ctx)
        except typer.BadParameter as error:
            from escort_mj.scenario.findings import did_you_mean, shown

            word = re.fullmatch(r"(?:Value error, )?('(.*)' is not one of (.*))\.", error.message)
            if word:
                error.message = word[1] + did_you_mean(word[2], re.findall("'([^']+)'", word[3]))
            for wrong in () if word else getattr(error.__cause__, "errors", tuple)():  # pydantic's
                error.message = f"found {shown(wrong['input'])}; {error.message}"
            raise

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write each section with the whole first paragraph of its commands' help."""
        for section, names in SECTIONS.items():
            with formatter.section(section):
                formatter.write_dl([(name, _summary(self.commands[name].help)) for name in names])


def _summary(text: str | None) -> str:
    """Return the first paragraph of a command's help."""
    return " ".join((text or "").split("\n\n")[0].split())


def print_version(wanted: bool) -> None:
    """Print the version and end, if that is wanted."""
    if wanted:
        typer.echo(f"escort-mj {__version__}")
        raise typer.Exit
