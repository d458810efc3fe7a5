"""ASMC, adaptive sliding mode control: the baseline that the paper compares itself with (section 5)."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import NonNegativeFloat

from escort_mj.control.laws.sliding import SlidingModeLaw
from escort_mj.control.laws.tracking import Gains


class Asmc(SlidingModeLaw):
    """Adaptation and a strong switching term, no PD part."""

    own_keys: ClassVar[frozenset[str]] = frozenset({"switching_gain"})  # k_a, far larger than k

    has_lyapunov: ClassVar[bool] = True
    law: Literal["asmc"] = "asmc"
    switching_gain: NonNegativeFloat = 80.0
    """Gain of the switching term [N] (paper: k_a)."""
    adaptation_rate: NonNegativeFloat = 20.0
    """Rate at which the estimate follows s [N/m] (paper: mu)."""
    initial_estimate: float = 0.1
    """Estimate of the reference torque at the start, every axis [N] (paper: rho_hat_0)."""

    def gains(self) -> Gains:
        """Eq. 9 without its PD part."""
        return Gains(0.0, 0.0, self.switching_gain, self.adaptation_rate, self.initial_estimate)
