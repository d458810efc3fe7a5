"""What the sliding-mode laws share: the smoothing of their switching term."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import PositiveFloat

from escort_mj.control.elementary import tanh
from escort_mj.control.laws.tracking import TrackingLaw
from escort_mj.kernels import inlined
from escort_mj.lanes import WIDTH, Lanes, greatest, least, load, store, where

Array = NDArray[np.float64]

SMOOTHINGS = ("tanh", "saturation", "sign")


class SlidingModeLaw(TrackingLaw):
    """Parameters of every sliding-mode law: what stands for the sign of s."""

    smoothing: Literal["tanh", "saturation", "sign"] = "tanh"
    """What stands for sgn(s): a tanh (remark 4), a clipped line, or the discontinuous sign itself."""
    boundary_layer: PositiveFloat = 1.0
    """Width of the smoothed zone of s [m/s]."""


@inlined
def smooth_sign(x: Lanes, smoothing: int) -> Lanes:
    """What stands for sgn(x): a tanh (0), a clipped line (1), or the sign itself (2)."""
    if smoothing == 0:
        return tanh(x)
    if smoothing == 1:
        return least(1.0, greatest(-1.0, x))
    return where(x > 0.0, 1.0, where(x < 0.0, -1.0, x))


@inlined
def smooth_signs(x: Array, smoothing: int) -> None:
    """Replaces every x by what stands for its sign."""
    for at in range(0, x.shape[0], WIDTH):
        store(x, at, smooth_sign(load(x, at), smoothing))
