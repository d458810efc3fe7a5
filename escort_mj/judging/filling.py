"""Samples of a replayed log: what else the log tells is written into them, what nobody knows taken out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from escort_mj.judging.log import FORCE, REFERENCE, Log, Track, Wanted
from escort_mj.judging.resampling import at, before, totals_of, velocity_of, without_gaps
from escort_mj.scenario import Scenario
from escort_mj.scenario.geometry.obstacles import obstacles_of
from escort_mj.scenario.geometry.trajectory import Piecewise, Trajectory
from escort_mj.signals import KNOWLEDGE, LIDAR, RADIO, SIGNALS, columns
from escort_mj.world.model.build import World

Array = NDArray[np.float64]

UNKNOWN = (
    *("force", "disturbance", "outer_updates", "q_d", "e", "s", "tau", "rho_hat"),
    *("saturated_time", "effort", "work", "force_variation", "drive_force", "mover_work"),
    *("q_measured", "v_measured", "target_position_measured", "target_velocity_measured"),
)
"""Signals that are unknown unless the log contains them."""
TOTALS = ("outer_updates", "saturated_time", "effort", "work", "force_variation")
"""Signals that a log may contain and that only grow."""
SENSED = (KNOWLEDGE, RADIO, LIDAR)
"""Channels of signals that no log contains: what robots see, hear and estimate."""
DEMANDED = (
    *("v_d", "e_dot", "avoidance_active", "phase", "ruling"),
    *("task_error", "task_wish", "task_removed", "task_angle", "threat"),
)
"""Signals that are unknown likewise where the outer loop sees more than the log tells, or something else."""
OF_TARGET = (
    *("target_position", "target_velocity", "target_speed_max"),
    *("target_clearance", "target_clearance_body", "kinetic_energy"),
)
OF_OBSTACLES = ("obstacle_position", "obstacle_distance", "obstacle_speed_max", "kinetic_energy")
OF_OPPONENTS = ("opponent_status", "interceptor")
OF_TEAMS = ("team_center", "team_velocity")
"""Signals that are unknown where one of such bodies is not in the log."""
AWAY = 1e4  # where bodies are that nobody logged: away from all others [m]


def ways_away(names: Sequence[str], axes: int) -> dict[str, Trajectory]:
    """Return ways of bodies that nobody logged: each rests on the first axis, away from all others."""
    return {
        name: Trajectory(
            tuple(
                Piecewise(np.array([[0.0, AWAY * place * (axis == 0), 0.0, 0.0, 0.0]]))
                for axis in range(axes)
            )
        )
        for place, name in enumerate(names, 1)
    }


def fill(
    samples: Array, world: World, log: Log, wanted: Wanted, start: float, missing: Sequence[str]
) -> list[str]:
    """Write what else the log tells into samples; what it does not becomes NaN, or 0 where that is none.

    Of obstacles, only those become NaN that the log does not contain.

    Args:
        samples: Shape (k, record_size); changed.
        world: Of the mission.
        log: As it was read.
        wanted: What was looked for in it.
        start: Time stamp of the mission's start [s].
        missing: Bodies that it should tell of and does not; meanwhile they were `ways_away`.

    Returns:
        Names of the signals that are unknown.
    """
    times = samples[:, 0] + start
    known = _logged(log, wanted, world, times, start)
    moving = len(wanted.robots) + len(world.setup.movers)
    more = world.model.nv > moving * world.setup.axes  # turning, rolling, swinging loads: nobody logged these
    asked = (*_unknown_of(missing, world.scenario), *("kinetic_energy",) * more)
    unknown = [name for name in dict.fromkeys(asked) if name not in known]
    hidden = wanted.unforeseen - log.tracks.keys()
    lacks = np.array([name in hidden for name in world.bodies.names[len(wanted.robots) + 1 : -1]], dtype=bool)
    kinds = {signal.name: signal for signal in SIGNALS if signal.recorded(world.sizes)}
    sensed = [signal.name for signal in SIGNALS if signal.channel in SENSED]
    unknown = [name for name in unknown if name in kinds or name in sensed]
    for name in (*known, *(name for name in unknown if name in kinds)):
        signal = kinds[name]
        nothing = np.nan if np.dtype(signal.dtype).kind == "f" else 0.0
        place = columns(name, world.sizes)
        if name in known:
            samples[:, place] = known[name].reshape(len(samples), -1)
        elif "obstacle" in signal.dims:
            shape = [world.sizes[dim] for dim in signal.dims]
            where = lacks[:, None] if signal.dims[0] == "obstacle" and len(shape) > 1 else lacks
            samples[:, place] = np.where(np.broadcast_to(where, shape).ravel(), nothing, samples[:, place])
        else:
            samples[:, place] = nothing
    for number, name in enumerate(missing if len(samples) else (), 1):
        _put_back(samples, world, name, AWAY * number)
    return unknown


def _put_back(samples: Array, world: World, name: str, away: float) -> None:
    """Put a body that nobody logged where it starts in the scenario, for pictures; nothing is judged of it.

    Args:
        samples: Shape (k, record_size).
        world: Of the mission.
        name: Of the body.
        away: Where it was on the first axis meanwhile [m].
    """
    p, obstacle = world.setup.axes, world.bodies.names.index(name) - len(world.team.mass) - 1
    start = next(mover.path.position(0.0) for mover in world.setup.movers if mover.obstacle == obstacle)
    signal = "target_position" if obstacle < 0 else "obstacle_position"
    first = columns(signal, world.sizes).start + p * max(obstacle, 0)
    samples[:, first : first + p] = start
    coordinates = columns("qpos", world.sizes)
    first = coordinates.start + int(np.argmax(samples[0, coordinates] == away))
    samples[:, first : first + p] = start
    for name, nearest in (("clearance", "clearance_body"), ("target_clearance", "target_clearance_body")):
        distance, body = samples[:, columns(name, world.sizes)], samples[:, columns(nearest, world.sizes)]
        far = distance > 0.5 * AWAY
        distance[far], body[far] = np.inf, -1.0


def _unknown_of(missing: Sequence[str], scenario: Scenario) -> Iterator[str]:
    """What is not known of a mission whose log does not contain some bodies, and no sensor's values."""
    yield from UNKNOWN
    sensed = {KNOWLEDGE: scenario.knowledge, RADIO: scenario.communication, LIDAR: scenario.sensing.lidar}
    yield from (signal.name for signal in SIGNALS if sensed.get(signal.channel) is not None)
    if missing or scenario.knowledge is not None or scenario.sensing != type(scenario.sensing)():
        yield from DEMANDED
    if "target" in missing:
        yield from OF_TARGET
    for body in obstacles_of(scenario):
        if body.name in missing:
            yield from OF_OBSTACLES
            yield from {"opponents": OF_OPPONENTS, "teams": OF_TEAMS}.get(str(body.path[0]), ())


