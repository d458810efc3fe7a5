"""The inner loop's laws."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from escort_mj.control.laws import ComputedTorque, LawParameters, Pd, SuperTwisting
from escort_mj.control.laws.sliding import SlidingModeLaw

Array = NDArray[np.float64]


def switching(s: Array, smoothing: str, width: float) -> Array:
    """What stands for sgn(s) in eq. 9: tanh (eq. 17), a clipped line, or the sign itself; shape of s."""
    if smoothing == "sign":
        return np.sign(s)
    return np.tanh(s / width) if smoothing == "tanh" else np.clip(s / width, -1.0, 1.0)


def demand(
    law: LawParameters, e: Array, e_dot: Array, rho_hat: Array, a_d: Array, mass: Array, bias: Array
) -> tuple[Array, Array]:
    """The law's forces and the rate of its estimate, while nothing is saturated, shape (n, p) each.

    Args:
        law: Its parameters.
        e: Tracking errors of position.
        e_dot: Tracking errors of velocity.
        rho_hat: Estimate [N].
        a_d: Derivative of the reference velocity, shape (n, p) [m/s^2].
        mass: Mass matrix of each robot, shape (n, p, p) [kg].
        bias: Bias force, shape (n, p) [N].
    """
    if isinstance(law, Pd):
        return law.proportional_gain * e + law.derivative_gain * e_dot + bias, np.zeros_like(e)
    if isinstance(law, ComputedTorque):
        wish = a_d + law.velocity_gain * e_dot + law.position_gain * e
        return np.einsum("iab,ib->ia", mass, wish) + bias, np.zeros_like(e)
    s = e_dot + law.slope * e
    assert isinstance(law, SlidingModeLaw)
    sw = switching(s, law.smoothing, law.boundary_layer)
    if isinstance(law, SuperTwisting):
        return law.root_gain * np.sqrt(np.abs(s)) * sw + rho_hat, law.integral_gain * sw
    gains = law.gains()
    return rho_hat + gains.kp * e + gains.kd * e_dot + gains.k * sw, gains.mu * s
