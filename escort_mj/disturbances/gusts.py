"""A steady wind with the turbulence of Dryden's model."""

import math
from typing import Any, ClassVar, Literal

import numpy as np

from escort_mj.components.equations import Memory
from escort_mj.components.parameters import Speed
from escort_mj.disturbances.disturbance import Robots
from escort_mj.disturbances.wind import Wind, drag, toward
from escort_mj.native.kernels import inlined
from escort_mj.native.vectors import Vec, norm, quarter_turn, unit_axis, where

FOOT = 0.3048  # m
LOWEST, HIGHEST = 10.0, 1000.0  # ft, between which the model holds
TERMS = 18  # of a series, to the last digit up to 1
LONG_WAY = 1e9  # m, after which nothing is left of how turbulence began


class Gusts(Wind):
    """Drag in a steady wind with turbulence: Dryden's, at low altitude (MIL-F-8785C, 1980, section 3.7).

    Robots meet turbulence that is frozen in the wind, at their airspeed. Along the wind, it is white noise
    behind a filter of first order; across the wind and upright (the last axis, in space), behind one of
    second order. Filters are discretized exactly. Length scales and intensities follow from the height,
    which is taken to be 10 ft at least and 1000 ft at most, and from the wind's speed.
    """

    draws: ClassVar[int] = 2
    quick: ClassVar[Memory] = Memory("1", "noise behind a filter of first order")
    slow: ClassVar[Memory] = Memory("1", "the same behind a second such filter")
    disturbance: Literal["gusts"] = "gusts"
    speed: Speed = 7.0
    """Speed of the steady wind; turbulence is that of such a wind at a height of 20 ft [m/s]."""
    heading: float = 0.0
    """Direction toward which the wind blows: angle from the x axis toward y [rad]."""
    ground: float = 0.0
    """Last coordinate of the ground, from which heights count; in the plane, less the height of all robots
    [m]."""
    common: bool = True
    """Whether the same noise makes the turbulence of all robots; otherwise, each robot has its own."""

    def force(self, r: Robots) -> Vec:
        """Return the drag."""
        _, _, along, upright = turbulence(self, r)
        across = (math.sqrt(3.0) * r.quick + (1.0 - math.sqrt(3.0)) * r.slow) / math.sqrt(2.0)
        gust = scaled(across + (r.quick[0] - across[0]) * unit_axis(r.q, 0), along, upright)
        aside = quarter_turn(gust)
        turned = gust + math.sin(self.heading) * aside + (1.0 - math.cos(self.heading)) * quarter_turn(aside)
        return drag(self, r, self.speed * toward(r.q, self.heading) + turned)

    def quick_rate(self, r: Robots) -> Vec:
        """Return what makes the next value: a share of this one, and noise."""
        along, upright, _, _ = turbulence(self, r)
        noise = r.common_noise if self.common else r.noise
        kept = scaled(r.quick, np.exp(-along), np.exp(-upright))
        return (kept + scaled(noise, shares(along)[0], shares(upright)[0]) - r.quick) / r.timestep

    def slow_rate(self, r: Robots) -> Vec:
        """Return what makes the next value: a share of both, the same noise, and other noise."""
        along, upright, _, _ = turbulence(self, r)
        noise = r.common_noise if self.common else r.noise
        second = r.second_common_noise if self.common else r.second_noise
        kept = scaled(r.slow + scaled(r.quick, along, upright), np.exp(-along), np.exp(-upright))
        _, shared, own = shares(along)
        _, shared_above, own_above = shares(upright)
        drawn = scaled(noise, shared, shared_above) + scaled(second, own, own_above)
        return (kept + drawn - r.slow) / r.timestep


@inlined
def turbulence(self: Any, r: Robots) -> tuple[Any, Any, Any, Any]:
    """Return the ways through the air in a step, in length scales, and intensities [m/s].

    Returns:
        Way for the axes along the ground, way for the upright axis; intensities likewise.
    """
    space = len(r.q) > 2
    height = r.q[-1] if space else 0.0 * r.q[-1]
    feet = np.clip((height - self.ground) / FOOT, LOWEST, HIGHEST)
    spread = np.power(0.177 + 0.000823 * feet, 0.4)
    airspeed = norm(self.speed * toward(r.q, self.heading) - r.v)
    way = airspeed * r.timestep if r.time > 0.0 else airspeed + LONG_WAY
    upright, intensity = way / (FOOT * feet), 0.1 * self.speed + 0.0 * way
    along, strong = upright * spread * spread * spread, intensity / spread
    return along, upright if space else along, strong, intensity if space else strong


@inlined
def shares(way: Any) -> tuple[Any, Any, Any]:
    """Return how much of the noise is in the quick value after a way, and of it and other noise in the slow.

    Their covariances are 1 - k, (1 - k (1 + x)) / 2 and (1 - k (1 + x + x^2 / 2)) / 2 with x = 2 way and
    k = exp(-x); for small x, the series of the last one keeps all digits.
    """
    x = 2.0 * way
    kept, near = np.exp(-x), np.minimum(x, 1.0)
    series = 0.0 * x
    for k in range(TERMS, 3, -1):
        series = (1.0 + series) * near / float(k)
    third = where(x < 1.0, kept * x * x * x / 6.0 * (1.0 + series), 1.0 - kept * (1.0 + x + 0.5 * x * x))
    second = third + kept * x * x / 2.0
    quick = np.sqrt(second + kept * x)
    shared = 0.5 * second / np.maximum(quick, 1e-300)
    return quick, shared, np.sqrt(np.maximum(0.5 * third - shared * shared, 0.0))


@inlined
def scaled(x: Vec, along: Any, upright: Any) -> Vec:
    """Return a vector times one number along the ground, and times another one on the last axis."""
    return along * x + (upright - along) * x[-1] * unit_axis(x, -1)
