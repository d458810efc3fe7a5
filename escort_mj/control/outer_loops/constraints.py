"""Half-spaces of velocities that keep distances safe."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.behaviors.behavior import Avoidance
from escort_mj.components.obstacles import obstacle_speed, obstacles_seen
from escort_mj.components.parameters import UNLIMITED
from escort_mj.control.outer_loops.meeting import NEAR, find_meeting
from escort_mj.control.outer_loops.passing import (
    Clearance,
    Rules,
    approach,
    aside_of,
    breadth,
    breadth_of,
    horizon,
    lead_of,
    leave_path,
)
from escort_mj.knowledge.belief import target_place, target_speed
from escort_mj.knowledge.teammates import heard_velocity, may_be, places_of
from escort_mj.native.kernels import inlined, stack_memory, vector_at
from escort_mj.native.vectors import Vec, dot, norm, numbers_at, set_numbers_at, unit_of, where, zero_like
from escort_mj.numerics.neighbors import ALL
from escort_mj.plan import Plan, State

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

MOST = 24  # constraints of one robot: those with the greatest bounds
OTHER_TARGET = 0.5  # marks constraints by teammates that follow another target


class SpeedBounds(NamedTuple):
    """How fast a robot may be.

    Attributes:
        absolute: Largest |v| that matters [m/s].
        relative: Largest speed relative to the motion of the team, see `team_motion` [m/s].
    """

    absolute: float
    relative: float


class Constraints(NamedTuple):
    """What a robot's velocity v has to satisfy, r . v >= b, for up to MOST bodies.

    Attributes:
        rows: Unit vectors r away from the bodies, shape (MOST, p).
        bounds: b, shape (MOST,) [m/s].
        cooperation: 1 for teammates that follow the same target, `OTHER_TARGET` for those that follow another
            one, 0 for all else, shape (MOST,).
        gaps: Distance between the surfaces of robot and body, for bodies that do not yield divided by
            1 + closing speed of the body / speed limit of the robot, shape (MOST,) [m]. For a teammate that
            is heard, the distance from its most likely position.
    """

    rows: Array
    bounds: Array
    cooperation: Array
    gaps: Array


@inlined
def find_constraints(
    robot: int, limits: SpeedBounds, clearance: Clearance, plan: Plan, state: State, constraints: Constraints
) -> int:
    """Find what a robot's velocity v has to satisfy, r . v >= b, for each body that it sees.

    Two robots take half of the closing speed each, relative to the motion of their target. Those of two teams
    do so relative to the mean of their targets' motions or, where each robot knows its own target only, in
    the world frame. Failed robots do not do their half. Bodies that no velocity within the two speeds could
    violate are left out.

    Args:
        robot: From 0.
        limits: How fast it may be.
        clearance: What distances it keeps.
        plan: Gives the bodies.
        state: Gives where they are.
        constraints: Result.

    Returns:
        Number of constraints; where there are more than MOST, those with the greatest bounds are kept.
    """
    n, avoid, rules = state.q.shape[0], clearance.avoid, clearance.rules
    m, position, count = plan.obstacle_radius.shape[0], obstacles_seen(robot, plan, state), 0
    spread = rules.foresees * team_spread(robot, plan, state) if plan.team_radius.shape[0] > 0 else 0.0
    speed, relative = limits.absolute, limits.relative + spread
    q, neighbors = numbers_at(state, state.q_measured, robot), vector_at(stack_memory(), NEAR)
    count = _add_inequalities(robot, speed, plan, state, constraints, count)
    own, to_surface, mates = plan.robot_radius[robot], avoid.to_surface, int(ALL)
    if plan.failure.shape[0] == 0:
        mates = 0
        if avoid.teammate_distance > 0.0:
            motion, ahead = team_motion(robot, rules, plan, state), relative + spread
            mates = find_meeting(robot, 2.0 * relative, ahead, motion, clearance, plan, state, neighbors)
    everyone, heard = mates == int(ALL), places_of(state) if avoid.heard_distance > 0.0 else 0
    fastest = fastest_obstacle(state)
    away = horizon(speed + fastest, rules)
    lead = rules.foresees * lead_of(fastest, plan.max_speed)
    seen = m + (n if everyone else mates)
    for slot in range(seen + heard + 1):  # obstacles, teammates, those heard, the target: one inlined call
        if slot >= seen:
            body = m + n + (slot - seen + 1) % (heard + 1)
        else:
            body = slot if slot < m or everyone else m + int(neighbors[slot - m])
        if slot < m:
            reach = avoid.safe_distance + to_surface * (own + plan.seen_radius[slot])
            far = away + reach + lead * (reach + breadth_of(plan.obstacle_extent[slot]))
            way = q - numbers_at(state, position, slot)
            if dot(way, way) > far * far:
                continue
        both = SpeedBounds(speed, relative)
        count = _add_body(robot, body, both, clearance, plan, state, constraints, count)
    return count


@inlined
def _add_inequalities(
    robot: int, speed: float, plan: Plan, state: State, constraints: Constraints, count: int
) -> int:
    """Add the constraints of the robot's inequalities that a velocity of some speed could break."""
    phase = int(state.phase[robot])
    first = int(plan.phase_first[phase])
    for level in range(first, first + int(plan.phase_levels[phase])):
        row = int(plan.level_limit_row[level])
        if row < 0:
            continue
        direction, length = unit_of(numbers_at(state, state.limit_x, row + robot))
        bound = state.limit_rate[row + robot] / length if length > 0.0 else -UNLIMITED
        if bound >= -speed:
            count = _insert(direction, bound, 0.0, UNLIMITED, constraints, count)
    return count


