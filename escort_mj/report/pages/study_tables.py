"""Tables of a study: what happened how often in each cell, medians and means, and levels compared."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

from escort_mj.files import write_text
from escort_mj.record.tables import comma_separated, headed, latex, markdown
from escort_mj.report.figures.drawing.scales import readable
from escort_mj.report.pages.html import Table, Text
from escort_mj.study.sweeps.design import Planned
from escort_mj.study.sweeps.quantities import COLLIDED, COMPLETED, PASSED, RATES
from escort_mj.study.sweeps.results import Factor, Results
from escort_mj.study.sweeps.statistics import LEVEL, Interval, Paired, Proportion, Summary, counted

MOST_CELLS = 500  # rows of a table
HEADS = {PASSED: "passed", COMPLETED: "completed", COLLIDED: "contacts"}
COUNTS = ("known", "never")
STATISTICS = ("mean", "mean_low", "mean_high", "median", "median_low", "median_high")


def run_cell(results: Results, run: Planned) -> list[Text]:
    """A run's cell and seed."""
    words = results.title(run.cell) or "all runs"
    return [Text(f"{run.cell}: {words}", run.cell), Text(str(run.seed), run.seed, kind="number")]


def number_cell(value: float, unit: str = "") -> Text:
    """A number, sorted by its value."""
    return Text(readable(value, unit), value, kind="number")


def signed(value: float) -> str:
    """A difference for people: three digits, infinite where one side alone says never."""
    return f"{'-' * (value < 0.0)}∞" if math.isinf(value) else readable(value)


def with_interval(value: float, interval: Interval, shown: Callable[[float], str] = readable) -> Text:
    """A number and its interval."""
    words = shown(value)
    if not math.isnan(interval.low):
        words += f" [{shown(interval.low)}, {shown(interval.high)}]"
    return Text(words, value, kind="number")


def shown_rate(happened: Proportion) -> str:
    """A share with its interval, in percent."""
    if not happened.of:
        return "unknown"
    low, high = (f"{100 * end:.0f}" for end in happened.interval)
    return f"{100 * happened.share:.0f} % [{low}, {high}]"


def cell_rates(results: Results) -> Table:
    """How often runs of each cell passed, completed, and touched something."""
    head = [
        ("cell", ""),
        *((factor.title, "") for factor in results.factors.values()),
        ("runs", "made of asked for"),
    ]
    head += [(HEADS[name], results.quantities[name].meaning) for name in RATES]
    head.append(("failed", "expectations that failed, and in how many runs"))
    rows = []
    for index in _cells(results):
        made, asked = results.rate(PASSED, index).of, len(results.of_cell(PASSED, index))
        row = [
            *_named(results, index),
            Text(str(made) if made == asked else f"{made} of {asked}", made, kind="number"),
        ]
        for name in RATES:
            happened = results.rate(name, index)
            row.append(Text(shown_rate(happened), happened.share, kind="number"))
        rows.append([*row, Text(_failed(results, index) or "-")])
    return Table(f"How often, with exact 95 % intervals{_cut(results)}", head, rows)


def cell_values(results: Results, quantities: Sequence[str]) -> Table:
    """Median and mean of quantities in each cell."""
    head = [("cell", ""), *((factor.title, "") for factor in results.factors.values())]
    for name in quantities:
        quantity = results.metrics[name]
        head += [(f"{quantity.head}: median", f"{name}: {quantity.about}"), ("mean", quantity.about)]
    rows = []
    for index in _cells(results):
        row = _named(results, index)
        for name in quantities:
            found = results.summary(name, index)
            row += [with_interval(found.median, found.median_interval), _mean(found)]
        rows.append(row)
    return Table(f"Medians and means, with 95 % bootstrap intervals{_cut(results)}", head, rows)


def _mean(found: Summary) -> Text:
    """A mean; how many it leaves out."""
    cell = with_interval(found.mean, found.mean_interval)
    return cell._replace(shown=f"{cell.shown}, never {found.never} of {found.known}") if found.never else cell


def _cells(results: Results) -> range:
    return range(min(len(results.cells), MOST_CELLS))


def _cut(results: Results) -> str:
    more = len(results.cells) > MOST_CELLS
    return f"; the first {MOST_CELLS} of {len(results.cells)} cells, all are in cells.csv" if more else ""


def _named(results: Results, index: int) -> list[Text]:
    """A cell's number and levels."""
    row = [Text(str(index), index)]
    for name, factor in results.factors.items():
        level = int(results.level_of_cell[name][index])
        value = factor.numbers[level] if factor.numbers else level
        row.append(Text(factor.levels[level], value, kind="number" if factor.numbers else ""))
    return row


