"""What the laws and behaviors of plugins see and write: parts of the controller's memory, by name.

The same fields in Python, as NumPy arrays, and in kernels. n robots, p axes, m obstacles. SI units, world
frame.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from escort_mj.native.fields import Array

ALONG, ACROSS, NOTHING = 1, -1, 0
"""What a behavior's task takes: `direction` alone, all directions but it, nothing at the moment."""


class LawView(NamedTuple):
    """What a law sees of all robots, and what it writes: `tau`, and rates of what is integrated for it."""

    timestep: float  # [s]
    slope: float  # of s [1/s]
    time: Annotated[Array, 1]  # [s]
    q_measured: Annotated[Array, "n", "p"]  # measured position [m]
    v_measured: Annotated[Array, "n", "p"]  # measured velocity [m/s]
    q_d: Annotated[Array, "n", "p"]  # reference position [m]
    v_d: Annotated[Array, "n", "p"]  # reference velocity [m/s]
    e: Annotated[Array, "n", "p"]  # q_d - q_measured [m]
    e_dot: Annotated[Array, "n", "p"]  # v_d - v_measured [m/s]
    s: Annotated[Array, "n", "p"]  # e_dot + slope e [m/s]
    force_limits: Annotated[Array, "n", "p"]  # of the motors [N]; 1e300 for none
    model_mass: Annotated[Array, "modeled", "p*p"]  # mass matrices, row by row [kg]; for laws that need them
    model_bias: Annotated[Array, "modeled", "p"]  # bias forces [N]; likewise
    v_d_rate: Annotated[Array, "differentiating", "p"]  # derivative of v_d; if the law asks [m/s^2]
    rho_hat: Annotated[Array, "n", "p"]  # the estimate: the integral of its rate [N]
    component_memory: Annotated[Array, "memories", "n", "p"]  # integrals of the rates below, at first 0
    memory_row: Annotated[Array, 1]  # where its own begin
    tau: Annotated[Array, "n", "p"]  # written: the force demanded [N]
    rho_hat_rate: Annotated[Array, "n", "p"]  # written: 0 unless said [N/s]
    component_rate: Annotated[Array, "memories", "n", "p"]  # written: 0 unless said
    rate_found: Annotated[Array, "remembering", "p"]  # scratch


class BehaviorView(NamedTuple):
    """What a behavior sees of all robots, and where it writes what it wishes of one."""

    timestep: float  # [s]
    radius: float  # distance to keep from the target [m]
    max_speed: float  # [m/s]; 1e300 for no limit
    time: Annotated[Array, 1]  # [s]
    q_measured: Annotated[Array, "n", "p"]  # measured position [m]
    v_measured: Annotated[Array, "n", "p"]  # measured velocity [m/s]
    target_position_measured: Annotated[Array, "p"]  # [m]
    target_velocity_measured: Annotated[Array, "p"]  # [m/s]
    robot_radius: Annotated[Array, "n"]  # [m]
    lost: Annotated[Array, "n"]  # 1 for robots that have failed
    obstacle_position: Annotated[Array, "m", "p"]  # centers [m]
    obstacle_radius: Annotated[Array, "m"]  # 0 for those that are no spheres [m]
    wish_direction: Annotated[Array, "p"]  # written: the task's direction, of any length but 0
    wish_velocity: Annotated[Array, "p"]  # written: what is wished of the robot [m/s]
    wish_error: Annotated[Array, 1]  # written: how far the task is from done [m]


LAW_OUTPUTS = ("tau", "rho_hat_rate", "component_rate")
BEHAVIOR_OUTPUTS = ("wish_direction", "wish_velocity", "wish_error")
