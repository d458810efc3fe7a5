"""MuJoCo alone along the way of the native loop: what everything of ours is measured against.

Forces held for a whole round would lead robots elsewhere, apart or into one another, where a step costs
otherwise. So a guide goes natively where the measured loop goes, and MuJoCo alone takes a few steps at a time
from where it is.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial

import mujoco
import numpy as np

from benchmarks.paired import alternate, effort, paired
from escort_mj.scenario import Scenario
from escort_mj.world.callback import native_loop
from escort_mj.world.loop.library import library
from escort_mj.world.model.build import World, build
from escort_mj.world.plant import Plant

STATE = mujoco.mjtState.mjSTATE_INTEGRATION
AT_ONCE = 200  # steps with forces held: long against a look at the clock, short against the mission


class Bare:
    """Steps with forces held, each few of them from a state that the native loop comes through."""

    def __init__(self, world: World) -> None:
        self._world, self._guide, self._held = world, Plant(world), mujoco.MjData(world.model)

    def skip(self, steps: int) -> None:
        """Goes on natively."""
        with native_loop(self._world):
            self._guide.step(steps)

    def step(self, steps: int) -> float:
        """Goes as many steps as the native loop does in a round.

        Returns:
            Processor time a step [s] of MuJoCo alone; to copy states and to go on natively is not counted.
        """
        spent = 0.0
        for first in range(0, steps, AT_ONCE):
            count = min(AT_ONCE, steps - first)
            copy_state(self._world, self._guide.data, self._held)
            spent += self._hold(count)
            self.skip(count)
        return spent / steps

    def _hold(self, steps: int) -> float:
        with no_timer():
            return effort(lambda: mujoco.mj_step(self._world.model, self._held, nstep=steps))


def against_bare(
    scenarios: Mapping[str, Scenario], before: int, steps: int, rounds: int
) -> tuple[dict[str, float], dict[str, float]]:
    """Let loops and MuJoCo alone take turns.

    Args:
        scenarios: By name.
        before: Steps of each before the first round.
        steps: Of a round.
        rounds: How many.

    Returns:
        Of each scenario the median time of a step of MuJoCo alone [s], and the paired ratio of the loop.
    """
    loops: dict[str, Callable[[], float]] = {}
    for name, scenario in scenarios.items():
        world = build(scenario)
        plant, bare = Plant(world), Bare(world)

        def native(world: World = world, plant: Plant = plant) -> float:
            with native_loop(world):
                return effort(lambda: plant.step(steps)) / steps

        with native_loop(world):
            plant.step(before)
        bare.skip(before)
        loops |= {f"bare {name}": partial(bare.step, steps), name: native}
    times = alternate(loops, rounds)
    alone = {name: float(np.median(times[f"bare {name}"])) for name in scenarios}
    return alone, {name: paired(times, name, f"bare {name}") for name in scenarios}


@contextmanager
def no_timer() -> Iterator[None]:
    """Takes away the clock that the bindings install, as the native loop does."""
    timer = ctypes.c_void_p.in_dll(library(), "mjcb_time")
    before, timer.value = timer.value, None
    try:
        yield
    finally:
        timer.value = before


def copy_state(world: World, source: mujoco.MjData, target: mujoco.MjData) -> None:
    """Gives one data the physical state, the forces and the controls of another."""
    state = np.empty(mujoco.mj_stateSize(world.model, STATE))
    mujoco.mj_getState(world.model, source, state, STATE)
    mujoco.mj_setState(world.model, target, state, STATE)
    target.ctrl[:] = source.ctrl
