"""PD-SMC: the paper's law without adaptation (the ablation)."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import NonNegativeFloat

from escort_mj.control.laws.sliding import SlidingModeLaw
from escort_mj.control.laws.tracking import Gains


class PdSmc(SlidingModeLaw):
    """PD and a switching term; nothing estimates the reference torque."""

    has_lyapunov: ClassVar[bool] = True
    law: Literal["pd_smc"] = "pd_smc"
    proportional_gain: NonNegativeFloat = 30.0
    """Gain of the position error [N/m] (paper: k_p)."""
    derivative_gain: NonNegativeFloat = 50.0
    """Gain of the velocity error [N s/m] (paper: k_d)."""
    switching_gain: NonNegativeFloat = 1.0
    """Gain of the switching term [N] (paper: k)."""

    def gains(self) -> Gains:
        """Eq. 9 with the estimate held at zero."""
        return Gains(self.proportional_gain, self.derivative_gain, self.switching_gain, 0.0, 0.0)
