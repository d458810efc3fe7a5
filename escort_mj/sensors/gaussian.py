"""Normally distributed errors: white noise, and a bias that wanders."""

from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import NonNegativeFloat, PositiveFloat

from escort_mj.components.equations import Memory
from escort_mj.native.values import Values
from escort_mj.sensors.sensor import Sensor


class Gaussian(Sensor):
    """Normally distributed errors without bounds: white noise, and a bias that wanders.

    The bias is a Gauss-Markov process of first order (Gelb, Applied Optimal Estimation, 1974, section 3.6),
    exact from step to step, and 0 at the start.
    """

    measures: ClassVar[tuple[str, ...]] = ("position", "velocity", "target_position", "target_velocity")
    sensor: Literal["gaussian"] = "gaussian"
    noise: NonNegativeFloat = 0.01
    """Standard deviation of the error of each step, per axis [m or m/s]."""
    wander: NonNegativeFloat = 0.0
    """Standard deviation of the bias long after the start, per axis [m or m/s]."""
    correlation_time: PositiveFloat = 60.0
    """Time in which the correlation of the bias falls to 1/e [s]."""
    bias: ClassVar[Memory] = Memory("m or m/s", "error that wanders")

    def shows(self, r: Values) -> Any:
        """Return the measured value."""
        return r.truth + r.bias + self.noise * r.normal

    def bias_next(self, r: Values) -> Any:
        """Return the bias a step later."""
        kept = np.exp(-r.timestep / self.correlation_time)
        return kept * r.bias + self.wander * np.sqrt(1.0 - kept * kept) * r.second_normal

    def deviation(self, axes: int) -> float:
        """Return the standard deviation of noise per axis."""
        return self.noise

    def variance(self, axes: int) -> float:
        """Return the variance of noise and bias per axis [m^2 or m^2/s^2]."""
        return self.noise**2 + self.wander**2
