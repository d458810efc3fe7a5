"""The table of a comparison: for a terminal, as Markdown, LaTeX, CSV and JSON."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from escort_mj.errors import UsageError
from escort_mj.record.tables import aligned, comma_separated, latex
from escort_mj.record.tables import markdown as markdown_rows
from escort_mj.scenario import Scenario
from escort_mj.study.compare.claims import value_text
from escort_mj.study.compare.comparison import (
    OUTERS,
    QUANTITIES,
    SPANS,
    Combination,
    Result,
    Spread,
    best,
    rows,
    title_of,
)

HEADS = {
    "settling_time": "settles",
    "radius_error_mean": "radius",
    "spacing_error_mean": "spacing",
    "tracking_error_rms": "rms e",
    "true_error_rms": "rms e, no noise",
    "true_error_max": "peak of e, no noise",
    "velocity_error_rms": "rms e_dot",
    "chattering": "chattering",
    "force_rms": "force",
    "energy": "energy",
    "obstacle_clearance_min": "to obstacles",
    "robot_clearance_min": "between robots",
    "contacts": "touches",
    "saturated_share": "saturated",
}
BRIEF = (
    "settling_time",
    "radius_error_mean",
    "true_error_rms",
    "true_error_max",
    "chattering",
    "obstacle_clearance_min",
)


def outcomes(row: Combination) -> str:
    """How a combination's runs ended, in words."""
    ends = [result.outcome for result in row.results]
    counts = {end: ends.count(end) for end in dict.fromkeys(ends)}
    if len(ends) == 1:
        return ends[0]
    return ", ".join(f"{end} {count} of {len(ends)}" for end, count in counts.items())


def cell(name: str, spread: Spread) -> str:
    """A quantity over its seeds, for people: mean, spread, and how often never."""
    never = f"never in {spread.never} of {spread.known}" if spread.never else ""
    if spread.mean is None:
        return "never" if spread.never else "-"
    if name == "saturated_share":
        text, deviation = f"{100 * spread.mean:.3g} %", 100 * spread.deviation
    else:
        unit = QUANTITIES[name].unit
        small = unit in ("m", "m/s") and abs(spread.mean) < 1
        text, deviation = value_text(spread.mean, unit), spread.deviation * (1000 if small else 1)
    if spread.known - spread.never > 1:
        value, _, unit = text.partition(" ")
        decimals = len(value.partition(".")[2])
        text = f"{value} ± {deviation:.{decimals}f} {unit}".rstrip()
    return f"{text}, {never}" if never else text


def cells(table: Sequence[Combination], name: str, mark: str = "**") -> list[str]:
    """A column of the table; the best is marked, unless all are as good."""
    shown = [cell(name, row.spreads[name]) for row in table]
    first = best(table, name)
    means = [row.spreads[name].mean for row in table]
    if first is None or len(set(shown)) == 1:
        return shown
    winner = {text for text, mean in zip(shown, means, strict=True) if mean == first}
    return [
        f"{mark}{text}{mark}" if text in winner and row.completed == len(row.results) else text
        for text, row in zip(shown, table, strict=True)
    ]


def comparison_markdown(scenario: Scenario, results: Sequence[Result]) -> list[str]:
    """The table for people, with what its columns mean."""
    table = rows(results)
    columns = [[title_of(row.law) for row in table], [OUTERS[row.outer] for row in table]]
    columns += [[outcomes(row) for row in table], *(cells(table, name) for name in QUANTITIES)]
    return [
        *markdown_rows(
            ["law", "outer loop", "outcome", *(HEADS[name] for name in QUANTITIES)],
            [list(row) for row in zip(*columns, strict=True)],
        ),
        "",
        f"`{scenario.name}`, {scenario.duration:g} s, {_seeds(results)}. "
        "**Bold**: the best value among the controllers that completed every run.",
        "",
        *(f"- {result.trial.name}: {result.outcome}: {result.message}" for result in _lost(results)),
    ]


def subject(results: Sequence[Result]) -> str:
    """What is compared: laws, outer loops, or both."""
    several = {"laws": len({result.trial.law for result in results}) > 1}
    several |= {"outer loops": len({result.trial.outer for result in results}) > 1}
    return " and ".join(name for name, many in several.items() if many) or "laws"


