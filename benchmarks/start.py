"""How long a fresh process takes to its first step: kernels on disk, or none at all.

As `escort-mj run` does: read and check a scenario, build its world, get the native callbacks, take a step.
The measure is a process that imports MuJoCo and numba and ends; a warm start has no need of numba.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from typing import Any

import numpy as np

from benchmarks.document import table
from benchmarks.paired import alternate, paired
from escort_mj.native.cache import FOLDER

BARE = "import mujoco, numba"
FIRST_STEP = """
import sys
import escort_mj.cli.runs
from escort_mj import api
scenario = api.load_scenario(sys.argv[1])
from escort_mj.world.model.build import build
from escort_mj.world.callback import native_loop
from escort_mj.world.plant import Plant
world = build(scenario)
with native_loop(world):
    Plant(world).step(1)
"""
NOTHING_SHIPS = """
from escort_mj.native import shipped
shipped.FOLDER = shipped.FOLDER / "nowhere"
"""
CASES = {"n = 5, plane": "main", "n = 6, space": "main_3d"}
WARM_ROUNDS, COLD_ROUNDS = 7, 2


def process(*arguments: str, folder: str | None = None) -> dict[str, float]:
    """Runs Python once: wall time, and processor time of it and its children [s]."""
    environment = dict(os.environ) | ({FOLDER: folder} if folder else {})
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run([sys.executable, "-c", *arguments], check=True, env=environment)
    wall, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    return {"wall": wall, "effort": after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime}


def measure() -> list[dict[str, Any]]:
    """Starts processes in turns, warm and cold."""
    rows = []
    for name, scenario in CASES.items():
        walls: dict[str, list[float]] = {"bare": [], "warm": [], "cold": []}

        def started(how: str, *arguments: str, folder: str | None = None, walls: Any = walls) -> float:
            spent = process(*arguments, folder=folder)
            walls[how].append(spent["wall"])
            return spent["effort"]

        def cold(scenario: str = scenario, started: Any = started) -> float:
            with tempfile.TemporaryDirectory() as folder:
                return float(started("cold", NOTHING_SHIPS + FIRST_STEP, scenario, folder=folder))

        def warm(scenario: str = scenario, started: Any = started) -> float:
            return float(started("warm", FIRST_STEP, scenario))

        def bare(started: Any = started) -> float:
            return float(started("bare", BARE))

        process(FIRST_STEP, scenario)  # from here on its kernels are on disk
        times = alternate({"bare": bare, "warm": warm}, WARM_ROUNDS)
        cold_times = alternate({"bare": bare, "cold": cold}, COLD_ROUNDS)
        rows.append(
            {
                "name": name,
                **{f"{how}_wall": float(np.median(seconds)) for how, seconds in walls.items()},
                "warm_effort": float(np.median(times["warm"])),
                "cold_effort": float(np.median(cold_times["cold"])),
                "warm_ratio": paired(times, "warm", "bare"),
                "cold_ratio": paired(cold_times, "cold", "bare"),
            }
        )
    return rows


def tables(rows: list[dict[str, Any]]) -> dict[str, str]:
    """Seconds, and ratios of processor time."""
    head = [
        "mission",
        "import of MuJoCo and numba [s]",
        "warm [s]",
        "processor time [s]",
        "/ import",
        "cold [s]",
    ]
    head += ["processor time [s]", "/ import"]
    keys = ("bare_wall", "warm_wall", "warm_effort", "warm_ratio", "cold_wall", "cold_effort", "cold_ratio")
    return {"start": table(head, [[row["name"], *(f"{row[key]:.2f}" for key in keys)] for row in rows])}
