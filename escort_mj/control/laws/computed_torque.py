"""Computed torque with the exact mass matrix: the unfair best, for no robot knows its own so well."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import NonNegativeFloat

from escort_mj.control.laws.tracking import Gains, TrackingLaw
from escort_mj.kernels import inlined

Array = NDArray[np.float64]


class ComputedTorque(TrackingLaw):
    """Inverse dynamics: tau = M (a_d + k_v e_dot + k_p e) + bias, with MuJoCo's own M and bias force.

    Without noise and disturbance the error obeys e'' + k_v e' + k_p e = 0, whatever the mass. a_d is the
    outer loop's velocity differentiated backward over a physics step behind a first-order filter, since that
    velocity carries measurement noise.

    M is the block of the mass matrix that belongs to the robot's position: m times the identity. A sphere
    that rolls turns as well, and through the contact with the floor that makes it 7/5 m heavy: the contact
    is no part of the mass matrix, so the law does not know.
    """

    needs_model: ClassVar[bool] = True

    law: Literal["computed_torque"] = "computed_torque"
    position_gain: NonNegativeFloat = 100.0
    """Gain of the position error [1/s^2]."""
    velocity_gain: NonNegativeFloat = 20.0
    """Gain of the velocity error [1/s]; 2 sqrt(position_gain) is critical damping."""
    acceleration_filter: NonNegativeFloat = 0.1
    """Time constant of the filter of the differentiated velocity reference [s]; 0 for none."""

    def gains(self) -> Gains:
        """k_p and k_v."""
        return Gains(self.position_gain, self.velocity_gain, 0.0, 0.0, 0.0)


@inlined
def force_of(acceleration: Array, mass: Array, bias: Array, k: int) -> float:
    """Row k of M a + bias, for an acceleration of shape (p,) and M as a row of p * p numbers [N]."""
    p = acceleration.shape[0]
    force = bias[k]
    for column in range(p):
        force += mass[k * p + column] * acceleration[column]
    return float(force)
