"""Nearest velocities within half-spaces, by non-negative least squares."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from escort_mj.control.outer_loops.nearest_velocity import (
    INFEASIBLE,
    LEAST_WEIGHT,
    STIFFNESS,
    _blend_within,
)
from escort_mj.metrics.causes import least_change
from escort_mj.native.vectors import Vec
from tests.oracle.constraints import turned

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def nearest(rows: Array, bounds: Array, nominal: Array) -> tuple[Array, bool]:
    """Return the velocity nearest to a nominal one that satisfies the constraints, and whether it moved."""
    missing = bounds - rows @ nominal
    if not (missing > 0.0).any():
        return nominal, False
    return nominal + least_change(rows, missing, STIFFNESS), True


def kept_limit(rows: Array, bounds: Array, most: float, v: Array) -> Array | None:
    """Return a velocity that satisfies constraints within a limit, see `keep_limit`; None if none is."""
    if not np.linalg.norm(v) > most:
        return v
    slowest = nearest(rows, bounds, np.zeros_like(v))[0]
    least = float(np.linalg.norm(slowest))
    if least > most:
        return None
    share = _blend_within(least, most, Vec(tuple(slowest)), Vec(tuple(v)))
    return np.asarray(slowest + share * (v - slowest))


def contradicting(rows: Array, bounds: Array, nominal: Array, v: Array) -> bool:
    """Return whether no velocity satisfies all constraints, see `contradict`."""
    return bool((bounds - rows @ v).max(initial=0.0) > INFEASIBLE * np.linalg.norm(v - nominal))


def broken_least(rows: Array, bounds: Array, gaps: Array, near: float, most: float, nominal: Array) -> Array:
    """Return the velocity within a speed limit that breaks constraints least, see `break_least`."""
    from scipy.optimize import brentq

    weights = LEAST_WEIGHT * np.clip(near / np.maximum(gaps, 1e-300), 1.0, 1.0 / LEAST_WEIGHT)
    rows, bounds = weights[:, None] * rows, weights * bounds
    v = kept_limit(rows, bounds, most, nearest(rows, bounds, nominal)[0])
    if v is not None:
        return v

    def excess(soft: float) -> float:
        return float(np.linalg.norm(least_change(rows, bounds, 1.0 / soft))) - most

    high = float((np.maximum(bounds, 0.0) ** 2).sum()) / most**2
    slowest = least_change(rows, bounds, 1.0 / brentq(excess, 1.0 / STIFFNESS, high, xtol=1e-14))
    return np.asarray(slowest * (most / np.linalg.norm(slowest)))


def aside(share: float, rows: Array, bounds: Array, wanted: Array) -> Array:
    """Return what is wanted, with the sidestep where it runs straight into a constraint, shape (p,) [m/s]."""
    missing = bounds - rows @ wanted
    if not (missing > 0.0).any():
        return wanted
    worst = int(np.argmax(missing))
    along = float(rows[worst] @ wanted)
    add = share * float(missing[worst]) - math.sqrt(max(float(wanted @ wanted) - along * along, 0.0))
    return wanted + max(add, 0.0) * turned(rows[worst])
