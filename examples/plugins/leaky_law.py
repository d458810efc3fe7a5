"""PD control with a leaky estimate."""

from typing import Any, ClassVar, Literal

from pydantic import NonNegativeFloat

from escort_mj.plugins import Law, Values


class Leaky(Law):
    """PD terms and a leaky estimate."""

    compiled: ClassVar[bool] = True
    law: Literal["leaky"] = "leaky"
    proportional_gain: NonNegativeFloat = 30.0
    """Gain of the position error [N/m]."""
    derivative_gain: NonNegativeFloat = 50.0
    """Gain of the velocity error [N s/m]."""
    adaptation_rate: NonNegativeFloat = 20.0
    """Rate at which the estimate follows s [N/m]."""
    leak: NonNegativeFloat = 0.5
    """Rate at which the estimate decays [1/s]."""

    def force(self, r: Values) -> Any:
        return r.rho_hat + self.proportional_gain * r.e + self.derivative_gain * r.e_dot

    def rho_hat_rate(self, r: Values) -> Any:
        return self.adaptation_rate * r.s - self.leak * r.rho_hat
