"""The worst runs of a study, each as a scenario that runs again by itself."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from escort_mj.errors import ScenarioError
from escort_mj.files import write_text
from escort_mj.recognize import WORST as FOLDER
from escort_mj.scenario import dump_scenario, parse_scenario
from escort_mj.study.sweeps.design import Planned
from escort_mj.study.sweeps.results import Results


class Worst(NamedTuple):
    """One of the worst runs in one quantity.

    Attributes:
        quantity: Which.
        value: What it came to, infinite for never.
        run: The run.
    """

    quantity: str
    value: float
    run: Planned


def worst_runs(results: Results, quantities: Iterable[str], each: int) -> Iterator[Worst]:
    """The worst runs in each quantity, worst first; never is worse than any number.

    Args:
        results: The study's.
        quantities: Metrics; those in which all runs are alike have no worst one.
        each: How many at most.
    """
    for name in quantities:
        values = results.values(name)
        known = np.flatnonzero(~np.isnan(values))
        if not len(known) or (values[known] == values[known[0]]).all():
            continue
        costs = results.quantities[name].cost_sign * values[known]
        for index in known[np.argsort(-costs, kind="stable")][:each]:
            yield Worst(name, float(values[index]), results.runs[index])


def write_scenario(results: Results, run: Planned, folder: Path) -> Path | None:
    """Write the complete scenario of a run into `worst/` of the study's folder.

    Args:
        results: The study's.
        run: Which run.
        folder: The study's folder.

    Returns:
        The file; None where the run never had a scenario, because its cell is impossible with this seed.
    """
    row = results.rows[run.key]
    text = row.scenario
    if not text:
        settings = results.cells[run.cell].settings | {"seed": run.seed}
        try:
            name = results.cells[run.cell].scenario
            text = dump_scenario(parse_scenario(results.texts[name], name, settings))
        except ScenarioError:
            return None
    path = folder / FOLDER / f"cell{run.cell}_seed{run.seed}.yaml"
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, text)
    return path


def failed_runs(results: Results) -> list[Planned]:
    """Runs that did not complete, then those that failed a verdict."""
    failed = [run for run in results.runs if run.key in results.rows and not results.rows[run.key].passed]
    return sorted(failed, key=lambda run: results.rows[run.key].outcome == "completed")


def reason(results: Results, run: Planned) -> str:
    """Why a run failed, in words."""
    row = results.rows[run.key]
    if row.outcome != "completed":
        return row.message or row.outcome
    return "; ".join(v.message for v in row.verdicts if not v.passed)
