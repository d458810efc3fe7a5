"""Many missions at once: two threads against one, whole missions and stepping alone, and `mujoco.batch`.

Missions differ by seed, start, gains, mass and obstacles. Whole missions are built, stepped, recorded, summed
up and judged. Stepping alone shows what the machine gives: with our threads, and with MuJoCo's own.
"""

from __future__ import annotations

import hashlib
import itertools
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import mujoco.batch
import numpy as np

from benchmarks.document import table_of
from benchmarks.paired import alternate, paired, seconds
from escort_mj.api import load_scenario, run_many
from escort_mj.api.runs import Run
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import build
from escort_mj.world.plant import Plant

THREADS = 2
ROUNDS = 5
EACH = 6  # so many times eight missions in a round: the last of a thread is a small part of it
SAMPLES = 200  # of each mission in a round of stepping alone
VARIED = {
    "controller.slope": (10, 20),
    "robots.mass": (0.8, 1.3),
    "obstacles[0].position": ([7, 4.5], [7, -4]),
}
CASES = {
    "n = 5, plane, 4 obstacles, 60 s": ("main", ["expect=[{metric: contacts, at_most: 0}]"]),
    "n = 5, plane, 4 obstacles, 10 s": ("main", ["duration=10", "expect=[{metric: contacts, at_most: 0}]"]),
}


def missions(scenario: str, overrides: list[str], each: int = 1) -> list[Scenario]:
    """Missions of one kind that differ in everything but their size; so many of each choice, by seed."""
    choices = [zip(VARIED, choice, strict=True) for choice in itertools.product(*VARIED.values())]
    chosen = [[f"{key}={value}" for key, value in values] for values in choices]
    return [
        load_scenario(scenario, [*overrides, f"seed={seed}", *values])
        for seed, values in enumerate(chosen * each)
    ]


def digest(run: Run) -> str:
    """Of all that was recorded."""
    found = hashlib.sha256()
    for name in sorted(map(str, run.trace.data_vars)):
        found.update(run.trace[name].values.tobytes())
    return found.hexdigest()


def resident() -> float:
    """Memory of this process now [MB]; 0 where the system does not say."""
    status = Path("/proc/self/statm")
    return int(status.read_text().split()[1]) * 4096 / 1e6 if status.exists() else 0.0


def whole(scenario: str, overrides: list[str]) -> dict[str, Any]:
    """Times whole missions on one thread and on two.

    Raises:
        RuntimeError: If their bits differ.
    """
    these = missions(scenario, overrides, EACH)
    bits = [[digest(run) for run in run_many(these, count, traces=True)] for count in (1, THREADS)]
    _same(*bits)
    before = resident()

    def fly(threads: int) -> float:
        return seconds(lambda: list(run_many(these, threads)))

    times = alternate({f"{k}": partial(fly, k) for k in (1, THREADS)}, ROUNDS)
    flown = 2 * ROUNDS * len(these)
    return _found(times, len(these)) | {"growth": f"{(resident() - before) / flown:.2f}"}


def stepping(scenario: str, overrides: list[str]) -> dict[str, dict[str, Any]]:
    """Times stepping alone, our threads and MuJoCo's, on one thread and on two.

    Raises:
        RuntimeError: If their bits differ.
    """
    worlds = [build(one) for one in missions(scenario, overrides)]
    plants = {k: [Plant(world) for world in worlds] for k in (1, THREADS)}
    batches = {k: mujoco.batch.Batch(worlds[0].model, len(worlds), k) for k in (1, THREADS)}
    steps = SAMPLES * worlds[0].schedule.stride
    pools = {k: ThreadPoolExecutor(k) for k in (1, THREADS)}

    def sampled(plant: Plant) -> None:
        left = SAMPLES
        while left:
            left -= len(plant.samples(left))
            plant.ended()

    def ours(k: int) -> float:
        return seconds(lambda: list(pools[k].map(sampled, plants[k])))

    def theirs(k: int) -> float:
        return seconds(lambda: batches[k].step(nstep=steps))

    for batch in batches.values():
        batch.set_models([world.model for world in worlds])
        batch.reset(stage=mujoco.mjtStage.mjSTAGE_NONE)
    loops = {f"threads {k}": partial(ours, k) for k in plants}
    loops |= {f"batch {k}": partial(theirs, k) for k in batches}
    with native_loop(*worlds):
        times = alternate(loops, ROUNDS)
        for plant in itertools.chain(*plants.values()):  # the first sample was that of the first step
            plant.step(worlds[0].schedule.stride - 1)
    for pool in pools.values():
        pool.shutdown()
    places = [np.array([plant.data.qpos for plant in team]).tobytes() for team in plants.values()]
    _same(*places, *(batch.qpos.tobytes() for batch in batches.values()))
    return {
        way: _found({f"{k}": times[f"{way} {k}"] for k in (1, THREADS)}, len(worlds))
        for way in ("threads", "batch")
    }


def _same(first: Any, *others: Any) -> None:
    """Raises RuntimeError unless all are the same."""
    if any(other != first for other in others):
        raise RuntimeError("bits depend on the number of threads")


def _found(times: Any, count: int) -> dict[str, Any]:
    """Missions a second on one thread and on two, and the paired ratio."""
    rates = {f"rate {k}": count / float(np.median(times[f"{k}"])) for k in (1, THREADS)}
    return rates | {"ratio": paired(times, "1", f"{THREADS}")}


def measure() -> list[dict[str, Any]]:
    """Measures every case."""
    rows = [{"case": f"{name}: whole missions"} | whole(*case) for name, case in CASES.items()]
    alone = stepping(*next(iter(CASES.values())))
    named = {"threads": "threads", "batch": "`mujoco.batch`, without samples"}
    what = f"{SAMPLES} samples of each, steps only"
    return [*rows, *({"case": f"{what}: {named[way]}"} | row for way, row in alone.items())]


def tables(rows: list[dict[str, Any]]) -> dict[str, str]:
    """What was measured, as a table."""
    columns = {
        "missions": "{case}",
        "1 thread [1/s]": "{rate 1:.3g}",
        f"{THREADS} threads [1/s]": f"{{rate {THREADS}:.3g}}",
        "ratio": "**{ratio:.2f}**",
        "memory growth per mission [MB]": "{growth}",
    }
    return {"batch": table_of(({"growth": ""} | row for row in rows), columns)}
