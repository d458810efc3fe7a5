"""The inner loop's laws."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def switching(s: Array, smoothing: str, width: float) -> Array:
    """What stands for sgn(s) in eq. 9: tanh (eq. 17), a clipped line, or the sign itself; shape of s."""
    if smoothing == "sign":
        return np.sign(s)
    return np.tanh(s / width) if smoothing == "tanh" else np.clip(s / width, -1.0, 1.0)
