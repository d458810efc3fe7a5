"""Environments for learning against the native loop of the same missions: what observing and rewarding costs.

Processor time of all threads is counted, so that what others take from the machine is not.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.document import table
from benchmarks.paired import alternate, paired
from escort_mj.api import load_scenario
from escort_mj.environments.single import EscortEnv
from escort_mj.environments.vector import EscortVectorEnv
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import build
from escort_mj.world.plant import Plant

MISSIONS, STEPS, ROUNDS = 16, 50, 9
NATIVE = "native loop alone"


def measure() -> list[dict[str, Any]]:
    """Measure all loops on 16 missions of five robots; a step is one command to one mission."""
    scenario = load_scenario("main", {"expect": []})
    worlds = [build(scenario.replace(seed=k), "velocity") for k in range(MISSIONS)]
    plants = [Plant(world) for world in worlds]
    single = EscortEnv(scenario)
    single.reset(seed=0)
    rest = np.zeros(single.action_space.shape or (), np.float32)

    def native() -> None:
        with native_loop(worlds[0]):
            for plant in plants:
                plant.step(STEPS * worlds[0].schedule.stride)

    def alone() -> None:
        for _ in range(STEPS):
            single.step(rest)

    loops = {NATIVE: _cost(native, MISSIONS * STEPS), "`EscortEnv`": _cost(alone, STEPS)}
    for threads in (1, 2):
        environment = EscortVectorEnv(MISSIONS, scenario, threads=threads)
        loops[f"`EscortVectorEnv`, {MISSIONS} missions, threads: {threads}"] = _vector(environment)
    times = alternate(loops, ROUNDS)
    return [
        {"loop": name, "rate": 1.0 / float(np.median(times[name])), "ratio": paired(times, name, NATIVE)}
        for name in loops
    ]


def _vector(environment: EscortVectorEnv) -> Callable[[], float]:
    environment.reset(seed=0)
    rest = np.zeros(environment.action_space.shape or (), np.float32)

    def many() -> None:
        for _ in range(STEPS):
            environment.step(rest)

    return _cost(many, MISSIONS * STEPS)


def _cost(function: Callable[[], object], steps: int) -> Callable[[], float]:
    """Processor time of a step, all threads together [s]."""

    def once() -> float:
        began = time.process_time()
        function()
        return (time.process_time() - began) / steps

    return once


def tables(rows: list[dict[str, Any]]) -> dict[str, str]:
    """What was measured, as a table."""
    head = ["loop", "steps per processor second", "cost / native loop"]
    return {
        "environments": table(head, [[r["loop"], f"{r['rate']:.3g}", f"**{r['ratio']:.2f}**"] for r in rows])
    }
