"""APD-SMC, adaptive proportional-derivative sliding mode control (paper eqs. 9, 10, 17)."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import NonNegativeFloat

from escort_mj.control.laws.sliding import SlidingModeLaw
from escort_mj.control.laws.tracking import Gains


class ApdSmc(SlidingModeLaw):
    """The paper's law: PD for the nominal part, a sliding term for disturbances, adaptation for the rest."""

    has_lyapunov: ClassVar[bool] = True
    law: Literal["apd_smc"] = "apd_smc"
    proportional_gain: NonNegativeFloat = 30.0
    """Gain of the position error [N/m] (paper: k_p)."""
    derivative_gain: NonNegativeFloat = 50.0
    """Gain of the velocity error [N s/m] (paper: k_d)."""
    switching_gain: NonNegativeFloat = 1.0
    """Gain of the switching term [N] (paper: k)."""
    adaptation_rate: NonNegativeFloat = 20.0
    """Rate at which the estimate follows s [N/m] (paper: mu)."""
    initial_estimate: float = 0.1
    """Estimate of the reference torque at the start, every axis [N] (paper: rho_hat_0)."""

    def gains(self) -> Gains:
        """Eq. 9 as it stands."""
        return Gains(
            self.proportional_gain,
            self.derivative_gain,
            self.switching_gain,
            self.adaptation_rate,
            self.initial_estimate,
        )
