"""PD-SMC: the paper's law without adaptation (the ablation)."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Literal

from pydantic import NonNegativeFloat

from escort_mj.laws.sliding import SlidingModeLaw, switching
from escort_mj.native.lanes import Lanes, everywhere, load

if TYPE_CHECKING:
    from escort_mj.memory.layout import Plan, State


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

    def force_lanes(self, at: int, plan: Plan, state: State) -> tuple[Lanes, Lanes]:
        """Return tau = k_p e + k_d e_dot + k sgn(s): eq. 9 with the estimate held at 0."""
        pd = self.proportional_gain * load(state.e, at) + self.derivative_gain * load(state.e_dot, at)
        return pd + self.switching_gain * switching(self, load(state.s, at)), everywhere(0.0)
