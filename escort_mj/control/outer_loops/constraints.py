"""Half-spaces of velocities that keep distances safe, and the nearest velocity within all of them."""

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
SHARED = 0.5  # marks constraints by teammates with goals of their own


class Pace(NamedTuple):
    """How fast a robot may be.

    Attributes:
        speed: Largest |v| that matters [m/s].
        beside: Largest speed relative to the motion of the team, see `team_motion` [m/s].
    """

    speed: float
    beside: float


class Constraints(NamedTuple):
    """What a robot's velocity v has to satisfy, r . v >= b, for up to MOST bodies.

    Attributes:
        rows: Unit vectors r away from the bodies, shape (MOST, p).
        bounds: b, shape (MOST,) [m/s].
        shared: 1 for teammates that follow the same target, `SHARED` for those with goals of their own, 0 for
            all else, shape (MOST,).
        gaps: How far the robot goes, at its speed limit, before each body could touch it if it went to meet
            it, shape (MOST,) [m]. A teammate that is heard is where it is most likely to be.
    """

    rows: Array
    bounds: Array
    shared: Array
    gaps: Array


@inlined
def find_constraints(
    robot: int, pace: Pace, clearance: Clearance, plan: Plan, state: State, found: Constraints
) -> int:
    """Find what a robot's velocity v has to satisfy, r . v >= b, for each body that it sees.

    Two robots take half of the closing speed each, relative to the motion of their target. Those of two teams
    do so relative to the mean of their targets' motions or, where each robot knows its own target only, in
    the world frame. Failed robots do not do their half. Bodies that no velocity within the two speeds could
    violate are left out.

    Args:
        robot: From 0.
        pace: How fast it may be.
        clearance: What distances it keeps.
        plan: Gives the bodies.
        state: Gives where they are.
        found: Result.

    Returns:
        Number of constraints; where there are more than MOST, those with the greatest bounds are kept.
    """
    n, avoid, rules = state.q.shape[0], clearance.avoid, clearance.rules
    m, position, count = plan.obstacle_radius.shape[0], obstacles_seen(robot, plan, state), 0
    spread = rules.foresees * team_spread(robot, plan, state) if plan.team_radius.shape[0] > 0 else 0.0
    speed, beside = pace.speed, pace.beside + spread
    q, near = numbers_at(state, state.q_measured, robot), vector_at(stack_memory(), NEAR)
    count = _add_limits(robot, speed, plan, state, found, count)
    own, to_surface, mates = plan.robot_radius[robot], avoid.to_surface, int(ALL)
    if plan.failure.shape[0] == 0:
        mates = 0
        if avoid.teammate_distance > 0.0:
            motion, ahead = team_motion(robot, rules, plan, state), beside + spread
            mates = find_meeting(robot, 2.0 * beside, ahead, motion, clearance, plan, state, near)
    everyone, heard = mates == int(ALL), places_of(state) if avoid.heard_distance > 0.0 else 0
    fastest = fastest_obstacle(state)
    away = horizon(speed + fastest, rules)
    lead = rules.foresees * lead_of(fastest, plan.max_speed)
    seen = m + (n if everyone else mates)
    for place in range(seen + heard + 1):
        if place >= seen:  # what is heard, then the target
            other = m + n + (place - seen + 1) % (heard + 1)
        else:
            other = place if place < m or everyone else m + int(near[place - m])
        if place < m:
            reach = avoid.safe_distance + to_surface * (own + plan.seen_radius[place])
            far = away + reach + lead * (reach + breadth_of(plan.obstacle_extent[place]))
            way = q - numbers_at(state, position, place)
            if dot(way, way) > far * far:
                continue
        count = _consider(robot, other, Pace(speed, beside), clearance, plan, state, found, count)
    return count


@inlined
def _add_limits(robot: int, speed: float, plan: Plan, state: State, found: Constraints, count: int) -> int:
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
            count = _keep(direction, bound, 0.0, UNLIMITED, found, count)
    return count


@inlined
def team_motion(robot: int, rules: Rules, plan: Plan, state: State) -> Vec:
    """Return the velocity relative to which a robot keeps distances to teammates [m/s]."""
    return where(plan.target_feedforward, rules.foresees * target_speed(robot, plan, state), 0.0)


