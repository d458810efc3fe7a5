"""Results of a study that nobody had to simulate: what is planted in them is known."""

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from escort_mj.api import scenarios_folder
from escort_mj.study.engine.store import Row, Store
from escort_mj.study.sweeps.definition import load_study
from escort_mj.study.sweeps.design import Cell, Design
from escort_mj.study.sweeps.results import Results, record_of
from tests.synthetic import make_verdict

STUDY = """
study: planted
description: Laws against mass & force limit, <planted>.
scenario: main
set: {duration: 2, expect: []}
vary: {controller: [apd_smc, pd, asmc], robots.mass: [0.2, 1, 5], robots.force_limit: [5, 10, 20]}
seeds: 4
"""

Planter = Callable[[Cell, int], Mapping[str, float | None] | str]
"""Metrics of a run, or the message of one that broke."""


def plant(cell: Cell, seed: int) -> Mapping[str, float | None] | str:
    """PD is twice, ASMC three times as far off; mass makes all worse; heavy ASMC breaks or never settles."""
    law, mass, limit = (cell.labels.get(name) for name in ("controller", "robots.mass", "robots.force_limit"))
    times, mass, limit = {"apd_smc": 1, "pd": 2, "asmc": 3}.get(str(law), 1), mass or 1.0, limit or 10.0
    if law == "asmc" and mass == 5 and seed == 2:
        return "robot 3 left the mission & is <gone>"
    return {
        "radius_error_mean": 0.01 * times * mass + 0.001 * seed,
        "settling_time": math.inf if law == "asmc" and mass == 5 else 5.0 + mass + 0.1 * seed,
        "obstacle_clearance_min": 0.5 - 0.1 * mass + 0.01 * seed,
        "robot_clearance_min": 1.0,
        "energy": 10.0 * times * limit + seed,
        "force_rms": 0.1 * limit,
        "chattering": 3.0 * times,
        "contacts": float(mass == 5 and seed == 4),
    }


def design(folder: Path, text: str = STUDY, scenario: str = "") -> Design:
    """A study laid out; its scenario may stand beside it, in one.yaml."""
    if scenario:
        (folder / "one.yaml").write_text(scenario)
    path = folder / "study.yaml"
    path.write_text(text)
    return Design(load_study(path), scenarios_folder())


def rows(laid_out: Design, planter: Planter = plant) -> dict[str, Row]:
    found = {}
    for run in laid_out.runs():
        cell = laid_out.cells[run.cell]
        planted = planter(cell, run.seed)
        failed = isinstance(planted, str)
        metrics: dict[str, Any] = {} if isinstance(planted, str) else dict(planted)
        error = metrics.get("radius_error_mean") or 0.0
        verdict = make_verdict(
            metric="radius_error_mean",
            demanded="at most 0.1 m",
            value=error,
            margin=0.1 - error,
            passed=not failed and error <= 0.1,
            message=f"radius_error_mean at most 0.1 m: {error:g} m",
        )
        found[run.key] = Row(
            run.key,
            run.seed,
            cell.settings,
            "diverged" if failed else "completed",
            str(planted) if failed else "completed 2 s",
            verdict.passed,
            1.0 if failed else 2.0,
            0.1,
            [verdict],
            "" if failed else f"name: main\nseed: {run.seed}\n",
            {"escort-mj": "0.1.0", "mujoco": "3.17.0"},
            metrics,
            "runs/kept" if failed else None,
        )
    return found


def results(folder: Path, text: str = STUDY, planter: Planter = plant) -> Results:
    laid_out = design(folder, text)
    return Results(record_of(laid_out), rows(laid_out, planter))


def study_folder(folder: Path, text: str = STUDY, planter: Planter = plant) -> Path:
    """A folder as a sweep leaves it."""
    out = folder / "out"
    laid_out = design(folder, text)
    with Store(out) as store:
        for row in rows(laid_out, planter).values():
            store.put(row)
    record_of(laid_out).write(out)
    (out / "runs" / "kept").mkdir(parents=True)
    (out / "runs.csv").write_text("seed\n")
    return out
