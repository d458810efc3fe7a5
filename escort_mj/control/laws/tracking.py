"""What all laws share: the error that anti-windup and the record go by, and the numbers a kernel is given."""

from __future__ import annotations

from typing import ClassVar, NamedTuple

from pydantic import PositiveFloat

from escort_mj.control.parameters import Parameters
from escort_mj.kernels import inlined


class Gains(NamedTuple):
    """Gains of a law, as the kernel holds them; what a law has no use for is 0.

    Sliding modes: `tau = rho_hat + kp e + kd e_dot + k sw(s / boundary_layer)`, `d rho_hat/dt = mu s`. The
    other laws say in their own files what they make of these numbers.
    """

    kp: float
    kd: float
    k: float
    mu: float
    rho_hat_0: float


class TrackingLaw(Parameters):
    """Parameters of every law that makes robots follow the reference of the outer loop."""

    needs_model: ClassVar[bool] = False  # whether the law is told mass matrix and bias force
    has_lyapunov: ClassVar[bool] = False  # whether the proof's Lyapunov function V1 is this law's
    own_keys: ClassVar[frozenset[str]] = frozenset()  # keys that mean another thing than in other laws

    slope: PositiveFloat = 20.0
    """Slope of s = e_dot + slope * e [1/s] (paper: gamma), which anti-windup and avoidance's gain use too."""
    anti_windup: bool = True
    """While a motor is saturated outward: hold the estimate, and carry the reference with the robot."""

    def gains(self) -> Gains:
        """The law's gains, as the kernel holds them."""
        raise NotImplementedError


@inlined
def is_winding_up(tau: float, s: float, limit: float) -> bool:
    """Whether the motor is saturated and the sliding variable pushes it further outward."""
    return abs(tau) > limit and tau * s > 0.0