@inlined
def team_motion(robot: int, rules: Rules, plan: Plan, state: State) -> Vec:
    """Return the velocity relative to which a robot keeps distances to teammates [m/s]."""
    return where(plan.target_feedforward, rules.foresees * target_speed(robot, plan, state), 0.0)


@inlined
def team_spread(robot: int, plan: Plan, state: State) -> float:
    """Return by how much the motion that two robots share may differ from that of a robot's team [m/s]."""
    if plan.estimating:
        return norm(target_speed(robot, plan, state)) if plan.target_feedforward else 0.0
    most, teams = 0.0, state.team_velocity.shape[0]
    for a in range(teams if plan.target_feedforward else 0):
        for b in range(a):
            difference = numbers_at(state, state.team_velocity, a) - numbers_at(state, state.team_velocity, b)
            most = max(most, dot(difference, difference))
    return 0.5 * math.sqrt(most)


@inlined
def fastest_obstacle(state: State) -> float:
    """Return the greatest speed of an obstacle [m/s]."""
    most = 0.0
    for j in range(state.obstacle_velocity.shape[0]):
        velocity = numbers_at(state, state.obstacle_velocity, j)
        most = max(most, dot(velocity, velocity))
    return math.sqrt(most)


@inlined
def _add_body(
    robot: int, body: int, limits: SpeedBounds, clearance: Clearance, plan: Plan, state: State,
    constraints: Constraints, count: int,
) -> int:  # fmt: skip
    """Add the constraint of one body; return their number.

    Bodies are obstacles, then robots as they are seen, the target, and robots as this one hears them.
    """
    n, m, (speed, relative) = state.q.shape[0], plan.obstacle_radius.shape[0], limits
    avoid, rules, position = clearance.avoid, clearance.rules, obstacles_seen(robot, plan, state)
    q = numbers_at(state, state.q_measured, robot)
    responsibility, other, straight, other_speed = 1.0, body - m, 0.0, 0.0
    # Without teams, all follow the target, where there is one.
    same_target, teams = rules.target_radius > 0.0, plan.team_radius.shape[0] > 0
    heard, own = other - n - 1 if other > n else -1, plan.robot_radius[robot]
    if heard >= 0:
        other, distance, covered, direction = may_be(robot, heard, avoid.to_surface, plan, state)
        if other < 0:
            return count
        reach, radius = avoid.heard_distance + covered, plan.robot_radius[other]
    else:
        safe, radius, sight = _body_geometry(robot, other, avoid, rules, plan, state)
        if safe <= 0.0:
            return count
        if other == n:
            place = target_place(robot, plan, state)
        elif other < 0:
            place = numbers_at(state, position, body)
        else:
            place = numbers_at(state, state.q_measured, other)
        direction, distance = unit_of(q - place)
        if not distance - own - radius <= sight:
            return count
        reach = safe + avoid.to_surface * (own + radius)
    margin, gap = distance - reach, distance - own - radius
    if rules.cone != 0.0 and margin > 0.0:
        return count
    if other < 0:
        motion = obstacle_speed(body, plan, state)
    elif other == n:
        motion = target_speed(robot, plan, state)
    elif state.lost[other] != 0.0:
        motion = numbers_at(state, state.v_measured, other)
    else:
        motion, responsibility = team_motion(robot, rules, plan, state), 0.5
        if teams:
            same_target = state.member_of[robot] == state.member_of[other]
            if not plan.estimating:
                motion = 0.5 * (motion + team_motion(other, rules, plan, state))
            elif not same_target:
                motion = zero_like(motion)  # neither knows how the other's targets move
        velocity = numbers_at(state, state.v_measured, other)
        if heard >= 0:
            velocity = heard_velocity(robot, heard, state)
        other_speed = rules.foresees * dot(direction, velocity)
    along, body_speed = dot(direction, motion), norm(motion) if responsibility == 1.0 else 0.0
    approaches = responsibility == 1.0 and rules.foresees != 0.0 and along > 0.0
    lead, half_breadth = lead_of(body_speed, plan.max_speed) if approaches else 0.0, 0.0
    if lead > 0.0 and other < 0:
        half_breadth = breadth(plan.obstacle_extent[body], state.obstacle_velocity[body], body_speed)
    allowed_closing = approach(margin - lead * (reach + half_breadth), rules)
    own_share = responsibility * allowed_closing
    bound = rules.foresees * along - own_share
    if responsibility < 1.0 and rules.foresees != 0.0:  # the whole, where a teammate does not yield its half
        bound = max(bound, other_speed - allowed_closing)
        own_share = min(own_share, allowed_closing + along - other_speed)
    fastest_closing = relative if responsibility < 1.0 else speed + rules.foresees * body_speed
    if fastest_closing < own_share:  # no velocity within the limits could break the constraint
        return count
    if lead > 0.0:
        if half_breadth > 0.0:
            direction, distance = unit_of(q - numbers_at(state, state.obstacle_position, body))
        v = numbers_at(state, state.v_measured, robot)
        bound, direction = leave_path(distance, reach + half_breadth, v, motion, rules, direction)
        straight = min(along - approach(margin, rules), plan.max_speed * plan.max_speed / body_speed)
        bound = min(bound, aside_of(straight, plan.max_speed))
    if bound < -speed:
        return count
    if responsibility == 1.0:
        gap /= 1.0 + max(rules.foresees * along, 0.0) / plan.max_speed
    cooperation = 0.0 if responsibility == 1.0 else 1.0 if same_target else OTHER_TARGET
    count = _insert(direction, bound, cooperation, gap, constraints, count)
    if lead > 0.0 and bound > 0.0:
        count = _insert(motion / body_speed, straight, 0.0, gap, constraints, count)
    return count


