"""PD-SMC: the paper's law without adaptation (the ablation)."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from pydantic import NonNegativeFloat

from escort_mj.laws.sliding import SlidingModeLaw, switching
from escort_mj.native.values import Values


class PdSmc(SlidingModeLaw):
    """A PD part and a switching term, without adaptation."""

    has_lyapunov: ClassVar[bool] = True
    title: ClassVar[str] = "PD-SMC"
    law: Literal["pd_smc"] = "pd_smc"
    proportional_gain: NonNegativeFloat = 30.0
    """Gain of the position error [N/m] (paper: k_p)."""
    derivative_gain: NonNegativeFloat = 50.0
    """Gain of the velocity error [N s/m] (paper: k_d)."""
    switching_gain: NonNegativeFloat = 1.0
    """Gain of the switching term [N] (paper: k)."""

    def force(self, r: Values) -> Any:
        """Return tau = k_p e + k_d e_dot + k sgn(s): eq. 9 with the estimate held at 0."""
        pd = self.proportional_gain * r.e + self.derivative_gain * r.e_dot
        return pd + self.switching_gain * switching(self, r.s)
