"""A compass whose bias drifts."""

from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import NonNegativeFloat

from escort_mj.components.equations import Memory
from escort_mj.native.values import Values
from escort_mj.sensors.sensor import Sensor


class Compass(Sensor):
    """A compass with noise, and a bias that drifts: a random walk."""

    measures: ClassVar[tuple[str, ...]] = ("heading",)
    sensor: Literal["compass"] = "compass"
    noise: NonNegativeFloat = 0.02
    """Standard deviation of the normally distributed error at every step [rad]."""
    drift: NonNegativeFloat = 0.005
    """Standard deviation of the bias after one second [rad/s^0.5]; it grows with the square root of time."""
    bias: ClassVar[Memory] = Memory("rad", "error that stays, and drifts")

    def shows(self, r: Values) -> Any:
        """Return the measured heading."""
        return r.truth + r.bias + self.noise * r.normal

    def bias_next(self, r: Values) -> Any:
        """Return the bias a step later."""
        return r.bias + self.drift * np.sqrt(r.timestep) * r.second_normal
