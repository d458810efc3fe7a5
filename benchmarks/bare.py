"""MuJoCo alone along the way of the native loop: what everything of ours is measured against.

Forces held for a whole round would lead robots elsewhere, apart or into one another, where a step costs
otherwise. So a guide goes natively where the measured loop goes, and MuJoCo alone takes a few steps at a time
from where it is.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager

import mujoco
import numpy as np

from benchmarks.paired import effort
from escort_mj.world.callback import native_loop
from escort_mj.world.loop.library import library
from escort_mj.world.model.build import World
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
