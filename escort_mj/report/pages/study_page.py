"""A study on one self-contained HTML page: tables, figures, failures, and the worst runs to be made again."""

from __future__ import annotations

import os
import shlex
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote

from markupsafe import Markup

from escort_mj.errors import UsageError
from escort_mj.files import write_text
from escort_mj.report.figures.studies.figures import draw_study
from escort_mj.report.pages.html import Table, Text, page, page_file
from escort_mj.report.pages.study_tables import (
    cell_rates,
    cell_values,
    comparisons,
    number_cell,
    run_cell,
    write_cells,
    write_tables,
)
from escort_mj.scenario.findings import did_you_mean
from escort_mj.study.sweeps.design import Planned
from escort_mj.study.sweeps.judged import rows_of, write_judged
from escort_mj.study.sweeps.quantities import COLLIDED, COMPLETED, PASSED
from escort_mj.study.sweeps.results import Results, open_results
from escort_mj.study.sweeps.statistics import proportion_of
from escort_mj.study.sweeps.worst import failed_runs, reason, worst_runs, write_scenario

PAGE, CELLS = "report.html", "cells.csv"
EACH = 3  # worst runs of a quantity
MOST_FAILURES = 200


def write_study_page(
    folder: Path,
    out: Path | None = None,
    compare: str | None = None,
    formats: Sequence[str] = ("svg",),
    quantities: Sequence[str] = (),
) -> Path:
    """Write the page of a study, its figures and the scenarios of its worst runs.

    Args:
        folder: Of a sweep's results.
        out: The page; None for `report.html` in the folder.
        compare: Factor whose levels are compared; None for what `Results.compared` finds.
        formats: File formats of the figures; the first one goes into the page: `svg` or `png`.
        quantities: Metrics that tables and figures show; empty for those that the study asks for.

    Returns:
        The page.

    Raises:
        UsageError: If the folder holds no results, or the study has no such factor or quantity.
        WriteError: If a file cannot be written.
    """
    results = open_results(folder)
    results.compared(compare)
    for name in quantities:
        if name not in results.metrics:
            hint = did_you_mean(name, results.metrics)
            raise UsageError(f"quantities: found {name}, which is no metric of these runs{hint}")
    results.chosen = [*dict.fromkeys(quantities)] or results.chosen
    path = page_file(out, folder / PAGE)
    write_cells(results, folder / CELLS)
    write_text(path, page("study.html", _parts(results, folder, path, compare, formats)))
    return path


def _parts(
    results: Results, folder: Path, path: Path, compare: str | None, formats: Sequence[str]
) -> dict[str, Any]:
    """What the page shows; of a study without runs, its design."""
    names = [name for name in ("study.yaml", "runs.csv", CELLS) if (folder / name).is_file()]
    parts = {
        "title": results.name,
        "results": results,
        "overview": _overview(results),
        "factors": _factors(results),
        "seeds": sorted({run.seed for run in results.runs}),
        "versions": _versions(results),
        "cells": CELLS,
        "files": {name: _relative(folder / name, path) for name in names},
    }
    if not results.rows:
        return parts
    judged = write_judged(results, folder) if results.expect else []
    head, rows = rows_of(judged)
    claims = [[Text(cell.strip("*")) for cell in row] for row in rows]
    shown = results.shown()
    factor = results.compared(compare)
    runs = failed_runs(results)
    rates, values = cell_rates(results), cell_values(results, shown)
    compared = comparisons(results, factor, shown)
    write_tables([rates, values, *([compared] if compared else [])], folder, Path(CELLS).stem)
    return parts | {
        "claims": Table("What is expected of cells", [(words, "") for words in head], claims, sortable=False),
        "rates": rates,
        "values": values,
        "rest": [name for name in results.known(results.metrics) if name not in shown],
        "factor": factor,
        "compared": compared,
        "figures": draw_study(results, folder, compare, formats),
        "failed": len(runs),
        "failures": _failures(results, runs, folder, path),
        "worst": _worst(results, shown, folder, path),
        "kept": _kept(results, folder, path),
    }


