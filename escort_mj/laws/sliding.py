"""What the sliding-mode laws share: the smoothing of their switching term, and the gains in V1."""

from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import PositiveFloat

from escort_mj.laws.law import Law
from escort_mj.native.kernels import inlined
from escort_mj.native.lanes import WIDTH, Lanes, greatest, least, load, store, where
from escort_mj.numerics.elementary import tanh

Array = NDArray[np.float64]

SMOOTHINGS = ("tanh", "saturation", "sign")
TANH, SATURATION = 0, 1  # their places, as kernels read them


class Gains(NamedTuple):
    """Gains of eqs. 9 and 10, as they appear in the Lyapunov function V1 (eq. 11).

    tau = rho_hat + k_p e + k_d e_dot + k sw(s / delta), d rho_hat/dt = mu s, with sw the smoothed sign.

    Attributes:
        proportional_gain: k_p, of the position error e [N/m].
        derivative_gain: k_d, of the velocity error e_dot [N s/m].
        switching_gain: k, of the smoothed sign of the sliding variable s [N].
        adaptation_rate: mu, of s in the rate of the estimate rho_hat [N/m].
    """

    proportional_gain: float
    derivative_gain: float
    switching_gain: float
    adaptation_rate: float


class SlidingModeLaw(Law):
    """Parameters of every sliding-mode law: the smoothed sign of s."""

    smoothing: Literal["tanh", "saturation", "sign"] = "tanh"
    """Approximation of the sign in the switching term: `tanh` (remark 4), `saturation` (linear
    within the layer), or the discontinuous `sign`."""
    boundary_layer: PositiveFloat = 1.0
    """Scale of s in the smoothed sign [m/s] (delta): half the width of the linear zone of `saturation`;
    without effect on `sign`."""

    def gains(self) -> Gains:
        """Return the gains that appear in V1; 0 for gains that the law does not have."""
        return Gains(*(float(getattr(self, name, 0.0)) for name in Gains._fields))


@inlined
def switching(law: Any, s: Lanes) -> Lanes:
    """Return the smoothed sgn(s / delta) of eq. 9: tanh (eq. 17), a saturated line, or the sign itself.

    Args:
        law: Parameters of a sliding-mode law.
        s: Sliding variable [m/s].
    """
    return smooth_sign(s / law.boundary_layer, law.smoothing)


@inlined
def smooth_sign(x: Lanes, smoothing: int) -> Lanes:
    """Return the smoothed sgn(x), by the place of the smoothing in `SMOOTHINGS`."""
    if smoothing == TANH:
        return tanh(x)
    if smoothing == SATURATION:
        return least(1.0, greatest(-1.0, x))
    return where(x > 0.0, 1.0, where(x < 0.0, -1.0, x))


@inlined
def smooth_signs(x: Array, smoothing: int) -> None:
    """Replace every x by its smoothed sign."""
    for at in range(0, x.shape[0], WIDTH):
        store(x, at, smooth_sign(load(x, at), smoothing))
