"""A study on one self-contained HTML page: tables, figures, failures, and the worst runs to be made again."""

from __future__ import annotations

import os
import shlex
from collections import Counter
from collections.abc import Iterator, Sequence
from html import escape
from pathlib import Path
from urllib.parse import quote

from escort_mj.record.files import make_folder, write_text
from escort_mj.report.figures.study_figures import draw_study
from escort_mj.report.pages.html import Text, folded, link, page, picture, table
from escort_mj.report.pages.study_tables import (
    SHOWN,
    cell_rates,
    cell_values,
    comparison_tables,
    number_cell,
    run_cell,
    shown_rate,
    write_cells,
)
from escort_mj.study.sweeps.design import Planned
from escort_mj.study.sweeps.quantities import COLLIDED, COMPLETED, PASSED, VALUES
from escort_mj.study.sweeps.results import Results, open_results
from escort_mj.study.sweeps.statistics import rate
from escort_mj.study.sweeps.worst import broken, reason, worst_runs, write_scenario

PAGE, CELLS = "report.html", "cells.csv"
EACH = 3  # worst runs of a quantity
MOST_FAILURES = 200

READING = """
Intervals hold 95 %. Those of shares are exact (Clopper and Pearson), those of medians and means percentile
bootstraps of 4000 draws with a fixed seed; with ten runs such an interval covers the truth about 90 % of the
time, with five 85 %. <em>Never</em>, such as a run that does not settle, counts as larger than any number in
medians, and is left out of means. Runs that broke off have no values: look at the share that completed beside
every median.
"""


def report(
    folder: Path, out: Path | None = None, compare: str | None = None, formats: Sequence[str] = ("svg",)
) -> Path:
    """Writes the page of a study, its figures and the scenarios of its worst runs.

    Args:
        folder: Of a sweep's results.
        out: The page; None for `report.html` in the folder.
        compare: Factor whose levels are compared; None for what `Results.compared` finds.
        formats: File formats of the figures; the first one goes into the page: `svg` or `png`.

    Returns:
        The page.

    Raises:
        UsageError: If the folder holds no results, or the study has no such factor.
        WriteError: If a file cannot be written.
    """
    results = open_results(folder)
    results.compared(compare)
    path = folder / PAGE if out is None else out
    make_folder(path.parent)
    write_cells(results, folder / CELLS)
    write_text(path, page(results.name, _body(results, folder, path, compare, formats)))
    return path


def _body(
    results: Results, folder: Path, path: Path, compare: str | None, formats: Sequence[str]
) -> Iterator[str]:
    """The page, part by part."""
    yield f"<h1>{escape(results.name)}</h1>"
    yield f"<p>{escape(results.description)}</p>"
    yield from _overview(results)
    yield from _design(results, folder, path)
    if not results.rows:
        return
    yield "<h2>Cells</h2>" + f"<p class=soft>{READING.strip()}</p>"
    yield cell_rates(results)
    shown = results.known(dict.fromkeys([*SHOWN, *results.judged()]))
    yield cell_values(results, shown)
    rest = [name for name in results.known(VALUES) if name not in shown]
    if rest:
        yield f"<p>Also in {link(_relative(folder / CELLS, path), CELLS)}: {escape(', '.join(rest))}.</p>"
    yield from comparison_tables(results, results.compared(compare), shown)
    yield "<h2>Figures</h2>"
    for drawn in draw_study(results, folder, compare, formats):
        yield picture(drawn.path, drawn.words)
    yield from _failures(results, folder, path)
    yield from _worst(results, shown, folder, path)
    yield from _kept(results, folder, path)


def _overview(results: Results) -> Iterator[str]:
    """How many runs, and how they ended."""
    made, asked = len(results.rows), len(results.runs)
    words = f"{made} runs in {len(results.cells)} cells"
    if made < asked:
        yield f"<p class=bad>{asked - made} of {asked} runs have not been made yet.</p>"
    if made:
        shares = [
            f"{shown_rate(rate(results.values(name)))} {verb}"
            for name, verb in ((PASSED, "passed"), (COMPLETED, "completed"), (COLLIDED, "had contacts"))
        ]
        words += ": " + ", ".join(shares)
    yield f"<p>{escape(words)}.</p>"


