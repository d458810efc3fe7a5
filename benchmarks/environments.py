"""Environments for learning against MuJoCo alone and the native loop of the same missions.

Processor time of all threads is counted, so that what others take from the machine is not. What the clock
says holds where nothing else runs.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.bare import Bare
from benchmarks.document import table_of
from benchmarks.paired import alternate, paired
from escort_mj.api import load_scenario
from escort_mj.environments.single import EscortEnv
from escort_mj.environments.vector import EscortVectorEnv
from escort_mj.scenario.mission import Mission
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import build
from escort_mj.world.plant import Plant

MISSIONS, STEPS, ROUNDS = 16, 50, 9
BARE, NATIVE = "MuJoCo alone", "native loop alone"


def measure() -> list[dict[str, Any]]:
    """Measure all loops on 16 missions of five robots; a step is one command to one mission."""
    scenario = load_scenario("main", {"expect": []})
    worlds = [build(Mission(scenario.replace(seed=k), outside="velocity")) for k in range(MISSIONS)]
    plants, bare = [Plant(world) for world in worlds], [Bare(world) for world in worlds]
    stride = worlds[0].schedule.stride
    single = EscortEnv(scenario)
    single.reset(seed=0)
    rest = np.zeros(single.action_space.shape or (), np.float32)

    def native() -> None:
        with native_loop(worlds[0]):
            for plant in plants:
                plant.step(STEPS * stride)

    def alone() -> None:
        for _ in range(STEPS):
            single.step(rest)

    clock: dict[str, list[float]] = {}

    def cost(name: str, function: Callable[[], object], steps: int) -> Callable[[], float]:
        """Processor time of a step, all threads together [s]; that by the clock is noted."""

        def once() -> float:
            began, passed = time.process_time(), time.perf_counter()
            function()
            clock.setdefault(name, []).append((time.perf_counter() - passed) / steps)
            return (time.process_time() - began) / steps

        return once

    loops: dict[str, Callable[[], float]] = {
        BARE: lambda: float(np.mean([each.step(STEPS * stride) for each in bare])) * stride
    }
    runs: dict[str, tuple[Callable[[], object], int]] = {
        NATIVE: (native, MISSIONS * STEPS),
        "`EscortEnv`": (alone, STEPS),
    }
    for threads in (1, 2):
        environment = EscortVectorEnv(MISSIONS, scenario, threads=threads)
        name = f"`EscortVectorEnv`, {MISSIONS} missions, threads: {threads}"
        runs[name] = _vector(environment), MISSIONS * STEPS
    loops |= {name: cost(name, *run) for name, run in runs.items()}
    times = alternate(loops, ROUNDS)
    return [
        {
            "loop": name,
            "rate": 1.0 / float(np.median(times[name])),
            "clock": f"{1.0 / float(np.median(clock[name])):.3g}" if name in clock else "",
            "bare": paired(times, name, BARE),
            "native": paired(times, name, NATIVE),
        }
        for name in loops
    ]


def _vector(environment: EscortVectorEnv) -> Callable[[], object]:
    environment.reset(seed=0)
    rest = np.zeros(environment.action_space.shape or (), np.float32)

    def many() -> None:
        for _ in range(STEPS):
            environment.step(rest)

    return many


def tables(rows: list[dict[str, Any]]) -> dict[str, str]:
    """What was measured, as a table."""
    columns = {
        "loop": "{loop}",
        "steps per processor second": "{rate:.3g}",
        "steps per second": "{clock}",
        "cost / MuJoCo alone": "**{bare:.2f}**",
        "cost / native loop": "**{native:.2f}**",
    }
    return {"environments": table_of(rows, columns)}