@inlined
def _body_geometry(
    robot: int, other: int, avoid: Avoidance, rules: Rules, plan: Plan, state: State
) -> tuple[float, float, float]:
    """Return what distance a robot keeps to a body, the body's radius, and how far away robots see it [m].

    The distance is 0 where the body is not avoided; failed robots are obstacles (remark 2).

    Args:
        robot: From 0.
        other: Which robot the body is; their number for the target, and below 0 obstacles, the last one -1.
        avoid: What distances are kept.
        rules: Gives that to the target.
        plan: Gives radii.
        state: Gives who has failed.
    """
    if other < 0:
        return (
            avoid.safe_distance,
            plan.seen_radius[other + plan.seen_radius.shape[0]],
            plan.sensing_obstacles,
        )
    if other == state.q.shape[0]:
        return rules.target_distance, rules.target_radius, math.inf
    safe = avoid.teammate_distance
    if state.lost[other] != 0.0:
        safe = max(safe, avoid.safe_distance)
    return 0.0 if other == robot else safe, plan.robot_radius[other], plan.sensing_robots


@inlined
def _insert(
    direction: Vec, bound: float, cooperation: float, gap: float, constraints: Constraints, count: int
) -> int:
    """Add a constraint, in place of the one with the least bound where there are MOST of them."""
    place, bounds = count, constraints.bounds
    if count == MOST:
        place = 0
        for at in range(1, MOST):
            if bounds[at] < bounds[place]:
                place = at
        if bound <= bounds[place]:
            return count
    bounds[place], constraints.cooperation[place], constraints.gaps[place] = bound, cooperation, gap
    set_numbers_at(constraints.rows, place, direction)
    return min(count + 1, MOST)
