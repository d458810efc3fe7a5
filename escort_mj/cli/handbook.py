"""The reference pages of the docs that the command line makes: commands, metrics, signals."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import typer

from escort_mj.cli.app import EXIT_CODES, app
from escort_mj.cli.group import SECTIONS
from escort_mj.record.tables import markdown
from escort_mj.scenario.reader.handbook import with_links

TITLES = {
    "metrics": (
        "Metrics",
        "This page lists every metric in `metrics.json`; expectations can set bounds on them. "
        "`escort-mj list metrics --markdown` writes this page.\n\n"
        "The *window* is the part of a run that `metrics.json` and the tables of studies look at: the whole "
        "run, or its [tail](glossary.md), which is the last fifth of the time that was simulated. "
        "An expectation has a window of its own ([verdicts](verdicts.md)). *Read* says when a metric looks: "
        "at every physics step (`physics.timestep`); at the samples (`recording.rate`); or at every step if "
        "an expectation of the scenario names the metric, and otherwise at the samples: `metrics.json` says "
        "which.",
    ),
    "signals": (
        "Signals",
        "This page lists every variable of a trace, in SI units and the world frame. "
        "`escort-mj list signals --markdown` writes this page.",
    ),
    "values": (
        "What components read",
        "This page lists every value that the methods of a [plugin](plugins.md) can read, by the kind of "
        "component, in SI units and the world frame. A component also reads what it declares as `Memory`, by "
        "name. `escort-mj list values --markdown` writes this page.\n\n"
        "A *vector* has `+`, `-`, `* number`, `/ number` and components (`r.q[0]`); an *array* has a row for "
        "each robot and a column for each axis where Python evaluates an equation, and cannot be written.",
    ),
}
COMMON = ("quiet", "verbose", "json", "help")


def commands_page() -> Iterator[str]:
    """Yield the lines of the page of commands: each with its examples, arguments and options."""
    yield "# Commands\n"
    yield (
        "This page lists every command of `escort-mj` with the text of its `--help`. "
        "`escort-mj list commands --markdown` writes this page.\n"
    )
    commands: Mapping[str, Any] = typer.main.get_command(app).commands  # type: ignore[attr-defined]
    yield f"{EXIT_CODES} A command whose exit codes differ lists them below.\n"
    yield "Most commands share these options:\n"
    yield from _options(commands["run"], lambda option: option in COMMON)
    for section, names in SECTIONS.items():
        yield f"\n## {section}"
        for name in names:
            yield from _command(name, commands[name])


def _command(name: str, command: Any) -> Iterator[str]:
    paragraphs = [" ".join(part.split()) for part in command.help.split("\n\n")]
    yield f"\n### {name}\n"
    for text in (part for part in paragraphs if not part.startswith("Example:")):
        yield f"{text}\n"
    examples = [part.removeprefix("Example: ") for part in paragraphs if part.startswith("Example:")]
    yield "\n".join(["```", *(line for text in examples for line in text.split("; ")), "```\n"])
    yield from _options(command, lambda option: option not in COMMON)


def _options(command: Any, wanted: Callable[[str], bool]) -> Iterator[str]:
    """Yield the table of a command's arguments and options, as its help describes them."""
    context = command.make_context(
        command.name, [], resilient_parsing=True, **app.info.context_settings or {}
    )
    records = [one.get_help_record(context) for one in command.get_params(context) if wanted(str(one.name))]
    rows = [
        [f"`{usage}`", with_links(meaning.replace("  ", " "))] for usage, meaning in filter(None, records)
    ]
    if rows:
        yield from markdown(["option", "meaning"], rows)
