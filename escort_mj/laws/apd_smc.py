"""APD-SMC, adaptive proportional-derivative sliding mode control (paper eqs. 9, 10, 17)."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from pydantic import NonNegativeFloat

from escort_mj.laws.sliding import SlidingModeLaw, switching
from escort_mj.native.values import Values


class ApdSmc(SlidingModeLaw):
    """The paper's law: a PD part, a switching term for disturbances, and adaptation for the unknown model."""

    has_lyapunov: ClassVar[bool] = True
    title: ClassVar[str] = "APD-SMC"
    law: Literal["apd_smc"] = "apd_smc"
    proportional_gain: NonNegativeFloat = 30.0
    """Gain of the position error [N/m] (paper: k_p)."""
    derivative_gain: NonNegativeFloat = 50.0
    """Gain of the velocity error [N s/m] (paper: k_d)."""
    switching_gain: NonNegativeFloat = 1.0
    """Gain of the switching term [N] (paper: k)."""
    adaptation_rate: NonNegativeFloat = 20.0
    """Gain of s in the rate of rho_hat [N/m] (paper: mu)."""
    initial_estimate: float = 0.1
    """Initial estimate of the force of the unknown model, on every axis [N] (paper: rho_hat_0)."""

    def force(self, r: Values) -> Any:
        """Return eq. 9 on each axis, tau = rho_hat + k_p e + k_d e_dot + k sw(s / delta), sw of eq. 17.

        With e = q_d - q, e_dot = v_d - v, s = e_dot + gamma e, and the width delta of the boundary layer.
        """
        smooth = r.rho_hat + self.proportional_gain * r.e + self.derivative_gain * r.e_dot
        return smooth + self.switching_gain * switching(self, r.s)

    def rho_hat_rate(self, r: Values) -> Any:
        """Return eq. 10, d rho_hat/dt = mu s."""
        return self.adaptation_rate * r.s