def meanings() -> list[str]:
    """What the columns mean, one line each."""
    return [
        f"- {HEADS[name]}{f' [{q.unit}]' if q.unit != '1' else ''}, {SPANS[name].words}: {q.meaning}"
        for name, q in QUANTITIES.items()
    ]


def comparison_page(scenario: Scenario, results: Sequence[Result]) -> str:
    """The table as a page of its own."""
    head = [f"# {subject(results)[0].upper()}{subject(results)[1:]} compared: {scenario.name}", ""]
    return "\n".join([*head, *comparison_markdown(scenario, results), "", *meanings()]) + "\n"


def comparison_latex(scenario: Scenario, results: Sequence[Result]) -> str:
    """Return the table for LaTeX, one quantity per row."""
    table = rows(results)
    lone = len({row.outer for row in table}) == 1
    head = ["", *(title_of(row.law) if lone else row.title for row in table)]
    lines = [["outcome", *map(outcomes, table)]]
    lines += [[HEADS[name], *cells(table, name)] for name in QUANTITIES]
    words = f"{scenario.name}, {scenario.duration:g} s, {_seeds(results)}. Bold: the best value of a row."
    return latex(head, lines, words)


def comparison_summary(results: Sequence[Result]) -> list[str]:
    """The table for a terminal: the quantities that tell most, one line per combination."""
    table = rows(results)
    columns = [["", *(row.title for row in table)]]
    columns += [[HEADS[name], *cells(table, name, "*")] for name in BRIEF]
    columns += [["outcome", *(outcomes(row) for row in table)]]
    return aligned(zip(*columns, strict=True))


def runs_table(results: Sequence[Result]) -> str:
    """One line per run, numbers in SI units, for other programs."""
    units = [f"{name} [{quantity.unit}]" for name, quantity in QUANTITIES.items()]
    lines: list[list[object]] = [["law", "outer", "seed", "outcome", *units]]
    for result in results:
        values = ["" if value is None else value for value in result.values.values()]
        lines.append([*result.trial, result.outcome, *values])
    return comma_separated(lines)


def comparison_document(scenario: Scenario, results: Sequence[Result]) -> dict[str, Any]:
    """Everything that was measured, as JSON can hold it."""
    return {
        "scenario": scenario.name,
        "duration": scenario.duration,
        "quantities": {name: quantity._asdict() for name, quantity in QUANTITIES.items()},
        "combinations": [
            {
                "law": row.law,
                "outer": row.outer,
                "completed": row.completed,
                "of": len(row.results),
                "values": {name: spread._asdict() for name, spread in row.spreads.items()},
            }
            for row in rows(results)
        ],
        "runs": [
            {**result.trial._asdict(), "outcome": result.outcome, "message": result.message}
            | {"values": result.values}
            for result in results
        ],
    }


def into_page(path: Path, scenario: Scenario, results: Sequence[Result]) -> str:
    """The text of a page of the docs with this table between the marks that are there for it.

    Raises:
        UsageError: If there is no such page, or no such marks in it.
    """
    before, after = around_marks(path, scenario)
    return "\n".join([before, "", *comparison_markdown(scenario, results), "", after])


def around_marks(path: Path, scenario: Scenario) -> tuple[str, str]:
    """What stands before and after a table's place in a page of the docs, the marks around it included.

    Raises:
        UsageError: If there is no such page, or no such marks in it.
    """
    begin, end = f"<!-- compare {scenario.name} -->", "<!-- /compare -->"
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise UsageError(f"--docs {path}: cannot be read: {error.strerror}") from None
    before, mark, rest = text.partition(begin)
    _, closing, after = rest.partition(end)
    if not closing:
        raise UsageError(f"--docs {path}: expected the marks {begin} and {end} around the table's place")
    return before + mark, closing + after


def _seeds(results: Sequence[Result]) -> str:
    seeds = sorted({result.trial.seed for result in results})
    return f"seed {seeds[0]}" if len(seeds) == 1 else f"mean ± standard deviation over {len(seeds)} seeds"


def _lost(results: Sequence[Result]) -> list[Result]:
    return [result for result in results if not result.completed]