def _overview(results: Results) -> str:
    """How many runs, and how they ended."""
    words = f"{len(results.rows)} runs in {len(results.cells)} cells"
    if not results.rows:
        return words
    shares = [
        f"{happened.times} of {happened.of} {verb}"
        for name, verb in ((PASSED, "passed"), (COMPLETED, "completed"), (COLLIDED, "had contacts"))
        if (happened := proportion_of(results.values(name))).of
    ]
    return f"{words}: {', '.join(shares)}"


def _factors(results: Results) -> Table:
    """What is varied."""
    rows = []
    for factor in results.factors.values():
        some = factor.levels
        words = f"{some[0]} to {some[-1]}, drawn" if factor.drawn else ", ".join(some)
        rows.append(
            [Text(factor.name), Text(str(len(some)), kind="number"), Text(words), Text(factor.unit or "-")]
        )
    head = [("factor", ""), ("levels", ""), ("values", ""), ("unit", "")]
    return Table("What is varied", head, rows, sortable=False)


def _versions(results: Results) -> list[str]:
    """With which versions of programs how many runs were made."""
    sets = Counter(
        ", ".join(f"{name} {value}" for name, value in sorted(row.versions.items()))
        for row in results.rows.values()
    )
    return [f"{words or 'not recorded'}: {count} runs" for words, count in sets.most_common()]


def _failures(results: Results, runs: Sequence[Planned], folder: Path, path: Path) -> Table:
    """Runs that failed, and why."""
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
    return Table(f"{len(runs)} runs that failed{more}", head, rows)


def _worst(results: Results, quantities: Sequence[str], folder: Path, path: Path) -> Table:
    """The worst runs, each with the command that makes it again."""
    files: dict[str, Path | None] = {}
    rows = []
    for quantity, value, run in worst_runs(results, quantities, EACH):
        if run.key not in files:
            files[run.key] = write_scenario(results, run, folder)
        unit = results.metrics[quantity].unit
        rows.append(
            [
                Text(results.metrics[quantity].heading),
                number_cell(value, "" if unit == "1" else unit),
                *run_cell(results, run),
                Text(_command(files[run.key]), kind="message"),
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
    return Table(f"The {EACH} worst runs in each metric", head, rows)


def _kept(results: Results, folder: Path, path: Path) -> Table:
    """Links to all run folders that were kept."""
    kept = [run for run in results.runs if run.key in results.rows and _kept_in(results, run, folder)]
    rows = [[*run_cell(results, run), _folder(results, run, folder, path)] for run in kept]
    return Table(f"{len(kept)} run folders", [("cell", ""), ("seed", ""), ("kept", "run folder")], rows)


def _kept_in(results: Results, run: Planned, folder: Path) -> Path | None:
    """Folder of a run, if it is there."""
    name = results.rows[run.key].folder
    return folder / name if name and (folder / name).is_dir() else None


def _folder(results: Results, run: Planned, folder: Path, path: Path) -> Text:
    kept = _kept_in(results, run, folder)
    if kept is None:
        return Text("-")
    return Text(Markup('<a href="{}/">folder</a>').format(_relative(kept, path)))


def _command(scenario: Path | None) -> str:
    """What makes a run again, from where the report was made."""
    if scenario is None:
        return "- (its scenario is impossible with this seed)"
    shown = os.path.relpath(scenario)
    shown = str(scenario.resolve()) if shown.startswith("..") else shown
    out = shown.removesuffix(".yaml")
    words = Markup("<code>escort-mj run {} --out {}</code>")
    return words.format(shlex.quote(shown), shlex.quote(out))


def _relative(target: Path, page_path: Path) -> str:
    """A link from the page to a file."""
    return quote(os.path.relpath(target, page_path.parent).replace(os.sep, "/"))
