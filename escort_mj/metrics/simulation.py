"""Whether the simulation itself can be trusted: speed and energy."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from escort_mj.metrics.metric import Measure, metric
from escort_mj.metrics.reading import largest_of, nobody

if TYPE_CHECKING:
    from escort_mj.record.recording import Recorded


def fastest_points(trace: Recorded) -> NDArray[np.float64]:
    """Return the largest speed of any point of each robot since the sample before, shape (time, n) [m/s]."""
    speeds: NDArray[np.float64] = trace["speed_max"].values
    return np.maximum(speeds, trace["point_speed_max"].values) if "point_speed_max" in trace else speeds


@metric(unit="1", grows=True, rank=210, every_step=True)
def tunneling(trace: Recorded) -> Measure:
    """Largest possible approach of two bodies per step, relative to the least thickness; tunneling above 1.

    At most the sum of the two largest displacements in a physics step among robots, target and obstacles,
    each that of its fastest point, turning included. It is of the fastest and the thinnest, so that it bounds
    what any two bodies can do.
    """
    moving = (fastest_points(trace), trace["target_speed_max"].values, trace["obstacle_speed_max"].values)
    speeds = np.column_stack(moving)
    steps = np.partition(speeds, -2, axis=1)[:, -2:].sum(axis=1, keepdims=True) * trace.attrs["timestep"]
    thickness, names = trace["body_thickness"].values, trace["body"].values
    fastest = int(np.argmax(speeds[int(np.argmax(steps))]))
    bodies = str(names[fastest]), str(names[int(np.argmin(thickness))])
    return largest_of(trace, steps / float(thickness.min()), lambda index: bodies)


@metric(unit="J", grows=True, rank=220, every_step=True)
def kinetic_energy_max(trace: Recorded) -> Measure:
    """Largest kinetic energy of all freely moving bodies, at any physics step."""
    return largest_of(trace, trace["kinetic_energy"].values[:, None], nobody)
