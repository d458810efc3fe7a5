"""Forces of water on a hull, with the matrices of Fossen (2021)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from escort_mj.robots.hydrodynamics import SURGE, SWAY, YAW, Vessel

Array = NDArray[np.float64]


def to_world(heading: float) -> Array:
    """Rotation of surge, sway and yaw into the world, shape (3, 3)."""
    c, s = math.cos(heading), math.sin(heading)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def immersed(heading: float, velocity: Array, vessel: Vessel) -> tuple[Array, Array, Array]:
    """Return mass matrix, Coriolis force of the added mass and damping force; arguments as of `immerse`.

    In the world's axes q'' = R (nu' + S nu) with R' = R S: the added mass's force is R (C_A nu - M_A S nu).
    """
    world = to_world(heading)
    u, v, r = nu = world.T @ velocity
    mass = np.array(
        [
            [vessel.surge_mass, 0.0, 0.0],
            [0.0, vessel.sway_mass, vessel.coupling],
            [0.0, vessel.coupling, vessel.inertia],
        ]
    )
    added = np.array(
        [
            [vessel.added_surge, 0.0, 0.0],
            [0.0, vessel.added_sway, vessel.added_coupling],
            [0.0, vessel.added_coupling, 0.0],  # whatever it is in yaw
        ]
    )
    force = coriolis_matrix(added, nu) @ nu - added @ [-r * v, r * u, 0.0]
    back = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, -vessel.ahead], [0.0, 0.0, 1.0]])
    at_midship = back @ nu
    drag = back.T @ (-damping_matrix(at_midship, vessel) @ at_midship)
    return world @ mass @ world.T, world @ force, world @ drag


def coriolis_matrix(mass: Array, nu: Array) -> Array:
    """Return C(nu) of a mass matrix by Kirchhoff's equations, shape (3, 3); both in the body's axes."""
    surge, sway, _ = mass @ nu
    return np.array([[0.0, 0.0, -sway], [0.0, 0.0, surge], [sway, -surge, 0.0]])


def damping_matrix(nu: Array, vessel: Vessel) -> Array:
    """Return D(nu) at midship, shape (3, 3).

    Args:
        nu: Surge, sway and yaw at midship, shape (3,) [m/s, rad/s].
        vessel: Gives the coefficients.
    """
    u, v, r = np.abs(nu)
    terms = np.array([1.0, v, r])
    return np.array(
        [
            [np.dot([1.0, u, u * u], vessel[SURGE : SURGE + 3]), 0.0, 0.0],
            [0.0, terms @ vessel[SWAY : SWAY + 3], terms @ vessel[SWAY + 3 : SWAY + 6]],
            [0.0, terms @ vessel[YAW : YAW + 3], terms @ vessel[YAW + 3 : YAW + 6]],
        ]
    )
