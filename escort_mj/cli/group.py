"""How the command line lists its commands, and the options that all of them share."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import version
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from escort_mj.cli.streams import OUTPUT, Output

SECTIONS = {
    "Run and inspect": (
        "run",
        "check",
        "validate",
        "show",
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
QUIET = "Print errors and failed verdicts only."
VERBOSE = "Print each stage with its duration, and the traceback of internal errors."


def _sets(field: str) -> Callable[[bool], bool]:
    """Return what an option calls to set a field of `OUTPUT`."""

    def note(value: bool) -> bool:
        if value:
            setattr(OUTPUT, field, True)
        return value

    return note


def _flag(field: str, *names: str, words: str) -> Any:
    """Return an option that is read before others, and that no command needs to name."""
    return typer.Option(*names, help=words, is_eager=True, expose_value=False, callback=_sets(field))


def _options(
    quiet: Annotated[
        bool, _flag("quiet", "--quiet", "-q", words="Print errors and failed verdicts only.")
    ] = False,
    verbose: Annotated[bool, _flag("verbose", "--verbose", "-v", words=VERBOSE)] = False,
) -> None:
    """Declare the options that commands share."""


class Commands(TyperGroup):
    """The commands, listed in sections with whole sentences, and with the options that they share."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        donor = typer.Typer(add_completion=False)
        donor.command()(_options)
        quiet, verbose, *_ = typer.main.get_command(donor).params
        for command in self.commands.values():
            command.params += [quiet, verbose]

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write each section with the whole first paragraph of its commands' help."""
        for section, names in SECTIONS.items():
            with formatter.section(section):
                formatter.write_dl([(name, _summary(self.commands[name].help)) for name in names])


def _summary(text: str | None) -> str:
    """Return the first paragraph of a command's help."""
    return " ".join((text or "").split("\n\n")[0].split())


def start_over() -> None:
    """Forget the output options of an earlier command of this process."""
    vars(OUTPUT).update(vars(Output()))


def print_version(wanted: bool) -> None:
    """Print the version and end, if that is wanted."""
    if wanted:
        typer.echo(f"escort-mj {version('escort-mj')}")
        raise typer.Exit
