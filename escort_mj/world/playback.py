"""Known motion played through a world: what the monitor and the outer loop find of it, step by step.

Nothing is integrated. MuJoCo finds what touches; the forces that its solver would need for that say nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj import stopping
from escort_mj.components.setup import FunctionOfTime
from escort_mj.signals import EPISODE as COLUMNS
from escort_mj.world.callback import native_loop
from escort_mj.world.loop.addresses import behind, unpack_addresses
from escort_mj.world.model.build import World
from escort_mj.world.plant import Plant

Array = NDArray[np.float64]

LOOK = 256  # physics steps between two looks at whether to stop
PLACES = {column.name: place for place, column in enumerate(COLUMNS)}


def play(
    world: World,
    position: Array,
    velocity: Array,
    ways: Mapping[str, FunctionOfTime],
    hidden: NDArray[np.bool_],
    progress: Callable[[float, float], None] | None = None,
) -> tuple[Array, Array]:
    """Put bodies where they were, step by step, and let the monitor look.

    Args:
        world: Built with `seen`.
        position: Of the robots in each physics step, shape (steps, n, p) [m].
        velocity: Likewise [m/s].
        ways: Of bodies that move by themselves; those without one follow the scenario.
        hidden: Whether nothing is known of a physics step, shape (steps,): nobody looks at it, and nothing is
            concluded from the step before to the one after.
        progress: Called now and then.

    Returns:
        Samples of steps that are not hidden, shape (k, record_size), and contact episodes without forces,
        shape (e, EPISODE_SIZE).

    Raises:
        KeyboardInterrupt: If it was interrupted.
    """
    plant, model, schedule = Plant(world), world.model, world.schedule
    data, movers, (n, p) = plant.data, world.setup.movers, position.shape[1:]
    addresses = unpack_addresses(behind(model.numeric_data.ctypes.data), p)
    places, speeds, mover_places, mover_speeds = (
        first.astype(int)[:, None] + np.arange(p)
        for first in (
            addresses.qpos_address,
            addresses.dof_address,
            addresses.mover_qpos,
            addresses.mover_dof,
        )
    )
    timestep = float(model.opt.timestep)
    bodies = [
        "target" if mover.obstacle < 0 else world.bodies.names[n + 1 + mover.obstacle] for mover in movers
    ]
    times = timestep * np.arange(schedule.last + 1.0)
    paths = [ways.get(name, mover.path) for name, mover in zip(bodies, movers, strict=True)]
    moved = [(path.position(times), path.velocity(times)) for path in paths]
    sampled = {schedule.step(sample) for sample in range(schedule.count)}
    rows, taken, ended = np.empty((schedule.count, world.record_size)), 0, []
    with native_loop(world):
        position = position - _ahead(plant, places, position[0])
        for step, time in enumerate(times):
            if hidden[step]:
                continue
            if step and hidden[step - 1]:
                plant.state.watched_step[0] = 0.0  # as in the first step of all
            data.time = time
            data.qpos[places], data.qvel[speeds] = position[step], velocity[step]
            for mover, (where, speed) in enumerate(moved):
                data.qpos[mover_places[mover]], data.qvel[mover_speeds[mover]] = where[step], speed[step]
            plant.state.q_d[:], plant.state.q_d_rate[:] = plant.state.q, 0.0  # the law's own is unknown
            mujoco.mj_forward(model, data)
            if step in sampled or plant.is_full:
                plant.take_steps()
            if step in sampled:
                rows[taken] = plant.record
                taken += 1
            if plant.has_ended:
                ended.append(plant.ended())
            if step % LOOK == 0:
                if signal := stopping.asked():
                    raise KeyboardInterrupt(f"interrupted by {signal}")
                if progress is not None:
                    progress(time, times[-1])
    return rows[:taken], _without_forces(np.vstack([*ended, plant.under_way()]))


def _ahead(plant: Plant, places: NDArray[np.int64], position: Array) -> Array:
    """How far the points that the law controls are from robots' own places, shape (n, p) [m].

    Nobody logged where robots look: they do so as at the start.
    """
    plant.data.qpos[places] = position
    mujoco.mj_forward(plant.world.model, plant.data)
    ahead = np.asarray(plant.state.q - position)
    plant.reset()
    return ahead


def _without_forces(episodes: Array) -> Array:
    """Contact episodes as geometry alone would find them."""
    episodes[:, [PLACES["episode_peak_force"], PLACES["episode_impulse"]]] = 0.0
    episodes[:, PLACES["episode_peak_time"]] = episodes[:, PLACES["episode_start"]]
    return episodes
