"""Numbers of physics steps, from times."""

from __future__ import annotations

import math

SLACK = 1e-3  # of a step: a simulation's time is a sum of timesteps, each rounded


def first_step(time: float, timestep: float) -> int:
    """The first physics step at or after a time [s]."""
    return math.ceil(time / timestep - SLACK)


def last_step(time: float, timestep: float) -> int:
    """The last physics step at or before a time [s]."""
    return math.floor(time / timestep + SLACK)