def comparisons(results: Results, factor: Factor | None, quantities: Sequence[str]) -> Table | None:
    """Each level of a factor against its first."""
    if factor is None or len(factor.levels) < 2:
        return None
    compared = list(results.comparisons(factor, [*results.known(RATES), *quantities]))
    rows = []
    for quantity, first, level, found, p, better in compared:
        rows.append(
            [
                Text(results.quantities[quantity].head, kind="word"),
                Text(f"{level} - {first}", kind="word"),
                Text(_pairs(found, results.block), found.pairs),
                with_interval(found.difference, found.interval, signed),
                with_interval(found.median, found.median_interval, signed),
                with_interval(found.dominance, found.dominance_interval),
                Text(better or "-"),
                Text("-" if math.isnan(p) else f"{p:.2g}", p, kind="number"),
            ]
        )
    tests = sum(not math.isnan(one.p) and one.paired.alike < one.paired.pairs for one in compared)
    head = [
        ("quantity", ""),
        ("level", ""),
        ("pairs", f"and independent {results.block}s that they come from"),
        ("mean difference", "level minus first, with its 95 % interval"),
        ("median difference", f"median over {results.block}s, with its 95 % interval"),
        ("dominance", "share of pairs larger minus share smaller, with its 95 % interval"),
        ("better", f"where the test can tell: p below {1.0 - LEVEL:.2g}"),
        ("p", f"Wilcoxon, adjusted for the {counted(tests, 'test')} of this table (Holm)"),
    ]
    caption = (
        f"Levels of {factor.name} against {factor.levels[0]}; p for {counted(tests, 'test')} together (Holm)"
    )
    blocks = max((one.paired.blocks for one in compared), default=0)
    if tests and 2.0 ** (1 - blocks) * tests >= 1.0 - LEVEL:
        caption += f": {counted(blocks, results.block)} are too few to tell in so many"
    return Table(caption, head, rows)


def _pairs(found: Paired, block: str) -> str:
    """How many pairs there are, and what they come from."""
    words = counted(found.blocks, block)
    if found.pairs != found.blocks:
        words = f"{counted(found.pairs, 'pair')} from {words}"
    counts = {"alike": found.alike, "with never": found.never, "incomplete": found.unpaired}
    notes = [f"{count} {what}" for what, count in counts.items() if count]
    return f"{words} ({', '.join(notes)})" if notes else words


def _failed(results: Results, index: int) -> str:
    """The expectations that failed in a cell, the most frequent first."""
    return "; ".join(f"{words} ({count})" for words, count in results.failed(index).most_common())


def write_tables(tables: Sequence[Table], folder: Path, name: str) -> None:
    """Write tables for people as Markdown and LaTeX.

    Args:
        tables: What they are.
        folder: Where to write.
        name: Of the files, without suffix.
    """
    texts, documents = [], []
    for number, table in enumerate(tables, 1):
        head = [words for words, _ in table.head]
        rows = [[cell.shown for cell in row] for row in table.rows]
        texts += [f"**{table.caption}**", "", *markdown(head, rows), ""]
        documents.append(latex(head, rows, table.caption, f"{name}-{number}"))
    write_text(folder / f"{name}.md", "\n".join(texts))
    write_text(folder / f"{name}.tex", "\n".join(documents))


def write_cells(results: Results, path: Path) -> None:
    """Write every statistic of every cell as comma-separated values, in SI units, for other programs."""
    known = results.known(results.metrics)
    head = ["cell", *(factor.title for factor in results.factors.values()), "runs", "failed"]
    head += [f"{name}_{part}" for name in RATES for part in ("times", "of", "share", "low", "high")]
    for name in known:
        head += [f"{name}_{part}" for part in COUNTS]
        head += [headed(f"{name}_{part}", results.metrics[name].unit) for part in STATISTICS]
    lines: list[list[object]] = [[*head]]
    for index in range(len(results.cells)):
        line: list[object] = [index, *results.labels(index).values(), results.rate(PASSED, index).of]
        line.append(_failed(results, index))
        for name in RATES:
            happened = results.rate(name, index)
            line += [happened.times, happened.of, happened.share, *happened.interval]
        for name in known:
            found = results.summary(name, index)
            line += [found.known, found.never]
            line += [found.mean, *found.mean_interval, found.median, *found.median_interval]
        lines.append(["" if isinstance(cell, float) and math.isnan(cell) else cell for cell in line])
    write_text(path, comma_separated(lines))
