"""PD control with a disturbance observer: a nonlinear disturbance observer on robots of a known mass."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import NonNegativeFloat, PositiveFloat

from escort_mj.components.equations import Memory
from escort_mj.laws.law import Law
from escort_mj.native.values import Values


class DisturbanceObserver(Law):
    """PD control, less the disturbance that an observer finds from the velocity and the motors' force.

    The observer is that of Chen, Ballance, Gawthrop and O'Reilly, "A nonlinear disturbance observer for
    robotic manipulators", IEEE Transactions on Industrial Electronics 47 (2000), 932-938, with p = L m v and
    the bandwidth L: z' = -L (z + p) - L tau. z + p follows the disturbance as a first-order filter does.
    """

    d_hat: ClassVar[Memory] = Memory("N", "estimate of the disturbance", "disturbance")
    z: ClassVar[Memory] = Memory("N", "state of the observer")
    title: ClassVar[str] = "PD + observer"
    law: Literal["disturbance_observer"] = "disturbance_observer"
    proportional_gain: NonNegativeFloat = 30.0
    """Gain of the position error [N/m]."""
    derivative_gain: NonNegativeFloat = 50.0
    """Gain of the velocity error [N s/m]."""
    mass: PositiveFloat = 1.0
    """Assumed mass of a robot [kg]."""
    bandwidth: PositiveFloat = 5.0
    """Rate at which the estimate follows the disturbance [1/s]."""

    def force(self, r: Values) -> Any:
        """Return tau = k_p e + k_d e_dot - d_hat."""
        return self.proportional_gain * r.e + self.derivative_gain * r.e_dot - r.d_hat

    def z_rate(self, r: Values) -> Any:
        """Return z' = -L (z + L m v + tau), with the force that motors can give."""
        tau = self.proportional_gain * r.e + self.derivative_gain * r.e_dot - r.d_hat
        tau = np.clip(tau, -r.force_limit, r.force_limit)
        return -self.bandwidth * (r.z + self.bandwidth * self.mass * r.v_measured + tau)

    def d_hat_rate(self, r: Values) -> Any:
        """Return what makes the estimate z + L m v at the next step."""
        return (r.z + self.bandwidth * self.mass * r.v_measured - r.d_hat) / r.timestep