@inlined
def team_spread(robot: int, plan: Plan, state: State) -> float:
    """Return by how much the motion that two robots share may differ from that of a robot's team [m/s]."""
    if plan.informed:
        return norm(target_speed(robot, plan, state)) if plan.target_feedforward else 0.0
    most, teams = 0.0, state.team_velocity.shape[0]
    for a in range(teams if plan.target_feedforward else 0):
        for b in range(a):
            apart = numbers_at(state, state.team_velocity, a) - numbers_at(state, state.team_velocity, b)
            most = max(most, dot(apart, apart))
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
def _consider(
    robot: int, other: int, pace: Pace, clearance: Clearance, plan: Plan, state: State, found: Constraints,
    count: int,
) -> int:  # fmt: skip
    """Add the constraint of one body; return their number.

    Bodies are obstacles, then robots as they are seen, the target, and robots as this one hears them.
    """
    n, m, (speed, beside) = state.q.shape[0], plan.obstacle_radius.shape[0], pace
    avoid, rules, position = clearance.avoid, clearance.rules, obstacles_seen(robot, plan, state)
    q = numbers_at(state, state.q_measured, robot)
    share, mate, straight, pursuit = 1.0, other - m, 0.0, 0.0
    followed, teams = rules.target_radius > 0.0, plan.team_radius.shape[0] > 0
    heard, own = mate - n - 1 if mate > n else -1, plan.robot_radius[robot]
    if heard >= 0:
        mate, apart, covered, direction = may_be(robot, heard, avoid.to_surface, plan, state)
        if mate < 0:
            return count
        reach, radius = avoid.heard_distance + covered, plan.robot_radius[mate]
    else:
        safe, radius, sight = _kept_distance(robot, mate, avoid, rules, plan, state)
        if safe <= 0.0:
            return count
        if mate == n:
            place = target_place(robot, plan, state)
        elif mate < 0:
            place = numbers_at(state, position, other)
        else:
            place = numbers_at(state, state.q_measured, mate)
        direction, apart = unit_of(q - place)
        if not apart - own - radius <= sight:
            return count
        reach = safe + avoid.to_surface * (own + radius)
    margin, gap = apart - reach, apart - own - radius
    if rules.cone != 0.0 and margin > 0.0:
        return count
    if mate < 0:
        motion = obstacle_speed(other, plan, state)
    elif mate == n:
        motion = target_speed(robot, plan, state)
    elif state.lost[mate] != 0.0:
        motion = numbers_at(state, state.v_measured, mate)
    else:
        motion, share = team_motion(robot, rules, plan, state), 0.5
        if teams:
            followed = state.member_of[robot] == state.member_of[mate]
            if not plan.informed:
                motion = 0.5 * (motion + team_motion(mate, rules, plan, state))
            elif not followed:
                motion = zero_like(motion)  # neither knows how the other's targets move
        velocity = numbers_at(state, state.v_measured, mate)
        if heard >= 0:
            velocity = heard_velocity(robot, heard, state)
        pursuit = rules.foresees * dot(direction, velocity)
    along, pace_of_body = dot(direction, motion), norm(motion) if share == 1.0 else 0.0
    outrun = share == 1.0 and rules.foresees != 0.0 and along > 0.0
    lead, wide = lead_of(pace_of_body, plan.max_speed) if outrun else 0.0, 0.0
    if lead > 0.0 and mate < 0:
        wide = breadth(plan.obstacle_extent[other], state.obstacle_velocity[other], pace_of_body)
    lead *= reach + wide
    full = approach(margin - lead, rules)
    allowed = share * full
    bound = rules.foresees * along - allowed
    if share < 1.0 and rules.foresees != 0.0:  # one that does not do its half is met in full
        bound, allowed = max(bound, pursuit - full), min(allowed, full + along - pursuit)
    could = (beside if share < 1.0 else speed + rules.foresees * pace_of_body) - allowed
    if could < 0.0:
        return count
    if lead > 0.0:
        if wide > 0.0:
            direction, apart = unit_of(q - numbers_at(state, state.obstacle_position, other))
        v = numbers_at(state, state.v_measured, robot)
        bound, direction = leave_path(apart, reach + wide, v, motion, rules, direction)
        straight = min(along - approach(margin, rules), plan.max_speed * plan.max_speed / pace_of_body)
        bound = min(bound, aside_of(straight, plan.max_speed))
    if bound < -speed:
        return count
    if share == 1.0:
        gap /= 1.0 + max(rules.foresees * along, 0.0) / plan.max_speed
    with_whom = 0.0 if share == 1.0 else 1.0 if followed else SHARED
    count = _keep(direction, bound, with_whom, gap, found, count)
    if lead > 0.0 and bound > 0.0:
        count = _keep(motion / pace_of_body, straight, 0.0, gap, found, count)
    return count


@inlined
def _kept_distance(
    robot: int, mate: int, avoid: Avoidance, rules: Rules, plan: Plan, state: State
) -> tuple[float, float, float]:
    """Return what distance a robot keeps to a body, the body's radius, and how far away robots see it [m].

    The distance is 0 where the body is not avoided; failed robots are obstacles (remark 2).

    Args:
        robot: From 0.
        mate: Which robot the body is; their number for the target, and below 0 obstacles, the last one -1.
        avoid: What distances are kept.
        rules: Gives that to the target.
        plan: Gives radii.
        state: Gives who has failed.
    """
    if mate < 0:
        return avoid.safe_distance, plan.seen_radius[mate + plan.seen_radius.shape[0]], plan.sensing_obstacles
    if mate == state.q.shape[0]:
        return rules.target_distance, rules.target_radius, math.inf
    safe = avoid.teammate_distance
    if state.lost[mate] != 0.0:
        safe = max(safe, avoid.safe_distance)
    return 0.0 if mate == robot else safe, plan.robot_radius[mate], plan.sensing_robots


@inlined
def _keep(direction: Vec, bound: float, with_whom: float, gap: float, found: Constraints, count: int) -> int:
    """Add a constraint, in place of the one with the least bound where there are MOST of them."""
    place, bounds = count, found.bounds
    if count == MOST:
        place = 0
        for at in range(1, MOST):
            if bounds[at] < bounds[place]:
                place = at
        if bound <= bounds[place]:
            return count
    bounds[place], found.shared[place], found.gaps[place] = bound, with_whom, gap
    set_numbers_at(found.rows, place, direction)
    return min(count + 1, MOST)
