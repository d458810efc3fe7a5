"""Artificial potential fields (Khatib 1986): everything that a robot wants, added up."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import PositiveFloat

from escort_mj.behaviors.robots import robots_at
from escort_mj.components.obstacles import obstacles_seen
from escort_mj.control.nsb import AVOID_OBSTACLES, avoidance_of, set_velocities, task_of
from escort_mj.control.outer_loops.nearby import bearing, reach_of
from escort_mj.control.outer_loops.outer_loop import OuterLoop, runs_now, slow_down
from escort_mj.knowledge.teammates import may_be, places_of
from escort_mj.native.fields import Array
from escort_mj.native.kernels import inlined, stack_memory, vector_at
from escort_mj.native.lanes import WIDTH, everywhere
from escort_mj.plan import Plan, State

Mask = NDArray[np.bool_]


class PotentialField(OuterLoop):
    """Behaviors without priorities: the reference velocity v_d is the sum of their velocities.

    Instead of the avoidance task, every obstacle and teammate at a distance d below the safe distance d_0 of
    avoid_obstacles repels the robot with gain * (1/d - 1/d_0) / d^2; avoid_obstacles also determines how d is
    measured. Attraction and repulsion can cancel: such fields have local minima and guarantee no minimum
    distance.
    """

    title: ClassVar[str] = "potential field"
    composes: ClassVar[bool] = False
    avoids: ClassVar[bool] = True
    loop: Literal["potential_field"] = "potential_field"
    gain: PositiveFloat = 0.3
    """Gain of the repulsion [m^4/s]."""
    least_distance: PositiveFloat = 0.2
    """Distance below which the repulsion stops growing [m]."""

    def velocity_lanes(self, i: int, phase: int, plan: Plan, state: State) -> None:
        """The same for robots i to i + 7, compiled."""
        (n, p), r = state.q.shape, robots_at(i, plan, state)
        first, levels = int(plan.phase_first[phase]), int(plan.phase_levels[phase])
        moving = 0.0
        for level in range(first, first + levels):
            if plan.target_feedforward and plan.level_in_world[level] == 0.0:
                moving = 1.0
        total = moving * r.target_velocity
        for level in range(first, first + levels):
            if plan.level_avoids[level] == 0.0:
                total = total + task_of(level, r).velocity
        set_velocities(phase, total, everywhere(0.0), r)
        for robot in range(i, min(i + WIDTH, n)):
            if not runs_now(robot, phase, plan, state):
                continue
            for level in range(first, first + levels):
                if plan.level_behavior[level] == AVOID_OBSTACLES:
                    avoid, direction = avoidance_of(level, plan), vector_at(stack_memory(), p)
                    repelled = repulsion(
                        robot, state.q_measured, state.lost, obstacles_seen(robot, plan, state),
                        plan.seen_radius, plan.robot_radius, avoid, self.gain, self.least_distance, direction,
                        state.v_d[robot],
                    )  # fmt: skip
                    if avoid.heard_distance > 0.0:
                        near = repulsion_of_heard(
                            robot, avoid, self.gain, self.least_distance, plan, state, direction,
                            state.v_d[robot],
                        )  # fmt: skip
                        repelled = repelled or near
                    state.avoidance_active[robot] = 1.0 if repelled else 0.0
            slow_down(robot, plan, state)


@inlined
def repulsion(
    robot: int,
    q: Array,
    lost: Array,
    obstacle_position: Array,
    obstacle_radius: Array,
    robot_radius: Array,
    avoid: Any,
    gain: float,
    least_distance: float,
    direction: Array,
    total: Array,
) -> bool:
    """Adds to a velocity what obstacles and teammates add to it (Khatib 1986, eq. 16).

    Args:
        robot: Which robot, from 0.
        q: Measured positions, shape (n, p) [m].
        lost: 1 for robots that have failed, shape (n,).
        obstacle_position: Centers, shape (m, p) [m].
        obstacle_radius: Shape (m,) [m].
        robot_radius: Shape (n,) [m].
        avoid: Parameters of avoid_obstacles.
        gain: Of the repulsion [m^4/s].
        least_distance: Below which it grows no further [m].
        direction: Scratch, shape (p,).
        total: The velocity, shape (p,) [m/s]; changed in place.

    Returns:
        Whether anything repels.
    """
    repelled = False
    for other in range(obstacle_radius.shape[0] + robot_radius.shape[0]):
        reach, bodies = reach_of(robot, other, lost, obstacle_radius, robot_radius, avoid)
        if reach == 0.0:
            continue
        apart = bearing(robot, other, q, obstacle_position, direction)
        if apart < reach:
            _repel(apart - bodies, reach - bodies, gain, least_distance, direction, total)
            repelled = True
    return repelled


@inlined
def repulsion_of_heard(
    robot: int, avoid: Any, gain: float, least_distance: float, plan: Plan, state: State, direction: Array,
    total: Array,
) -> bool:  # fmt: skip
    """Adds to a velocity what teammates add to it that a robot hears; the rest is as of `repulsion`."""
    repelled = False
    for place in range(places_of(state)):
        mate, apart, bodies = may_be(robot, place, float(avoid.measure), plan, state, direction)
        if mate >= 0 and apart < avoid.heard_distance + bodies:
            _repel(apart - bodies, avoid.heard_distance, gain, least_distance, direction, total)
            repelled = True
    return repelled


@inlined
def _repel(
    gap: float, safe: float, gain: float, least_distance: float, direction: Array, total: Array
) -> None:
    """Adds the push of one body to a velocity."""
    distance = max(gap, least_distance)
    speed = gain * max(1.0 / distance - 1.0 / safe, 0.0) / (distance * distance)
    for k in range(total.shape[0]):
        total[k] += speed * direction[k]
