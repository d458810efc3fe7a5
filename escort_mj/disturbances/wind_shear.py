"""Wind that is faster the higher above the ground, with gusts."""

import math
from collections.abc import Iterator
from typing import ClassVar, Literal

import numpy as np
from pydantic import NonNegativeFloat, PositiveFloat

from escort_mj.components.equations import Memory
from escort_mj.components.facts import Facts, Misfit
from escort_mj.components.parameters import Speed
from escort_mj.disturbances.disturbance import Robots
from escort_mj.disturbances.wind import Wind, drag, toward
from escort_mj.native.vectors import Vec


class WindShear(Wind):
    """Drag in a wind whose mean speed grows with the height, which is the last axis, with gusts.

    The mean speed follows the logarithmic law or the power law (Burton et al., Wind Energy Handbook, 2011,
    section 2.6). Along each axis, gusts are white noise behind a first-order filter: their spectrum is
    Dryden's of longitudinal gusts (MIL-F-8785C, 1980, section 3.7).
    """

    draws: ClassVar[int] = 1
    gust: ClassVar[Memory] = Memory("m/s", "velocity of the gust")
    disturbance: Literal["wind_shear"] = "wind_shear"
    profile: Literal["logarithmic", "power"] = "logarithmic"
    """Law by which the mean speed grows with the height."""
    speed: Speed = 5.0
    """Mean speed of the wind at the height `reference` [m/s]."""
    heading: float = 0.0
    """Direction toward which the wind blows: angle from the x axis toward y [rad]."""
    ground: float = 0.0
    """Last coordinate of the ground, from which heights count [m]."""
    reference: PositiveFloat = 10.0
    """Height at which the mean speed is `speed` [m]."""
    roughness: PositiveFloat = 0.03
    """Height up to which a logarithmic wind is calm [m]; open fields 0.03."""
    exponent: NonNegativeFloat = 0.143
    """Exponent of the power law [1]."""
    gusts: Speed = 0.5
    """Standard deviation of the gusts, per axis [m/s]."""
    correlation_time: PositiveFloat = 2.0
    """Correlation time of the gusts [s]; Dryden: length scale divided by airspeed."""
    common: bool = True
    """Whether the same gusts meet all robots at once; otherwise, each robot has its own."""

    def force(self, r: Robots) -> Vec:
        """Return the drag."""
        height = r.q[-1] - self.ground
        if self.profile == 0:
            share = np.log(np.maximum(height / self.roughness, 1.0)) / math.log(
                self.reference / self.roughness
            )
        else:
            share = np.power(np.maximum(height / self.reference, 0.0), self.exponent)
        return drag(self, r, self.speed * share * toward(r.q, self.heading) + r.gust)

    def gust_rate(self, r: Robots) -> Vec:
        """Return what makes of each gust the next one, exactly: a share of it, and noise."""
        kept = math.exp(-r.timestep / self.correlation_time) if r.time > 0.0 else 0.0
        drawn = r.common_noise if self.common else r.noise
        return ((kept - 1.0) * r.gust + self.gusts * math.sqrt(1.0 - kept * kept) * drawn) / r.timestep

    def misfits(self, mission: Facts) -> Iterator[Misfit]:
        """Yield what makes the logarithm vanish."""
        if self.profile == "logarithmic" and self.roughness >= self.reference:
            words = f"found {self.roughness:g} m; expected less than reference, {self.reference:g} m"
            yield Misfit(words, "roughness")
