"""Functions of eight numbers at once, exact to rounding, and several times faster than libm's."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from escort_mj.native.kernels import DOUBLE, inlined, stack_memory, vector_at
from escort_mj.native.lanes import WIDTH, Lanes, any_of, copysign, least, load, root, store, two_to, where

_LOG2_E = 1.4426950408889634
_LN2_HIGH = 6.93147180369123816490e-01  # trailing bits zero, so that n * high is exact
_LN2_LOW = 1.90821492927058770002e-10
_SATURATED = 20.0  # tanh(20) rounds to 1
_ROUND = 1.5 * 2.0**52  # adding it rounds to a whole number


@inlined
def tanh(x: Lanes) -> Lanes:
    """Tanh x = -q / (q + 2) with q = exp(-2|x|) - 1, by its series after taking out powers of two."""
    y = -2.0 * least(_SATURATED, abs(x))  # in this order a NaN stays one
    shifted = y * _LOG2_E + _ROUND
    n = shifted - _ROUND
    r = (y - n * _LN2_HIGH) - n * _LN2_LOW
    series = r * (1.0 / 6227020800.0) + 1.0 / 479001600.0
    series = series * r + 1.0 / 39916800.0
    series = series * r + 1.0 / 3628800.0
    series = series * r + 1.0 / 362880.0
    series = series * r + 1.0 / 40320.0
    series = series * r + 1.0 / 5040.0
    series = series * r + 1.0 / 720.0
    series = series * r + 1.0 / 120.0
    series = series * r + 1.0 / 24.0
    series = series * r + 1.0 / 6.0
    series = series * r + 0.5
    series = (series * r + 1.0) * r
    power = two_to(shifted)
    q = power * series + (power - 1.0)
    return copysign(q / (q + 2.0), x)


@inlined
def whole(x: Lanes) -> Lanes:
    """Nearest whole number, for |x| < 2^51."""
    return (x + _ROUND) - _ROUND


@inlined
def arc_cosine(x: Lanes) -> Lanes:
    """Arc cosine of 0 to 1 [rad]: pi/2 - asin x, or 2 asin of sqrt((1 - x) / 2); asin by a rational fit."""
    far = x > 0.5
    z = where(far, 0.5 * (1.0 - x), x * x)
    above = z * 3.47933107596021167570e-05 + 7.91534994289814532176e-04
    above = above * z - 4.00555345006794114027e-02
    above = above * z + 2.01212532134862925881e-01
    above = above * z - 3.25565818622400915405e-01
    above = above * z + 1.66666666666666657415e-01
    below = z * 7.70381505559019352791e-02 - 6.88283971605453293030e-01
    below = below * z + 2.02094576023350569471e00
    below = below * z - 2.40339491173441421878e00
    below = below * z + 1.0
    y = where(far, root(z), x)
    y = y + y * (z * above / below)
    return where(far, 2.0 * y, 0.5 * math.pi - y)


# pi / 2 in three parts, of which n times the first two are exact up to n = 2^20
_TWO_OVER_PI = 0.6366197723675814
_HALF_PI_1 = 1.57079632673412561417e00
_HALF_PI_2 = 6.07710050630396597660e-11
_HALF_PI_3 = 2.02226624879595063154e-21
_FAR = 1.5e6  # from here on their sum is not exact enough


@inlined
def sine_and_cosine(x: Lanes) -> tuple[Lanes, Lanes]:
    """Sin x and cos x [rad], by their series after taking out quarters of a turn."""
    if any_of(abs(x) > _FAR):
        return _by_calls(x)
    n = (x * _TWO_OVER_PI + _ROUND) - _ROUND
    r = ((x - n * _HALF_PI_1) - n * _HALF_PI_2) - n * _HALF_PI_3
    z = r * r
    series = z * (-1.0 / 1307674368000.0) + 1.0 / 6227020800.0
    series = series * z - 1.0 / 39916800.0
    series = series * z + 1.0 / 362880.0
    series = series * z - 1.0 / 5040.0
    series = series * z + 1.0 / 120.0
    series = series * z - 1.0 / 6.0
    sine = r + r * (z * series)
    series = z * (1.0 / 20922789888000.0) - 1.0 / 87178291200.0
    series = series * z + 1.0 / 479001600.0
    series = series * z - 1.0 / 3628800.0
    series = series * z + 1.0 / 40320.0
    series = series * z - 1.0 / 720.0
    series = series * z + 1.0 / 24.0
    cosine = 1.0 + z * (series * z - 0.5)
    quarter = n - 4.0 * ((n * 0.25 + _ROUND) - _ROUND)  # -2 to 2
    odd = abs(abs(quarter) - 1.0) < 0.5
    sine, cosine = where(odd, cosine, sine), where(odd, sine, cosine)
    sine = where(quarter < -0.5, -sine, where(quarter > 1.5, -sine, sine))
    cosine = where(quarter > 0.5, -cosine, where(quarter < -1.5, -cosine, cosine))
    return sine, cosine


def _each(function: Callable[[float], float]) -> Callable[[Lanes], Lanes]:
    """Return a function of lanes that takes a function of libm, one by one."""

    def evaluate(x: Lanes) -> Lanes:
        numbers = vector_at(stack_memory(), WIDTH)
        store(numbers, 0, x)
        for lane in range(WIDTH):
            numbers[lane] = function(numbers[lane])
        return load(numbers, 0)

    return inlined(evaluate)


logarithm = _each(np.log)
"""Natural logarithm."""
exponential = _each(np.exp)
"""Power of e."""


def _lane_by_lane(function: Callable[[float, float], float]) -> Callable[[Lanes, Lanes], Lanes]:
    """Return a function of lanes that takes a function of two numbers of libm, one by one."""

    def evaluate(x: Lanes, y: Lanes) -> Lanes:
        memory = stack_memory()
        first, second = vector_at(memory, WIDTH), vector_at(memory + DOUBLE * WIDTH, WIDTH)
        store(first, 0, x)
        store(second, 0, y)
        for lane in range(WIDTH):
            first[lane] = function(first[lane], second[lane])
        return load(first, 0)

    return inlined(evaluate)


arc_tangent = _lane_by_lane(math.atan2)
"""Angle of (x, y) from the first axis, of y and x, -pi to pi [rad]."""
power = _lane_by_lane(np.power)
"""One to the power of the other."""


@inlined
def _by_calls(x: Lanes) -> tuple[Lanes, Lanes]:
    """The same with libm, one by one."""
    memory = stack_memory()
    sines, cosines = vector_at(memory, WIDTH), vector_at(memory + DOUBLE * WIDTH, WIDTH)
    store(sines, 0, x)
    for lane in range(WIDTH):
        sines[lane], cosines[lane] = math.sin(sines[lane]), math.cos(sines[lane])
    return load(sines, 0), load(cosines, 0)
