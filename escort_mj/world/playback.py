"""A world in which nothing is simulated: bodies are put where they were, and the monitor and the law look.

MuJoCo finds what touches; the forces that its solver would need for that say nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj import stopping
from escort_mj.components.setup import FunctionOfTime
from escort_mj.signals import EPISODE
from escort_mj.world.callback import native_loop
from escort_mj.world.loop.addresses import behind, unpack_addresses
from escort_mj.world.model.build import World
from escort_mj.world.plant import Plant

Array = NDArray[np.float64]

COLUMNS = {column.name: place for place, column in enumerate(EPISODE)}


class Motion(NamedTuple):
    """Where bodies were in each physics step.

    Attributes:
        position: Of the robots, shape (steps, n, p) [m].
        velocity: Likewise [m/s].
        ways: Of bodies that move by themselves; those without one follow the scenario.
        hidden: Whether nothing is known of a physics step, shape (steps,): nobody looks at it, and nothing is
            concluded from the step before to the one after.
    """

    position: Array
    velocity: Array
    ways: Mapping[str, FunctionOfTime]
    hidden: NDArray[np.bool_]


class Playback(Plant):
    """Plays motion through a world that was built with `seen`, one physics step after another."""

    def __init__(self, world: World, motion: Motion) -> None:
        super().__init__(world)
        self._motion, (n, p) = motion, motion.position.shape[1:]
        numbers = unpack_addresses(behind(world.model.numeric_data.ctypes.data), p)
        places = numbers.qpos_address, numbers.mover_qpos, numbers.dof_address, numbers.mover_dof
        self._qpos, self._mover_qpos, self._qvel, self._mover_qvel = (
            first.astype(int)[:, None] + np.arange(p) for first in places
        )
        movers, names = world.setup.movers, world.bodies.names
        bodies = ["target" if mover.obstacle < 0 else names[n + 1 + mover.obstacle] for mover in movers]
        times = self._timestep * np.arange(world.schedule.last + 1.0)
        paths = [motion.ways.get(name, mover.path) for name, mover in zip(bodies, movers, strict=True)]
        self._moved = [(path.position(times), path.velocity(times)) for path in paths]
        with native_loop(world):
            self._position = motion.position - self._ahead(motion.position[0])

    @property
    def _timestep(self) -> float:
        return float(self.world.model.opt.timestep)

    @property
    def steps(self) -> int:
        """How many physics steps have been played, hidden ones included."""
        return round(self.data.time / self._timestep)

    def step(self, count: int) -> bool:
        """Play so many physics steps; False if it was interrupted on the way (`stopping.asked`)."""
        for step in range(self.steps, self.steps + count):
            if not self._motion.hidden[step]:
                self._put(step)
                if self.is_full:
                    self.take_steps()
            self.data.time = self._timestep * (step + 1)
            if stopping.asked():
                return False
        self.take_steps()
        return True

    def _put(self, step: int) -> None:
        """Put bodies where they were in a physics step, and look."""
        data, state, motion = self.data, self.state, self._motion
        if step and motion.hidden[step - 1]:
            state.watched_step[0] = 0.0  # as in the first step of all
        data.qpos[self._qpos], data.qvel[self._qvel] = self._position[step], motion.velocity[step]
        for mover, (where, speed) in enumerate(self._moved):
            data.qpos[self._mover_qpos[mover]], data.qvel[self._mover_qvel[mover]] = where[step], speed[step]
        state.q_d[:], state.q_d_rate[:] = state.q, 0.0  # the law's own is unknown
        mujoco.mj_forward(self.world.model, data)

    def _ahead(self, position: Array) -> Array:
        """How far the points that the law controls are from robots' own places, shape (n, p) [m].

        Nobody logged where robots look: they do so as at the start.
        """
        self.data.qpos[self._qpos] = position
        mujoco.mj_forward(self.world.model, self.data)
        ahead = np.asarray(self.state.q - position)
        self.reset()
        return ahead


def without_forces(episodes: Array) -> Array:
    """Return contact episodes as geometry alone would find them, shape (e, EPISODE_SIZE)."""
    found = episodes.copy()
    found[:, [COLUMNS["episode_peak_force"], COLUMNS["episode_impulse"]]] = 0.0
    found[:, COLUMNS["episode_peak_time"]] = found[:, COLUMNS["episode_start"]]
    return found
