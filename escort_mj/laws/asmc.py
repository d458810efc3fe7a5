"""ASMC, adaptive sliding mode control: the baseline that the paper compares itself with (section 5)."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from pydantic import NonNegativeFloat

from escort_mj.laws.sliding import SlidingModeLaw, switching
from escort_mj.native.values import Values


class Asmc(SlidingModeLaw):
    """Adaptation and a strong switching term, without a PD part."""

    own_keys: ClassVar[frozenset[str]] = frozenset({"switching_gain"})  # k_a, far larger than k

    has_lyapunov: ClassVar[bool] = True
    title: ClassVar[str] = "ASMC"
    law: Literal["asmc"] = "asmc"
    switching_gain: NonNegativeFloat = 80.0
    """Gain of the switching term [N] (paper: k_a)."""
    adaptation_rate: NonNegativeFloat = 20.0
    """Gain of s in the rate of change of the estimate [N/m] (paper: mu)."""
    initial_estimate: float = 0.1
    """Initial estimate of the reference torque, on every axis [N] (paper: rho_hat_0)."""

    def force(self, r: Values) -> Any:
        """Return tau = rho_hat + k_a sgn(s): eq. 9 without its PD part."""
        return r.rho_hat + self.switching_gain * switching(self, r.s)

    def rho_hat_rate(self, r: Values) -> Any:
        """Return eq. 10, d rho_hat/dt = mu s."""
        return self.adaptation_rate * r.s
