"""`python -m benchmarks.crowds`: building, squeezing and flying a thousand robots, as in docs/crowds.md."""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.document import measure_page, table
from benchmarks.paired import alternate, effort, paired
from escort_mj import api
from escort_mj.native import cache
from escort_mj.numerics import thomson
from escort_mj.record.folder import read_run
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import build
from escort_mj.world.plant import Plant

PAGE = "crowds.md"
BUILT = (100, 1000, 2000)
SQUEEZED = {100: 60, 300: 30, 1000: 6}  # robots, and steps of a round
ROUNDS = 3
FEW = {"solver": "newton", "friction": True}
MISSION = "crowd"


def crowd(count: int) -> dict[str, Any]:
    """Key paths that make the crowd's mission one of so many robots at the same spacing."""
    size = (count / 1000) ** 0.5
    placement = {"within": 18.0 * size, "least_gap": 0.4}
    radius = {"mission.radius": 10.0 * size}
    return {"robots.count": count, "robots.placement": placement, "obstacles": [], "expect": [], **radius}


def building(count: int) -> list[str]:
    """Processor time of what comes before the first step [s]."""
    found: list[Any] = []
    where = cache.formations.folder

    def clocked(work: Callable[[], Any]) -> float:
        return effort(lambda: found.append(work()))

    read = clocked(lambda: api.load_scenario(MISSION, crowd(count)))
    with tempfile.TemporaryDirectory() as nothing:
        cache.formations.folder = Path(nothing)  # as on a new machine
        try:
            figure = clocked(lambda: thomson.even_points(count, 3))
        finally:
            cache.formations.folder = where
    world = clocked(lambda: build(found[0]))
    megabytes = len(found[-1].xml) / 1e6
    return [str(count), *(f"{each:.2f}" for each in (read, figure, world)), f"{megabytes:.1f}"]


def heap(count: int, physics: dict[str, Any]) -> Plant:
    """Robots in a dense cube, driven to the target in its middle until they are squeezed."""
    side = int(np.ceil(count ** (1 / 3)))
    grid = np.stack(np.meshgrid(*[np.arange(side)] * 3), axis=-1).reshape(-1, 3)[:count]
    keys = {
        "axes": 3,
        "robots": {"positions": (0.405 * (grid - grid.mean(axis=0) + 0.01)).tolist()},
        "mission": {"radius": 0.5, "behaviors": ["surface"], "target_feedforward": False},
        "target": {"radius": 0.001},
        "physics": physics,
    }
    plant = Plant(build(Scenario.model_validate(keys)))
    with native_loop(plant.world):
        plant.step(40 if count < max(SQUEEZED) else 30)
    return plant


def squeezed(count: int) -> list[str]:
    """A step of the whole loop where all robots touch [ms]: with the physics of few, and of a crowd."""
    plants = {"few": heap(count, FEW), "crowd": heap(count, {"solver": "cg", "friction": False})}
    steps = SQUEEZED[count]

    def turn(plant: Plant) -> float:
        with native_loop(plant.world):
            return effort(lambda: plant.step(steps)) / steps

    times = alternate({name: partial(turn, plant) for name, plant in plants.items()}, ROUNDS)
    assert not any(plant.warnings() for plant in plants.values())
    used = plants["crowd"].data.maxuse_arena / 2**20
    return [
        str(count),
        str(plants["crowd"].data.ncon),
        *(f"{1e3 * float(np.median(times[name])):.2f}" for name in ("few", "crowd")),
        f"**{paired(times, 'few', 'crowd'):.0f}**",
        f"{used:.1f} of {plants['crowd'].world.model.narena / 2**20:.0f}",
    ]


def mission() -> list[list[str]]:
    """The whole mission in a process of its own: what it cost, and what came of it."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / MISSION
        command = [sys.executable, "-m", "escort_mj", "run", MISSION, "--no-video", "--no-figures"]
        subprocess.run([*command, "--out", str(folder)], check=True)
        used, run = resource.getrusage(resource.RUSAGE_CHILDREN), read_run(folder)
        size = (folder / "trace.nc").stat().st_size / 1e6
    facts = [
        ["processor time, whole process", f"{used.ru_utime + used.ru_stime:.0f} s"],
        ["peak memory", f"{used.ru_maxrss / 1e6:.1f} GB"],
        ["trace", f"{size:.0f} MB, {run.trace.sizes['time']} samples"],
    ]
    for verdict in run.verdicts:
        found = verdict.message.partition(": ")[2]
        facts.append([f"{verdict.metric}: {verdict.demanded}", found or verdict.message])
    return facts


def tables() -> dict[str, str]:
    """Measures everything."""
    heads = {
        "building": [
            "robots",
            "read, placed, checked",
            "even formation, once",
            "built, compiled",
            "MJCF [MB]",
        ],
        "squeezed": ["robots", "contacts", "few [ms]", "crowd [ms]", "ratio", "arena [MiB]"],
        "mission": ["", MISSION],
    }
    rows = {
        "building": [building(count) for count in BUILT],
        "squeezed": [squeezed(count) for count in SQUEEZED],
        "mission": mission(),
    }
    return {name: table(heads[name], rows[name]) for name in heads}


if __name__ == "__main__":
    measure_page(__doc__, PAGE, tables)
