"""What the sliding-mode laws share: the smoothing of their switching term."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import PositiveFloat

from escort_mj.control.elementary import tanh
from escort_mj.control.laws.tracking import TrackingLaw
from escort_mj.kernels import inlined

Array = NDArray[np.float64]

SMOOTHINGS = ("tanh", "saturation", "sign")


class SlidingModeLaw(TrackingLaw):
    """Parameters of every sliding-mode law: what stands for the sign of s."""

    smoothing: Literal["tanh", "saturation", "sign"] = "tanh"
    """What stands for sgn(s): a tanh (remark 4), a clipped line, or the discontinuous sign itself."""
    boundary_layer: PositiveFloat = 1.0
    """Width of the smoothed zone of s [m/s]."""


@inlined
def smooth_signs(x: Array, smoothing: int) -> None:
    """Replaces every x by what stands for sgn(x): a tanh (0), a clipped line (1), or the sign itself (2)."""
    if smoothing == 0:
        for j in range(x.shape[0]):
            x[j] = tanh(x[j])
    elif smoothing == 1:
        for j in range(x.shape[0]):
            x[j] = min(max(x[j], -1.0), 1.0)
    else:
        for j in range(x.shape[0]):
            x[j] = float(np.sign(x[j]))