def _design(results: Results, folder: Path, path: Path) -> Iterator[str]:
    """What is varied, over which seeds, with which versions."""
    seeds = sorted({run.seed for run in results.runs})
    rows = []
    for factor in results.factors.values():
        some = factor.levels
        words = f"{some[0]} to {some[-1]}, drawn" if factor.drawn else ", ".join(some)
        rows.append(
            [Text(factor.name), Text(str(len(some)), kind="number"), Text(words), Text(factor.unit or "-")]
        )
    yield "<h2>Design</h2>"
    if rows:
        yield table(
            "What is varied",
            [("factor", ""), ("levels", ""), ("values", ""), ("unit", "")],
            rows,
            sortable=False,
        )
    sets = Counter(
        ", ".join(f"{name} {value}" for name, value in sorted(row.versions.items()))
        for row in results.rows.values()
    )
    versions = [f"{words or 'not recorded'}: {count} runs" for words, count in sets.most_common()]
    files = [name for name in ("study.yaml", "runs.csv", CELLS) if (folder / name).is_file()]
    links = [link(_relative(folder / name, path), name) for name in files]
    yield "<dl>"
    yield f"<dt>Scenario</dt><dd>{escape(results.scenario)}</dd>"
    yield f"<dt>Seeds</dt><dd>{seeds[0]} to {seeds[-1]}, the same in every cell</dd>"
    yield f"<dt>Versions</dt><dd>{'<br>'.join(map(escape, versions)) or '-'}</dd>"
    yield f"<dt>Files</dt><dd>{', '.join(links)}</dd></dl>"


def _failures(results: Results, folder: Path, path: Path) -> Iterator[str]:
    """Every run that failed, and why."""
    runs = broken(results)
    yield "<h2>Failures</h2>"
    if not runs:
        yield "<p>Every run passed.</p>"
        return
    rows = [
        [
            *run_cell(results, run),
            Text(results.rows[run.key].outcome),
            Text(reason(results, run), kind="message"),
            _folder(results, run, folder, path),
        ]
        for run in runs[:MOST_FAILURES]
    ]
    more = f"; the first {MOST_FAILURES} of them, all are in runs.csv" if len(runs) > MOST_FAILURES else ""
    head = [("cell", ""), ("seed", ""), ("outcome", ""), ("why", ""), ("kept", "run folder")]
    found = table(f"{len(runs)} runs that failed{more}", head, rows)
    yield found if len(rows) <= 20 else folded(f"{len(runs)} runs failed", found)


def _worst(results: Results, quantities: Sequence[str], folder: Path, path: Path) -> Iterator[str]:
    """The worst runs, each with the command that makes it again."""
    yield "<h2>Worst runs</h2>"
    files: dict[str, Path | None] = {}
    rows = []
    for quantity, value, run in worst_runs(results, quantities, EACH):
        if run.key not in files:
            files[run.key] = write_scenario(results, run, folder)
        unit = VALUES[quantity].unit
        rows.append(
            [
                Text(quantity),
                number_cell(value, "" if unit == "1" else unit),
                *run_cell(results, run),
                Text(_command(files[run.key]), html=True, kind="message"),
                _folder(results, run, folder, path),
            ]
        )
    head = [
        ("metric", ""),
        ("value", ""),
        ("cell", ""),
        ("seed", ""),
        ("makes it again", ""),
        ("kept", "run folder"),
    ]
    if rows:
        yield table(f"The {EACH} worst runs in each metric", head, rows)
    else:
        yield "<p>No run is worse than another.</p>"


def _kept(results: Results, folder: Path, path: Path) -> Iterator[str]:
    """Links to all run folders that were kept."""
    kept = [run for run in results.runs if run.key in results.rows and _kept_in(results, run, folder)]
    if not kept:
        return
    rows = [[*run_cell(results, run), _folder(results, run, folder, path)] for run in kept]
    yield "<h2>Kept runs</h2>"
    found = table(f"{len(kept)} run folders", [("cell", ""), ("seed", ""), ("kept", "run folder")], rows)
    yield found if len(rows) <= 20 else folded(f"{len(kept)} run folders", found)


def _kept_in(results: Results, run: Planned, folder: Path) -> Path | None:
    """Folder of a run, if it is there."""
    name = results.rows[run.key].folder
    return folder / name if name and (folder / name).is_dir() else None


def _folder(results: Results, run: Planned, folder: Path, path: Path) -> Text:
    kept = _kept_in(results, run, folder)
    return Text("-") if kept is None else Text(link(_relative(kept, path) + "/", "folder"), html=True)


def _command(scenario: Path | None) -> str:
    """What makes a run again, from where the report was made."""
    if scenario is None:
        return "- (its scenario is impossible with this seed)"
    shown = os.path.relpath(scenario)
    shown = str(scenario.resolve()) if shown.startswith("..") else shown
    out = shown.removesuffix(".yaml")
    return f"<code>escort-mj run {escape(shlex.quote(shown))} --out {escape(shlex.quote(out))}</code>"


def _relative(target: Path, page_path: Path) -> str:
    """A link from the page to a file."""
    return quote(os.path.relpath(target, page_path.parent).replace(os.sep, "/"))
