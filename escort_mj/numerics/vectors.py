"""Lengths of single vectors, and the unit vectors along them, inside kernels."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from escort_mj.native.kernels import inlined

Array = NDArray[np.float64]


@inlined
def length_of(vector: Array) -> float:
    """Return the length of a vector."""
    square = 0.0
    for k in range(vector.shape[0]):
        square += vector[k] * vector[k]
    return math.sqrt(square)


@inlined
def make_unit(vector: Array) -> float:
    """Divide a vector by its length, which is returned; one of length 0 becomes the first axis."""
    length = length_of(vector)
    for k in range(vector.shape[0]):
        if length > 0.0:
            vector[k] /= length
        else:
            vector[k] = 1.0 if k == 0 else 0.0
    return length
