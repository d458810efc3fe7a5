"""APD-SMC with a leaky estimate."""

from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import NonNegativeFloat

from escort_mj.plugins import Law, Values


class Leaky(Law):
    """PD terms, a smooth switching term, and a leaky estimate."""

    compiled: ClassVar[bool] = True
    law: Literal["leaky"] = "leaky"
    proportional_gain: NonNegativeFloat = 30.0
    """Gain of the position error [N/m]."""
    derivative_gain: NonNegativeFloat = 50.0
    """Gain of the velocity error [N s/m]."""
    switching_gain: NonNegativeFloat = 1.0
    """Gain of the switching term [N]."""
    adaptation_rate: NonNegativeFloat = 20.0
    """Rate at which the estimate follows s [N/m]."""
    leak: NonNegativeFloat = 0.5
    """Rate at which the estimate decays [1/s]."""

    def force(self, r: Values) -> Any:
        """Return the force."""
        pd = self.proportional_gain * r.e + self.derivative_gain * r.e_dot
        return r.rho_hat + pd + self.switching_gain * np.tanh(r.s)

    def rho_hat_rate(self, r: Values) -> Any:
        """Return the rate of the estimate."""
        return self.adaptation_rate * r.s - self.leak * r.rho_hat
