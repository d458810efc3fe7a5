"""The water around a surface vessel: added mass, the Coriolis force that belongs to it, and damping.

The equations of motion in three degrees of freedom after Fossen, "Handbook of Marine Craft Hydrodynamics
and Motion Control", 2nd ed., 2021, ch. 6: M nu' + C(nu) nu + D(nu) nu = tau, with nu = (u, v, r) in surge,
sway and yaw, M = M_RB + M_A, and C by Kirchhoff's equations from M. They hold in the frame of any point of
the body's x axis; here it is the hand point, where the joints of `models/surface_vessel.xml` are.

MuJoCo does not know added mass. Its mass matrix is completed in place, before it solves for accelerations:
motion and contacts follow from the same M.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.native.kernels import kernel

Array = NDArray[np.float64]

FREEDOMS = 3  # x, y and heading
ENTRIES = 6  # of the lower triangle of a mass matrix of so many


class Vessel(NamedTuple):
    """What the water does to one vessel; the rows of `Addresses.vessels`. Damping that brakes is positive."""

    surge_mass: float  # of vessel and water [kg]
    sway_mass: float
    coupling: float  # of sway and yaw, at the hand point [kg m]
    inertia: float  # about the hand point [kg m^2]
    added_surge: float  # of the water alone [kg]
    added_sway: float
    added_coupling: float  # of sway and yaw, at the hand point [kg m]
    ahead: float  # of the hand point, from midship [m]
    surge_linear: float  # -X_u [kg/s]
    surge_quadratic: float  # -X_|u|u [kg/m]
    surge_cubic: float  # -X_uuu [kg s/m^2]
    sway_linear: float  # -Y_v [kg/s]
    sway_quadratic: float  # -Y_|v|v [kg/m]
    sway_yawing: float  # -Y_|r|v [kg]
    sway_by_yaw: float  # -Y_r [kg m/s]
    sway_by_yaw_swaying: float  # -Y_|v|r [kg]
    sway_by_yaw_quadratic: float  # -Y_|r|r [kg m]
    yaw_by_sway: float  # -N_v [kg m/s]
    yaw_by_sway_quadratic: float  # -N_|v|v [kg]
    yaw_by_sway_yawing: float  # -N_|r|v [kg m]
    yaw_linear: float  # -N_r [kg m^2/s]
    yaw_swaying: float  # -N_|v|r [kg m]
    yaw_quadratic: float  # -N_|r|r [kg m^2]


(
    SURGE_MASS, SWAY_MASS, COUPLING, INERTIA, ADDED_SURGE, ADDED_SWAY, ADDED_COUPLING, AHEAD, SURGE, _, _,
    SWAY, _, _, _, _, _, YAW, _, _, _, _, _,
) = range(len(Vessel._fields))  # fmt: skip


@kernel
def immerse(
    heading: float, velocity: Array, vessel: Array, mass: Array, coriolis: Array, damping: Array
) -> None:
    """Finds what a vessel's motion is governed by, in the world's axes.

    Args:
        heading: Angle of its x axis [rad].
        velocity: Of its hand point, and its rate of turn, shape (3,) [m/s, rad/s].
        vessel: A row of `Vessel`.
        mass: Result: lower triangle of the mass matrix of vessel and water, shape (6,) [kg, kg m, kg m^2].
        coriolis: Result: what the added mass adds to the bias force, shape (3,) [N, N m].
        damping: Result: force of the damping, shape (3,) [N, N m].
    """
    c, s = math.cos(heading), math.sin(heading)
    u, v = c * velocity[0] + s * velocity[1], c * velocity[1] - s * velocity[0]
    r = velocity[2]
    mass[0] = c * c * vessel[SURGE_MASS] + s * s * vessel[SWAY_MASS]
    mass[1] = c * s * (vessel[SURGE_MASS] - vessel[SWAY_MASS])
    mass[2] = s * s * vessel[SURGE_MASS] + c * c * vessel[SWAY_MASS]
    mass[3], mass[4], mass[5] = -s * vessel[COUPLING], c * vessel[COUPLING], vessel[INERTIA]
    difference = vessel[ADDED_SWAY] - vessel[ADDED_SURGE]
    along, across = -r * (difference * v + vessel[ADDED_COUPLING] * r), -r * difference * u
    coriolis[0], coriolis[1] = c * along - s * across, s * along + c * across
    coriolis[2] = difference * u * v
    v -= vessel[AHEAD] * r  # at midship, which damping is measured for
    speed, sway, yaw = abs(u), abs(v), abs(r)
    along = -u * (vessel[SURGE] + speed * (vessel[SURGE + 1] + speed * vessel[SURGE + 2]))
    across = -v * (vessel[SWAY] + sway * vessel[SWAY + 1] + yaw * vessel[SWAY + 2])
    across -= r * (vessel[SWAY + 3] + sway * vessel[SWAY + 4] + yaw * vessel[SWAY + 5])
    moment = -v * (vessel[YAW] + sway * vessel[YAW + 1] + yaw * vessel[YAW + 2])
    moment -= r * (vessel[YAW + 3] + sway * vessel[YAW + 4] + yaw * vessel[YAW + 5])
    damping[0], damping[1] = c * along - s * across, s * along + c * across
    damping[2] = moment - vessel[AHEAD] * across
