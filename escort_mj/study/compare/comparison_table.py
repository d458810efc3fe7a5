"""The table of a comparison: for a terminal, as Markdown, LaTeX, CSV and JSON."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from escort_mj.errors import UsageError
from escort_mj.record.tables import aligned, comma_separated, latex
from escort_mj.record.tables import markdown as markdown_rows
from escort_mj.record.window import Span
from escort_mj.scenario import Scenario
from escort_mj.study.compare.claims import value_text
from escort_mj.study.compare.comparison import (
    OUTERS,
    QUANTITIES,
    Combination,
    Result,
    Spread,
    quantities_over,
    rows,
    title_of,
    told_best,
)
from escort_mj.study.sweeps.design import Clock
from escort_mj.study.sweeps.statistics import LEVEL, counted

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


def cells(table: Sequence[Combination], name: str, winner: Combination | None, mark: str = "**") -> list[str]:
    """A column of the table; the combination that is better than each other is marked."""
    shown = [(row, cell(name, row.spreads[name])) for row in table]
    return [f"{mark}{text}{mark}" if row is winner else text for row, text in shown]


def columns_of(table: Sequence[Combination], scenario: Scenario, mark: str = "**") -> dict[str, list[str]]:
    """All columns of the table, by quantity."""
    told = told_best(table, clock_of(scenario))
    return {name: cells(table, name, told[name][0] if name in told else None, mark) for name in QUANTITIES}


def clock_of(scenario: Scenario) -> Clock:
    """How often runs of a scenario are looked at."""
    return Clock(scenario.physics.timestep, 1.0 / scenario.recording.rate)


def marked(table: Sequence[Combination], scenario: Scenario) -> str:
    """What is bold, and why nothing is where no test can tell."""
    rivals, seeds = len(table) - 1, len(table[0].results) if table else 0
    if rivals < 1 or 2.0 ** (1 - seeds) * rivals >= 1.0 - LEVEL:
        return f"Nothing is bold: no test can tell the best of {len(table)} with {counted(seeds, 'seed')}."
    test = (
        f"better than each other controller that completed every run, by Wilcoxon's signed-rank test over "
        f"{counted(seeds, 'seed')}: p below {1.0 - LEVEL:.2g}, corrected for {counted(rivals, 'other')} "
        "(Bonferroni) and all quantities of the table (Holm)."
    )
    told = told_best(table, clock_of(scenario))
    return f"**Bold**: {test}" if told else f"Nothing is bold: none is {test}"


def comparison_markdown(scenario: Scenario, results: Sequence[Result], over: Span | None = None) -> list[str]:
    """The table for people, with what its columns mean."""
    table = rows(results)
    columns = [[title_of(row.law) for row in table], [OUTERS[row.outer] for row in table]]
    columns += [[outcomes(row) for row in table], *columns_of(table, scenario).values()]
    heads = [quantity.heading for quantity in quantities_over(over).values()]
    return [
        *markdown_rows(
            ["law", "outer loop", "outcome", *heads], [list(row) for row in zip(*columns, strict=True)]
        ),
        "",
        f"`{scenario.name}`, {scenario.duration:g} s, {_seeds(results)}. {marked(table, scenario)}",
        "",
        *(f"- {result.trial.name}: {result.outcome}: {result.message}" for result in _lost(results)),
    ]


def subject(results: Sequence[Result]) -> str:
    """What is compared: laws, outer loops, or both."""
    several = {"laws": len({result.trial.law for result in results}) > 1}
    several |= {"outer loops": len({result.trial.outer for result in results}) > 1}
    return " and ".join(name for name, many in several.items() if many) or "laws"


def meanings(over: Span | None = None) -> list[str]:
    """What the columns mean, one line each."""
    return [f"- {one.head}: {one.about}" for one in quantities_over(over).values()]


def comparison_page(scenario: Scenario, results: Sequence[Result], over: Span | None = None) -> str:
    """The table as a page of its own."""
    head = [f"# {subject(results)[0].upper()}{subject(results)[1:]} compared: {scenario.name}", ""]
    return "\n".join([*head, *comparison_markdown(scenario, results, over), "", *meanings(over)]) + "\n"


def comparison_latex(scenario: Scenario, results: Sequence[Result], over: Span | None = None) -> str:
    """Return the table for LaTeX, one quantity per row."""
    table = rows(results)
    lone = len({row.outer for row in table}) == 1
    head = ["", *(title_of(row.law) if lone else row.title for row in table)]
    lines = [["outcome", *map(outcomes, table)]]
    columns, quantities = columns_of(table, scenario), quantities_over(over)
    lines += [[quantities[name].heading, *columns[name]] for name in QUANTITIES]
    bold = marked(table, scenario).replace("**", "")
    words = f"{scenario.name}, {scenario.duration:g} s, {_seeds(results)}. {bold}"
    return latex(head, lines, words)


def comparison_summary(scenario: Scenario, results: Sequence[Result], over: Span | None = None) -> list[str]:
    """The table for a terminal: the quantities that tell most, one line per combination."""
    table = rows(results)
    quantities, shown = quantities_over(over), columns_of(table, scenario, "*")
    columns = [["", "", *(row.title for row in table)]]
    columns += [[quantities[name].title, quantities[name].window, *shown[name]] for name in BRIEF]
    columns += [["outcome", "", *(outcomes(row) for row in table)]]
    return [
        *aligned(zip(*columns, strict=True)),
        marked(table, scenario).replace("**", "").replace("Bold:", "*:"),
    ]


def runs_table(results: Sequence[Result], over: Span | None = None) -> str:
    """One line per run, numbers in SI units, for other programs."""
    units = [f"{name} [{one.unit}], {one.window}" for name, one in quantities_over(over).items()]
    lines: list[list[object]] = [["law", "outer", "seed", "outcome", *units]]
    for result in results:
        values = ["" if value is None else value for value in result.values.values()]
        lines.append([*result.trial, result.outcome, *values])
    return comma_separated(lines)


def comparison_document(
    scenario: Scenario, results: Sequence[Result], over: Span | None = None
) -> dict[str, Any]:
    """Everything that was measured, as JSON can hold it."""
    told = told_best(rows(results), clock_of(scenario))
    return {
        "scenario": scenario.name,
        "duration": scenario.duration,
        "quantities": {name: quantity._asdict() for name, quantity in quantities_over(over).items()},
        "best": {name: {"law": row.law, "outer": row.outer, "p": p} for name, (row, p) in told.items()},
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


def into_page(path: Path, scenario: Scenario, results: Sequence[Result], over: Span | None = None) -> str:
    """The text of a page of the docs with this table between the marks that are there for it.

    Raises:
        UsageError: If there is no such page, or no such marks in it.
    """
    before, after = around_marks(path, scenario)
    return "\n".join([before, "", *comparison_markdown(scenario, results, over), "", after])


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
