"""A Kalman filter of the target on each robot, extended for ranges and bearings."""

import math
from typing import Literal

from pydantic import PositiveFloat

from escort_mj.components.component import Derived
from escort_mj.estimators.belief import Belief, Witness
from escort_mj.estimators.estimator import Estimator
from escort_mj.knowledge.belief import LEAST_VARIANCE
from escort_mj.native.vectors import dot


class Kalman(Estimator):
    """A Kalman filter of the target on each robot (Bar-Shalom, Li, Kirubarajan 2001, sections 5.2, 10.3).

    The model is a target of constant velocity or acceleration, disturbed by white noise; measurements of
    range and bearing are linearized. A robot adopts a teammate's belief that is more certain than its own.
    The adopted belief, unlike a mixture of the two, is consistent however they are correlated.
    """

    estimator: Literal["kalman"] = "kalman"
    model: Literal["velocity", "acceleration"] = "velocity"
    """Motion model of the target: constant `velocity` or constant `acceleration`, except for noise."""
    noise: PositiveFloat = 0.5
    """Square root of the spectral density of the model's noise, in the acceleration [m/s^1.5] or, for the
    model `acceleration`, in the jerk [m/s^2.5]."""

    @property
    def orders(self) -> int:
        """How many derivatives of the position a belief has, the position among them."""
        return 3 if self.model == "acceleration" else 2

    @Derived
    def density(self) -> float:
        """Return the spectral density of the noise that changes the last of them."""
        return self.noise**2

    def sees(self, r: Witness) -> Belief:
        """Return the belief of now, corrected by one measured quantity after the other, linearized once."""
        b = r.belief.at(r.time, self.density)
        here, way = b.position, b.position - r.q
        far = math.sqrt(max(dot(way, way), LEAST_VARIANCE))
        unit = way / far
        if r.position_variance >= 0.0:
            b = b.with_position(r.seen_position, r.position_variance)
        if r.range_variance >= 0.0:
            b = b.with_range(unit, r.seen_range - far, r.range_variance, here)
        if r.bearing_variance >= 0.0:
            off = r.seen_bearing - dot(r.seen_bearing, unit) * unit
            b = b.with_bearing(unit, far, off, r.bearing_variance + r.way_variance / (far * far), here)
        if r.velocity_variance >= 0.0:
            b = b.with_velocity(r.seen_velocity, r.velocity_variance)
        return b.with_fix(r.time)

    def hears(self, r: Witness) -> Belief:
        """Return the surer one of two beliefs of now."""
        own, other = r.belief.at(r.time, self.density), r.heard.at(r.time, self.density)
        surer = other if other.spread < own.spread else own
        return surer.with_fix(max(own.fix, other.fix))
