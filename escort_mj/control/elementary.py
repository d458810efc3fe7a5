"""A hyperbolic tangent without branches or calls: exact to rounding, and several times faster than libm's."""

from __future__ import annotations

from escort_mj.kernels import inlined
from escort_mj.lanes import Lanes, copysign, least, two_to

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
