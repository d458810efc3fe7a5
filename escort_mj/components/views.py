"""What the laws and behaviors of plugins see and write: parts of the controller's memory, by name.

The same fields in Python, as NumPy arrays, and in kernels. n robots, p axes, m obstacles. SI units, world
frame.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from escort_mj.native.fields import Array


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
    """What behaviors and rules see of all robots, by `behaviors.robots`, and where their answers are kept."""

    timestep: float  # [s]
    radius: float  # distance to keep from the target [m]
    max_speed: float  # [m/s]; 1e300 for no limit
    sensing_robots: float  # range within which teammates are seen [m]
    sensing_obstacles: float  # likewise obstacles [m]
    apart: bool  # whether robots have targets, or estimates of it, each by itself
    estimating: bool  # whether they have estimates
    shaped: bool  # whether some obstacle is no sphere
    radio_place: int  # where the radio's block in `parameters` begins
    time: Annotated[Array, 1]  # [s]
    step: Annotated[Array, 1]  # number of the step
    parameters: Annotated[Array, "parameters"]  # blocks of components
    q: Annotated[Array, "n", "p"]  # true position, for its shape [m]
    q_measured: Annotated[Array, "n", "p"]  # measured position [m]
    v_measured: Annotated[Array, "n", "p"]  # measured velocity [m/s]
    e: Annotated[Array, "n", "p"]  # q_d - q_measured [m]
    slopes: Annotated[Array, "n"]  # of s [1/s]
    robot_radius: Annotated[Array, "n"]  # [m]
    lost: Annotated[Array, "n"]  # 1 for robots that have failed
    target_position_measured: Annotated[Array, "p"]  # [m]
    target_velocity_measured: Annotated[Array, "p"]  # [m/s]
    target_estimate: Annotated[Array, "estimating", "p"]  # of each robot [m]
    target_velocity_estimate: Annotated[Array, "estimating", "p"]  # [m/s]
    team_radius: Annotated[Array, "teams"]  # [m]
    team_center: Annotated[Array, "teams", "p"]  # middle of each team's targets [m]
    team_velocity: Annotated[Array, "teams", "p"]  # [m/s]
    member_of: Annotated[Array, "members"]  # team of each robot, from 1
    own_radius: Annotated[Array, "members"]  # distance that each keeps from its targets [m]
    obstacle_position: Annotated[Array, "m", "p"]  # centers [m]
    obstacle_velocity: Annotated[Array, "m", "p"]  # [m/s]
    obstacle_radius: Annotated[Array, "m"]  # 0 for those that are no spheres [m]
    seen_radius: Annotated[Array, "m"]  # as robots see them [m]
    obstacle_point: Annotated[Array, "seen*m", "p"]  # nearest points of those that are no spheres [m]
    lidar_rays: Annotated[Array, "rays", "p"]  # none without a lidar
    lidar_point: Annotated[Array, "scanned*m", "p"]  # nearest returns [m]
    link_from: Annotated[Array, "hearing", "slots"]  # teammates that each robot hears; none without a radio
    link_step: Annotated[Array, "hearing", "slots"]  # step of the newest message
    heard_position: Annotated[Array, "hearing*slots", "p"]  # [m]
    heard_velocity: Annotated[Array, "hearing*slots", "p"]  # [m/s]
    asked_velocity: Annotated[Array, "n", "p"]  # written: what a task asks, see `behaviors.task` [m/s]
    asked_x: Annotated[Array, "n", "p"]  # written: its gradient
    asked_other: Annotated[Array, "n", "p"]  # written: another one
    asked: Annotated[Array, "n", 9]  # written: all else
    compared: Annotated[Array, "ruled"]  # written by rules
    component_memory: Annotated[Array, "memories", "n", "p"]  # integrals of the rates below, at first 0
    memory_row: Annotated[Array, 1]  # where its own begin
    component_rate: Annotated[Array, "memories", "n", "p"]  # written: 0 unless said
    rate_found: Annotated[Array, "remembering", "p"]  # scratch
    goal: Annotated[Array, "headed", "p"]  # where each robot is sent, if anywhere [m]
    goal_velocity: Annotated[Array, "headed", "p"]  # [m/s]
    vertices: Annotated[Array, "vertices", "p"]  # unit vectors; none where no behavior asks for them
    rotation: Annotated[Array, "turned", "p", "p"]  # of their figure
    predecessors: Annotated[Array, "cycles", "n"]  # robot before each, from 0; none without `chords`
    chord_length: Annotated[Array, 1]  # [m]
    threat: Annotated[Array, "guarding"]  # opponent of each robot; 0 for none
    threat_position: Annotated[Array, "guarding", "p"]  # [m]
    threat_velocity: Annotated[Array, "guarding", "p"]  # [m/s]


LAW_OUTPUTS = ("tau", "rho_hat_rate", "component_rate")
BEHAVIOR_OUTPUTS = ("asked_velocity", "asked_x", "asked_other", "asked", "component_rate")
