"""What the sliding-mode laws share: their common parameters and the gains that tell them apart."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import PositiveFloat

from escort_mj.control.elementary import tanh
from escort_mj.control.parameters import Parameters
from escort_mj.kernels import inlined

Array = NDArray[np.float64]

SMOOTHINGS = ("tanh", "saturation", "sign")


class Gains(NamedTuple):
    """Gains of the one inner loop of which every law here is a case.

    `tau = rho_hat + kp e + kd e_dot + k sw(s / boundary_layer)`, `d rho_hat/dt = mu s`.
    """

    kp: float
    kd: float
    k: float
    mu: float
    rho_hat_0: float


class SlidingModeLaw(Parameters):
    """Parameters of every sliding-mode law: the sliding surface, its smoothing, and anti-windup."""

    slope: PositiveFloat = 20.0
    """Slope of the sliding surface s = e_dot + slope * e [1/s] (paper: gamma)."""
    smoothing: Literal["tanh", "saturation", "sign"] = "tanh"
    """What stands for sgn(s): a tanh (remark 4), a clipped line, or the discontinuous sign itself."""
    boundary_layer: PositiveFloat = 1.0
    """Width of the smoothed zone of s [m/s]."""
    anti_windup: bool = True
    """While a motor is saturated outward: hold the estimate, and carry the reference with the robot."""


@inlined
def smooth_signs(x: Array, smoothing: int) -> None:
    """Replaces every x by what stands for sgn(x): a tanh (0), a clipped line (1), or the sign itself (2)."""
    if smoothing == 0:
        for j in range(x.shape[0]):
            x[j] = tanh(x[j])
    elif smoothing == 1:
        for j in range(x.shape[0]):
            x[j] = min(max(x[j], -1.0), 1.0)
    else:
        for j in range(x.shape[0]):
            x[j] = float(np.sign(x[j]))


@inlined
def is_winding_up(tau: float, s: float, limit: float) -> bool:
    """Whether the motor is saturated and the sliding variable pushes it further outward."""
    return abs(tau) > limit and tau * s > 0.0
