"""Computed torque with the exact mass matrix: the unfair best, for no robot knows its own so well."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from pydantic import NonNegativeFloat

from escort_mj.laws.law import Law
from escort_mj.native.values import Values


class ComputedTorque(Law):
    """Inverse dynamics: tau = M (a_d + k_v e_dot + k_p e) + bias, with MuJoCo's M and bias force.

    Without noise or disturbance, the error satisfies e'' + k_v e' + k_p e = 0 for any mass. a_d is the
    backward difference of the outer loop's velocity over one physics step, after a first-order filter,
    because this velocity contains measurement noise.

    M is the block of the mass matrix for the robot's position: the robot's mass m times the identity. A
    rolling sphere also rotates, and the contact with the floor raises its effective mass to 7/5 m. The
    contact is not part of the mass matrix, so the law does not account for it.
    """

    needs_model: ClassVar[bool] = True
    differentiates: ClassVar[bool] = True

    title: ClassVar[str] = "computed torque"
    law: Literal["computed_torque"] = "computed_torque"
    position_gain: NonNegativeFloat = 100.0
    """Gain k_p of the position error [1/s^2]."""
    velocity_gain: NonNegativeFloat = 20.0
    """Gain k_v of the velocity error [1/s]; 2 sqrt(position_gain) gives critical damping."""
    acceleration_filter: NonNegativeFloat = 0.1
    """Time constant of the filter for the differentiated reference velocity [s]; 0: no filter."""

    def force(self, r: Values) -> Any:
        """Return the bias force."""
        return r.bias

    def acceleration(self, r: Values) -> Any:
        """Return a_d + k_v e_dot + k_p e, which the mass matrix is multiplied by."""
        return r.v_d_rate + self.velocity_gain * r.e_dot + self.position_gain * r.e
