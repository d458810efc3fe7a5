"""Obstacle avoidance (paper eqs. 3, 23-24): leave the safe sphere of the obstacle that intrudes most."""

from __future__ import annotations

from typing import Literal

from pydantic import NonNegativeFloat, PositiveFloat

from escort_mj.control.parameters import Parameters


class AvoidObstacles(Parameters):
    """Keeps each robot outside the safe sphere of obstacles and of its teammates."""

    behavior: Literal["avoid_obstacles"] = "avoid_obstacles"
    safe_distance: PositiveFloat = 2.0
    """Distance to an obstacle below which the behavior rules the robot [m]."""
    measure: Literal["center", "surface"] = "surface"
    """Where distances are measured: `surface` to surface, or `center` to center (the paper's points)."""
    teammates: bool = True
    """Whether a teammate that comes too near counts as an obstacle (remark 2)."""
    teammate_distance: PositiveFloat | None = None
    """Safe distance to teammates [m]; null: `safe_distance`, but at most half the formation's spacing."""
    gain: Literal["consistent", "printed"] = "consistent"
    """State-dependent gain: as eq. 23 demands (`consistent`), or with the printed coefficient (`printed`)."""
    gain_margin: NonNegativeFloat = 0.1
    """Constant added to the state-dependent gain [1/s] (paper: rho_i)."""
