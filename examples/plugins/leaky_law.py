"""APD-SMC with a leaky estimate."""

from typing import Literal

import numpy as np
from pydantic import NonNegativeFloat

from escort_mj.plugins import Law, LawView


class Leaky(Law):
    """PD terms, a smooth switching term, and a leaky estimate."""

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

    def force(self, robots: LawView) -> None:
        """Write the force of every robot and the rate of its estimate."""
        pd = self.proportional_gain * robots.e + self.derivative_gain * robots.e_dot
        robots.tau[:] = robots.rho_hat + pd + self.switching_gain * np.tanh(robots.s)
        robots.rho_hat_rate[:] = self.adaptation_rate * robots.s - self.leak * robots.rho_hat

    def force_kernel(self, robots):
        """Compute the same as `force`, in compiled form."""
        n, p = robots.e.shape
        for i in range(n):
            for k in range(p):
                pd = self.proportional_gain * robots.e[i, k] + self.derivative_gain * robots.e_dot[i, k]
                switching = self.switching_gain * np.tanh(robots.s[i, k])
                robots.tau[i, k] = robots.rho_hat[i, k] + pd + switching
                leaked = self.leak * robots.rho_hat[i, k]
                robots.rho_hat_rate[i, k] = self.adaptation_rate * robots.s[i, k] - leaked
