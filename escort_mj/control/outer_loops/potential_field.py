"""Artificial potential fields (Khatib 1986): everything that a robot wants, added up."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import PositiveFloat

from escort_mj.behaviors.behavior import Avoidance
from escort_mj.behaviors.bodies import Body, obstacle_body, teammate_body
from escort_mj.behaviors.robots import Robots, robots_at
from escort_mj.behaviors.task import leave
from escort_mj.control.nsb import avoidance_of, enforce, set_velocities, task_of
from escort_mj.control.outer_loops.outer_loop import OuterLoop
from escort_mj.knowledge.teammates import may_be, places_of
from escort_mj.native.kernels import inlined
from escort_mj.native.lanes import WIDTH, Lanes, any_of, everywhere, greatest
from escort_mj.native.vectors import Vec, dot, norm, numbers_at, set_numbers_at, unit_axis, where, zero_like
from escort_mj.plan import Plan, State


class PotentialField(OuterLoop):
    """Behaviors without priorities: the reference velocity v_d is the sum of their velocities.

    Instead of the avoidance task, every obstacle and teammate at a distance d below the safe distance d_0 of
    avoid_obstacles repels the robot with gain * (1/d - 1/d_0) / d^2; avoid_obstacles also determines how d is
    measured. Attraction and repulsion can cancel: such fields have local minima and guarantee no minimum
    distance. What breaks an inequality, as that of a boundary, is taken from the sum.
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
        r, moving = robots_at(i, plan, state), 0.0
        first, levels = int(plan.phase_first[phase]), int(plan.phase_levels[phase])
        for level in range(first, first + levels):
            if plan.target_feedforward and plan.level_in_world[level] == 0.0:
                moving = 1.0
        drift = r.target_velocity
        total, repelled = moving * drift, everywhere(0.0)
        for level in range(first, first + levels):
            if plan.level_avoids[level] != 0.0:
                push, near = repulsion(avoidance_of(level, plan), self.gain, self.least_distance, r)
                total = total + push
                repelled = greatest(repelled, near)
            elif plan.level_limit_row[level] < 0.0:
                total = total + task_of(level, r).velocity
        for level in range(first + levels - 1, first - 1, -1):
            if plan.level_limit_row[level] >= 0.0:
                frame = (1.0 - plan.level_in_world[level]) * moving * drift
                task = enforce(level, task_of(level, r), total, frame, r)
                total = frame + task.velocity + leave(task, total - frame)
        speed = norm(total)
        total = where(speed > plan.max_speed, plan.max_speed / speed, 1.0) * total
        set_velocities(phase, total, repelled, r)


@inlined
def repulsion(avoid: Avoidance, gain: float, least_distance: float, r: Robots) -> tuple[Vec, Lanes]:
    """Return what obstacles and teammates add to velocities, and 1 where they do (Khatib 1986, eq. 16).

    Args:
        avoid: What distances are kept.
        gain: Of the repulsion [m^4/s].
        least_distance: Below which it grows no further [m].
        r: The robots.
    """
    total, repelled = 0.0 * r.q, everywhere(0.0)
    for j in range(r.obstacles):
        total, repelled = _repel(obstacle_body(avoid, j, r), gain, least_distance, total, repelled)
    for j in range(r.state.q.shape[0]):
        body = teammate_body(avoid, j, r)
        if body.safe > 0.0:
            total, repelled = _repel(body, gain, least_distance, total, repelled)
    if avoid.heard_distance > 0.0:
        push = _push_of_heard(avoid, gain, least_distance, r)
        total = total + push
        repelled = where(dot(push, push) > 0.0, 1.0, repelled)
    return total, repelled


@inlined
def _repel(body: Body, gain: float, least_distance: float, total: Vec, repelled: Lanes) -> tuple[Vec, Lanes]:
    """Add the push of one body to velocities, and to who is pushed."""
    apart = norm(body.x)
    near = body.counts & (apart < body.reach)
    if any_of(near):
        away = where(apart > 0.0, body.x / apart, unit_axis(body.x, 0))
        distance = greatest(apart - body.covered, least_distance)
        speed = gain * greatest(1.0 / distance - 1.0 / body.safe, 0.0) / (distance * distance)
        total = total + where(near, speed, 0.0) * away
        repelled = where(near, 1.0, repelled)
    return total, repelled


@inlined
def _push_of_heard(avoid: Avoidance, gain: float, least_distance: float, r: Robots) -> Vec:
    """Return what teammates add to velocities that robots hear; arguments are those of `repulsion`."""
    safe = avoid.heard_distance
    for robot in range(r.i, min(r.i + WIDTH, r.state.q.shape[0])):
        push = zero_like(numbers_at(r.state, r.state.q, robot))
        for place in range(places_of(r.state)):
            mate, apart, covered, away = may_be(robot, place, avoid.to_surface, r.plan, r.state)
            if mate >= 0 and apart < safe + covered:
                distance = max(apart - covered, least_distance)
                speed = gain * max(1.0 / distance - 1.0 / safe, 0.0) / (distance * distance)
                push = push + speed * away
        set_numbers_at(r.state.wished_direction, robot, push)
    return r.at(r.state.wished_direction, 0)
