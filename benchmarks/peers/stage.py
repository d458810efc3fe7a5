"""The mission that every simulator flies: n robots keep their places around a target that circles.

Read by our own loop and, as a plain module beside them, by the adapters, which run in other environments: it
needs NumPy only.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SPEED, SWEEP = 0.5, 4.0  # of the target [m/s], and radius of its circle [m]
RADIUS, OBSTACLE_RADIUS = 0.2, 0.5  # of robots and of obstacles [m]
FLOOR_GAP = 3.0  # below the lowest place [m]


def radius(n: int, axes: int) -> float:
    """Radius of the formation [m]: neighbors are about two meters apart."""
    return max(3.0, 2.0 * n / (2.0 * np.pi) if axes == 2 else 2.2 * np.sqrt(n / (4.0 * np.pi)))


def height(n: int, axes: int) -> float:
    """Height of the target above the floor [m]: no place is near it."""
    return 0.0 if axes == 2 else radius(n, axes) + FLOOR_GAP


def places(n: int, axes: int) -> Array:
    """Places about the target: even on a circle, a Fibonacci lattice on a sphere, shape (n, axes) [m]."""
    i = np.arange(n)
    if axes == 2:
        angle = 2.0 * np.pi * i / n
        return radius(n, axes) * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    z = 1.0 - (2.0 * i + 1.0) / n
    angle = i * np.pi * (3.0 - np.sqrt(5.0))
    rim = np.sqrt(1.0 - z * z)
    return radius(n, axes) * np.stack([rim * np.cos(angle), rim * np.sin(angle), z], axis=1)


def target(t: float, n: int, axes: int) -> tuple[Array, Array]:
    """Position [m] and velocity [m/s] of the target at a time [s], shapes (axes,)."""
    phase = SPEED / SWEEP * t
    position = np.array([SWEEP * np.cos(phase), SWEEP * np.sin(phase), height(n, axes)])
    velocity = np.array([-SPEED * np.sin(phase), SPEED * np.cos(phase), 0.0])
    return position[:axes], velocity[:axes]


def obstacles(n: int, axes: int) -> Array:
    """Centers of four balls around the swept area, near enough to be avoided, shape (4, axes) [m]."""
    reach = (SWEEP + radius(n, axes) + 1.0) / np.sqrt(2.0)
    flat = reach * np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
    return np.column_stack([flat, np.full(4, height(n, axes))])[:, :axes]