def _logged(log: Log, wanted: Wanted, world: World, times: Array, start: float) -> dict[str, Array]:
    """Signals that the log contains, at times, each of shape (times, ...)."""
    tracks: list[Track] = [log.tracks[name] for name in wanted.robots]
    found: dict[str, Array] = {}
    if all(FORCE in track.values for track in tracks):
        found["force"] = np.stack([at(times, track.time, track.values[FORCE]) for track in tracks], axis=1)
        totals = [
            (track, totals_of(track, float(limit), start))
            for track, limit in zip(tracks, world.setup.force_limit, strict=True)
        ]
        for name in totals[0][1]:
            each = [at(times, track.time, one[name]) for track, one in totals]
            found[name] = np.stack(each, axis=1)
    if all(REFERENCE in track.values for track in tracks):
        found["v_d"] = np.stack([at(times, track.time, track.values[REFERENCE]) for track in tracks], axis=1)
    kinds = {signal.name: np.dtype(signal.dtype).kind for signal in SIGNALS}
    for name, (stamps, values) in log.signals.items():
        if name in TOTALS:
            values = without_gaps(stamps, values, log.gaps)
        found[name] = (at if kinds[name] == "f" else before)(times, stamps, values)
    if "v_d" in found and "e_dot" not in found:
        speed = [at(times, track.time, velocity_of(track)) for track in tracks]
        found["e_dot"] = found["v_d"] - np.stack(speed, axis=1)
    return found
