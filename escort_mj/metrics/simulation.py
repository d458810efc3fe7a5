"""Whether the simulation itself can be trusted: speed and energy."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from escort_mj.metrics.metric import Measure, metric
from escort_mj.metrics.reading import largest_of, nobody

if TYPE_CHECKING:
    from escort_mj.record.recording import Recorded


@metric(unit="1", grows=True, rank=210, every_step=True)
def tunneling(trace: Recorded) -> Measure:
    """Largest possible approach of two bodies per step, relative to the least thickness; tunneling above 1.

    At most the sum of the two largest displacements in a physics step among robots, target and obstacles. It
    is of the fastest and the thinnest, so that it bounds what any two bodies can do.
    """
    moving = ("speed_max", "target_speed_max", "obstacle_speed_max")
    speeds = np.column_stack([trace[name].values for name in moving])
    steps = np.partition(speeds, -2, axis=1)[:, -2:].sum(axis=1, keepdims=True) * trace.attrs["timestep"]
    thickness, names = trace["body_thickness"].values, trace["body"].values
    fastest = int(np.argmax(speeds[int(np.argmax(steps))]))
    bodies = str(names[fastest]), str(names[int(np.argmin(thickness))])
    return largest_of(trace, steps / float(thickness.min()), lambda index: bodies)


@metric(unit="J", grows=True, rank=220, every_step=True)
def kinetic_energy_max(trace: Recorded) -> Measure:
    """Largest kinetic energy of all freely moving bodies, at any physics step."""
    return largest_of(trace, trace["kinetic_energy"].values[:, None], nobody)
