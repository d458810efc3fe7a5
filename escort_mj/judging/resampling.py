"""A log on the mission's clock: positions and velocities at every physics step, forces as totals over time.

Between two time stamps, a body moves along the cubic that has the positions and velocities of both
(Hermite); its velocity is interpolated linearly. Velocities that are not logged are central differences of
positions. Totals of forces are sums over the log's own time stamps.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from escort_mj.judging.log import FORCE, POSITION, VELOCITY, Gap, Log, Track, differentiated
from escort_mj.scenario.geometry.trajectory import Piecewise, Trajectory
from escort_mj.world.playback import Motion

Array = NDArray[np.float64]


def motion_of(
    log: Log, robots: tuple[str, ...], start: float, times: Array, hidden: NDArray[np.bool_]
) -> Motion:
    """Put the bodies of a log on the mission's clock.

    Args:
        log: Without faults.
        robots: Their names.
        start: Time stamp of the mission's start [s].
        times: Of the physics steps [s].
        hidden: Whether each of them lies within a gap of the log.

    Returns:
        Their motion; the ways are those of the target and of moving obstacles, as far as they are logged.
    """
    tracks = [log.tracks[name] for name in robots]
    others = {name: track for name, track in log.tracks.items() if name not in robots}
    return Motion(
        np.stack([path_of(track, start).position(times) for track in tracks], axis=1),
        np.stack([at(times + start, track.time, velocity_of(track)) for track in tracks], axis=1),
        {name: path_of(track, start) for name, track in others.items()},
        hidden,
    )


def path_of(track: Track, start: float) -> Trajectory:
    """The way of a body over the mission's time."""
    time, position, velocity = track.time - start, track.values[POSITION], velocity_of(track)
    step = np.diff(time)[:, None]
    slope = np.diff(position, axis=0) / step
    first, last = velocity[:-1], velocity[1:]
    square, cube = (3.0 * slope - 2.0 * first - last) / step, (first + last - 2.0 * slope) / step**2
    nothing = np.zeros((1, position.shape[1]))  # beyond the last time stamp: straight on
    parts = position, velocity, np.vstack([square, nothing]), np.vstack([cube, nothing])
    return Trajectory(
        tuple(
            Piecewise(np.column_stack([time, *(part[:, axis] for part in parts)]))
            for axis in range(position.shape[1])
        )
    )


def velocity_of(track: Track) -> Array:
    """Velocities as logged, or by differences, shape (k, p) [m/s]."""
    if VELOCITY in track.values:
        return track.values[VELOCITY]
    return differentiated(track.time, track.values[POSITION])


def at(times: Array, stamps: Array, values: Array) -> Array:
    """Values at times, linearly between time stamps, shape (times, ...)."""
    flat = values.reshape(len(values), -1)
    columns = [np.interp(times, stamps, column) for column in flat.T]
    return np.stack(columns, axis=1).reshape(len(times), *values.shape[1:])


def before(times: Array, stamps: Array, values: Array) -> Array:
    """The last values that were logged before times, shape (times, ...): of what changes in steps."""
    slack = 1e-9 * max(1.0, float(np.abs(stamps).max()))
    return np.asarray(values[np.clip(np.searchsorted(stamps, times + slack, side="right") - 1, 0, None)])


def without_gaps(stamps: Array, totals: Array, gaps: Iterable[Gap]) -> Array:
    """Running totals without what they gained in gaps of a log, shape (k, ...).

    Args:
        stamps: Their time stamps, shape (k,) [s].
        totals: Shape (k, ...).
        gaps: Of the log.
    """
    hidden = np.zeros_like(totals)
    for gap in gaps:
        ends = np.array([gap.start, gap.end])
        first, last = at(ends, stamps, totals)
        hidden[stamps >= gap.end] += last - first
    return np.asarray(totals - hidden)


def totals_of(track: Track, limit: float, start: float) -> dict[str, Array]:
    """Running totals of a robot's logged forces, at its own time stamps, each shape (k,).

    In a gap of its log they gain nothing.

    Args:
        track: With forces.
        limit: Force of a motor from which on it is saturated [N].
        start: Time stamp from which on they count [s].

    Returns:
        `effort`, `work`, `force_variation` and `saturated_time`, see `monitor.motion`.
    """
    force, velocity = track.values[FORCE], velocity_of(track)
    counts = (track.time[1:] > start) & ~track.wide
    step = np.diff(track.time) * counts
    power = np.abs((force * velocity).sum(axis=1))
    limited = np.max(np.abs(force), axis=1) >= limit * (1.0 - 1e-9)
    rates = {
        "effort": (force**2).sum(axis=1)[:-1] * step,
        "work": power[:-1] * step,
        "force_variation": np.abs(np.diff(force, axis=0)).sum(axis=1) * counts,
        "saturated_time": limited[:-1] * step,
    }
    return {name: np.concatenate([[0.0], np.cumsum(rate)]) for name, rate in rates.items()}
