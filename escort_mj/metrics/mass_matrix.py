"""Properties of the robots' equations of motion, from the truth channel."""

from __future__ import annotations

import numpy as np

from escort_mj.metrics.measure import Measure
from escort_mj.metrics.metric import metric
from escort_mj.metrics.reading import UNTOLD, largest_of, least_of, robot
from escort_mj.record.recording import Recorded, lacks


def _eigenvalues(trace: Recorded) -> np.ndarray:
    """Eigenvalues of each robot's mass matrix, ascending, shape (time, robot, axis) [kg]."""
    return np.linalg.eigvalsh(trace["mass_matrix"].values)


def _residual(trace: Recorded, name: str) -> Measure:
    """Largest of a residual of the truth channel."""
    return largest_of(trace, trace[name].values, robot) if name in trace else Measure(None, reason=UNTOLD)


@metric(unit="kg", watched=False, rank=230, needs=("truth",))
def mass_eigenvalue_min(trace: Recorded) -> Measure:
    """Smallest eigenvalue of a robot's mass matrix (property 1)."""
    if lacks(trace, "mass_matrix"):
        return Measure(None, reason=UNTOLD)
    return least_of(trace, _eigenvalues(trace)[..., 0], robot)


@metric(unit="kg", grows=True, watched=False, rank=240, needs=("truth",))
def mass_eigenvalue_max(trace: Recorded) -> Measure:
    """Largest eigenvalue of a robot's mass matrix (property 1)."""
    if lacks(trace, "mass_matrix"):
        return Measure(None, reason=UNTOLD)
    return largest_of(trace, _eigenvalues(trace)[..., -1], robot)


@metric(unit="kg/s", grows=True, watched=False, rank=250, needs=("truth",))
def skew_residual(trace: Recorded) -> Measure:
    """Largest entry of the symmetric part of dM/dt - 2 C (property 2)."""
    return _residual(trace, "skew_residual")


@metric(unit="N", grows=True, watched=False, rank=260, needs=("truth",))
def coriolis_residual(trace: Recorded) -> Measure:
    """Largest difference between C v + g and MuJoCo's bias force."""
    return _residual(trace, "coriolis_residual")
