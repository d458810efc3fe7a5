"""Whether the simulation itself can be trusted: speed and energy."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from escort_mj.metrics.measure import Measure
from escort_mj.metrics.metric import metric
from escort_mj.metrics.reading import largest_of, nobody
from escort_mj.record.recording import Recorded


def fastest_points(trace: Recorded) -> NDArray[np.float64]:
    """Return the largest speed of any point of each robot since the sample before, shape (time, n) [m/s]."""
    speeds: NDArray[np.float64] = trace["speed_max"].values
    return np.maximum(speeds, trace["point_speed_max"].values) if "point_speed_max" in trace else speeds


@metric(unit="1", grows=True, rank=210, every_step=True)
def tunneling(trace: Recorded) -> Measure:
    """Largest possible approach of two bodies per step, relative to the least thickness; tunneling above 1.

    The sum of the two largest displacements in a physics step among robots, target and obstacles, each that
    of its fastest point, turning included, in whichever step it occurs. It is of the fastest and the
    thinnest, so that it bounds what any two bodies can do.
    """
    moving = (fastest_points(trace), trace["target_speed_max"].values, trace["obstacle_speed_max"].values)
    speeds = np.column_stack(moving)
    thickness, names = trace["body_thickness"].values, trace["body"].values
    bodies = str(names[int(np.argmax(speeds.max(axis=0)))]), str(names[int(np.argmin(thickness))])
    fastest = largest_of(trace, speeds, lambda index: bodies)
    step = np.sort(speeds.max(axis=0))[-2:].sum() * trace.attrs["timestep"]
    return fastest._replace(value=float(step / thickness.min()))


@metric(unit="J", grows=True, rank=220, every_step=True)
def kinetic_energy_max(trace: Recorded) -> Measure:
    """Largest kinetic energy of all freely moving bodies, at any physics step."""
    return largest_of(trace, trace["kinetic_energy"].values[:, None], nobody)
