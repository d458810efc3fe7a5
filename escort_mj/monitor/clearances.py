"""What happens in truth at every physics step: clearances, speeds, effort. The law reads none of it."""

from __future__ import annotations

import math
from typing import Annotated

from escort_mj.monitor.motion import watch_displacements, watch_motion
from escort_mj.monitor.signals import GROUPS
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import inlined, merged
from escort_mj.native.lanes import (
    WIDTH,
    Lanes,
    any_of,
    everywhere,
    gather,
    lane_numbers,
    load,
    load_rows,
    pick,
    root,
    row_of,
    scatter,
    stack_rows,
    store,
    there,
    where,
)
from escort_mj.native.lanes import least as lesser
from escort_mj.native.on_demand import on_demand
from escort_mj.numerics.neighbors import (
    COUNT,
    FIRST,
    candidate,
    most_candidates,
    number_of_candidates,
)
from escort_mj.plan import Plan, State

NOBODY = -1.0
FAR_AWAY = 1e9  # m, how much farther than they are robots seem here that `world/loop/parts.py` watches
MANY = len(GROUPS)  # what is watched beyond these are single bodies


class ClearanceParameters(Fields):
    """What is watched; no bodies where nothing is."""

    watched_group: Annotated[Array, "bodies", Value("1", "column of clearances that a body counts to")]
    watched_alone: Annotated[Array, "bodies", Value("1", "the body's own column; -1 for none")]
    watched_radius: Annotated[
        Array, "n", Value("m", "of each robot; -FAR_AWAY of those that are more than their hulls")
    ]
    exact_within: Annotated[
        float, Value("m", "clearance below which the sphere around such a robot does not do for it")
    ]
    distances_asked: Annotated[
        bool,
        Value("1", "whether distances center to center are asked for in every step, not in samples only"),
    ]


class ClearanceState(Fields):
    """What was watched last."""

    watched_step: Annotated[Array, 1, Value("1", "steps watched so far")]
    watched_sample: Annotated[Array, 1, Value("1", "whether a sample was taken in the last of them")]
    stretch: Annotated[
        Array, "several", Value("m", "present reach of each robot, where some are more than their hulls")
    ]


@inlined
def is_noted(state: State) -> bool:
    """Whether this step has been watched before: mj_forward at the same time brings nothing new."""
    return state.step[0] + 1.0 == state.watched_step[0]


@inlined
def note_step(plan: Plan, state: State, target_radius: float, kinetic_energy: float) -> bool:
    """Adds one solved physics step, one that was not watched before, to the record.

    Args:
        plan: Gives radii, limits and timestep.
        state: `q`, `v`, `tau` and `force` are read; the record's worst and totals are written.
        target_radius: [m]; 0 where there is no target.
        kinetic_energy: Of all that moves freely [J].

    Returns:
        Whether the target overlaps an obstacle.
    """
    step = int(state.step[0])
    first = state.watched_step[0] == 0.0
    state.watched_step[0] = step + 1.0  # 0 is "never"
    if first or state.watched_sample[0] != 0.0:
        _forget(state)
    state.watched_sample[0] = state.sampled[0]
    state.kinetic_energy[0] = max(state.kinetic_energy[0], kinetic_energy)
    sampled = state.sampled[0] != 0.0 or plan.distances_asked
    watch_motion(plan, state, first)
    watch_displacements(plan, state, first)
    overlaps = _watch_obstacles(plan, state, target_radius, sampled)
    if state.neighbors.shape[0] > 0:
        _watch_crowd(plan, state, sampled)
    else:
        _watch_robots(plan, state, sampled)
    if state.target_clearance.shape[0] > MANY:
        _watch_single_bodies(plan, state, target_radius)
    return overlaps


@merged
def _forget(state: State) -> None:
    """Begins a new sample: what was worst since the last one is no more."""
    state.kinetic_energy[0] = 0.0
    for g in range(state.target_clearance.shape[0]):
        state.target_clearance[g], state.target_clearance_body[g] = math.inf, NOBODY
        for i in range(state.q.shape[0]):
            state.clearance[i, g], state.clearance_body[i, g] = math.inf, NOBODY
    for i in range(state.q.shape[0]):
        state.speed_max[i] = 0.0
    for i in range(state.point_speed_max.shape[0]):
        state.point_speed_max[i] = 0.0
    state.target_speed_max[0] = 0.0
    for j in range(state.obstacle_speed_max.shape[0]):
        state.obstacle_speed_max[j] = 0.0


@inlined
def _note(least: Array, nearest: Array, g: int, square: float, bodies: float, body: int) -> None:
    """Notes a distance where it is the least so far.

    A root is taken only of a distance that may be a new least one: few are.

    Args:
        least: Clearances by watched group [m].
        nearest: Bodies that were so near.
        g: Which of the groups.
        square: Squared distance, center to center [m^2].
        bodies: Sum of the two radii [m].
        body: Which body.
    """
    reach = least[g] + bodies
    if square < reach * reach:
        clearance = root(square) - bodies
        if clearance < least[g]:
            least[g], nearest[g] = clearance, body


@inlined
def note_clearance(least: Array, nearest: Array, g: int, clearance: float, body: int) -> None:
    """As `_note`, for a clearance that is known."""
    if clearance < least[g]:
        least[g], nearest[g] = clearance, body


@inlined
def note_pair(i: int, body: int, clearance: float, plan: Plan, state: State) -> None:
    """Note the clearance of a robot and another body, for both, wherever it is the least so far.

    Args:
        i: The robot.
        body: Another robot, the target (behind the robots) or an obstacle (behind the target).
        clearance: Surface to surface [m].
        plan: Gives the columns of bodies.
        state: The record's clearances are written.
    """
    n = state.q.shape[0]
    group, alone = int(plan.watched_group[body]), int(plan.watched_alone[body])
    note_clearance(state.clearance[i], state.clearance_body[i], group, clearance, body)
    if alone >= 0:
        note_clearance(state.clearance[i], state.clearance_body[i], alone, clearance, body)
    group, alone = int(plan.watched_group[i]), int(plan.watched_alone[i])
    if body < n:
        note_clearance(state.clearance[body], state.clearance_body[body], group, clearance, i)
        if alone >= 0:
            note_clearance(state.clearance[body], state.clearance_body[body], alone, clearance, i)
    elif body == n:
        note_clearance(state.target_clearance, state.target_clearance_body, group, clearance, i)
        if alone >= 0:
            note_clearance(state.target_clearance, state.target_clearance_body, alone, clearance, i)


@inlined
def _radii(i: int, plan: Plan) -> Lanes:
    """Radii of robots i to i + 7; no number for those that are far away: no distance is below that."""
    radius = load(plan.watched_radius, i)
    return where(radius < 0.0, math.nan, radius)


@inlined
def _note_robots(i: int, g: int, square: Lanes, bodies: Lanes, body: float, state: State) -> None:
    """As `_note`, for robots i to i + 7 and one body."""
    groups, left = state.clearance.shape[1], state.q.shape[0] - i
    least = gather(state.clearance, i * groups + g, groups)
    reach = least + bodies
    if any_of((square < reach * reach) & there(left)):
        clearance, nearest = root(square) - bodies, gather(state.clearance_body, i * groups + g, groups)
        nearer = clearance < least
        scatter(state.clearance, i * groups + g, groups, where(nearer, clearance, least))
        scatter(state.clearance_body, i * groups + g, groups, where(nearer, body, nearest))


@inlined
def note_rows(i: int, g: int, least: Lanes, who: Lanes, state: State) -> None:
    """Write the clearances of robots i to i + 7 to a group, and whose they are: NOBODY's where as before."""
    groups = state.clearance.shape[1]
    before = gather(state.clearance_body, i * groups + g, groups)
    scatter(state.clearance, i * groups + g, groups, least)
    scatter(state.clearance_body, i * groups + g, groups, where(who > NOBODY, who, before))


@merged
def _watch_obstacles(plan: Plan, state: State, target_radius: float, sampled: bool) -> bool:
    """Clearances to target and obstacles; where they are asked for also distances center to center.

    Returns:
        Whether the target overlaps an obstacle.
    """
    q = state.q
    n, p = q.shape
    m = plan.obstacle_radius.shape[0]
    robots, target = int(plan.watched_group[0]), int(plan.watched_group[n])
    here, groups = stack_rows(p), state.clearance.shape[1]
    for i in range(0, n, WIDTH):
        own, left, square = _radii(i, plan), n - i, everywhere(0.0)
        load_rows(q, i, here)
        if target_radius > 0.0:
            for k in range(p):
                x = row_of(here, k) - state.target_position[k]
                square = square + x * x
            _note_robots(i, target, square, own + target_radius, float(n), state)
            reach = state.target_clearance[robots] + (own + target_radius)
            if any_of((square < reach * reach) & there(left)):
                _note_robots_of_target(i, robots, target_radius, plan, state)
        g, least, who, found = -1, own, own, False
        for j in range(m):
            body = n + 1 + j
            if g != int(plan.watched_group[body]):
                if found:
                    note_rows(i, g, least, who, state)
                g = int(plan.watched_group[body])
                least = gather(state.clearance, i * groups + g, groups)
                who, found = everywhere(NOBODY), False
            if plan.shaped:
                rows = lesser(lane_numbers() + float(i), float(n - 1))
                gap = pick(state.obstacle_gap, rows * float(m) + float(j))
                nearer = (gap - own < least) & there(left)
                least, who = where(nearer, gap - own, least), where(nearer, float(body), who)
                found = found or any_of(nearer)
                if sampled:
                    scatter(state.obstacle_distance, i * m + j, m, gap + plan.obstacle_radius[j])
                continue
            square = everywhere(0.0)
            for k in range(p):
                x = row_of(here, k) - state.obstacle_position[j, k]
                square = square + x * x
            reach = least + (own + plan.obstacle_radius[j])
            if any_of((square < reach * reach) & there(left)):
                clearance = root(square) - (own + plan.obstacle_radius[j])
                nearer = clearance < least
                least, who, found = where(nearer, clearance, least), where(nearer, float(body), who), True
            if sampled:
                scatter(state.obstacle_distance, i * m + j, m, root(square))
        if found:
            note_rows(i, g, least, who, state)
    overlaps = False
    for j in range(m if target_radius > 0.0 else 0):
        body = n + 1 + j
        g = int(plan.watched_group[body])
        if plan.shaped:
            clearance_of_target = state.obstacle_gap[n * m + j] - target_radius
            overlaps = overlaps or clearance_of_target < 0.0
            note_clearance(state.target_clearance, state.target_clearance_body, g, clearance_of_target, body)
            continue
        square_of_target, bodies = 0.0, plan.obstacle_radius[j] + target_radius
        for k in range(p):
            square_of_target += (state.target_position[k] - state.obstacle_position[j, k]) ** 2
        overlaps = overlaps or square_of_target < bodies * bodies
        _note(state.target_clearance, state.target_clearance_body, g, square_of_target, bodies, body)
    return overlaps


@inlined
def _note_robots_of_target(i: int, g: int, target_radius: float, plan: Plan, state: State) -> None:
    """Notes the target's distances to robots i to i + 7."""
    n, p = state.q.shape
    for robot in range(i, min(i + WIDTH, n)):
        square = 0.0
        for k in range(p):
            x = state.q[robot, k] - state.target_position[k]
            square += x * x
        bodies = plan.watched_radius[robot] + target_radius
        _note(state.target_clearance, state.target_clearance_body, g, square, bodies, robot)


@on_demand
def _watch_single_bodies(plan: Plan, state: State, target_radius: float) -> None:
    """Clearances to bodies that are watched by themselves."""
    n, p = state.q.shape
    for body in range(n + 1 + plan.obstacle_radius.shape[0]):
        g = int(plan.watched_alone[body])
        if g < 0:
            continue
        for i in range(n + 1):  # the target last, if there is one
            if i == body or (i == n and target_radius == 0.0):
                continue
            square, bodies = 0.0, plan.watched_radius[i] if i < n else target_radius
            if body > n and plan.shaped:
                m = plan.obstacle_radius.shape[0]
                clearance = state.obstacle_gap[i * m + body - n - 1] - bodies
                if i < n:
                    note_clearance(state.clearance[i], state.clearance_body[i], g, clearance, body)
                else:
                    note_clearance(state.target_clearance, state.target_clearance_body, g, clearance, body)
                continue
            if body > n:
                bodies += plan.obstacle_radius[body - n - 1]
            else:
                bodies += plan.watched_radius[body] if body < n else target_radius
            for k in range(p):
                x = state.q[i, k] if i < n else state.target_position[k]
                if body > n:
                    x -= state.obstacle_position[body - n - 1, k]
                else:
                    x -= state.q[body, k] if body < n else state.target_position[k]
                square += x * x
            if i < n:
                _note(state.clearance[i], state.clearance_body[i], g, square, bodies, body)
            else:
                _note(state.target_clearance, state.target_clearance_body, g, square, bodies, body)


@merged
def _watch_robots(plan: Plan, state: State, sampled: bool) -> None:
    """Clearances between robots; where they are asked for also distances center to center."""
    q, radius = state.q, plan.watched_radius
    n, p = q.shape
    g, groups = int(plan.watched_group[0]), state.clearance.shape[1]
    here = stack_rows(p)
    for i in range(0, n, WIDTH):
        own, nearest = _radii(i, plan), everywhere(math.inf)
        load_rows(q, i, here)
        least = gather(state.clearance, i * groups + g, groups)
        who, found = everywhere(NOBODY), False
        for j in range(n):
            square = everywhere(0.0)
            for k in range(p):
                x = row_of(here, k) - q[j, k]
                square = square + x * x
            bodies, another = own + radius[j], (lane_numbers() + float(i) != float(j)) & there(n - i)
            reach = least + bodies
            if any_of((square < reach * reach) & another):
                clearance = root(square) - bodies
                nearer = (clearance < least) & another
                least, who, found = where(nearer, clearance, least), where(nearer, float(j), who), True
            if sampled:
                nearest = where((square < nearest) & another, square, nearest)
        if found:
            note_rows(i, g, least, who, state)
        if sampled:
            store(state.robot_distance_min, i, root(nearest))


@on_demand
def _watch_crowd(plan: Plan, state: State, sampled: bool) -> None:
    """As `_watch_robots`, by the lists of neighbors."""
    n, lists = state.q.shape[0], state.neighbors
    g = int(plan.watched_group[0])
    for i in range(0, n, WIDTH):
        most = most_candidates(i, lists)
        if most > 0:
            _watch_several(i, most, g, plan, state, sampled)
            continue
        for robot in range(i, min(i + WIDTH, n)):
            _watch_one(robot, g, plan, state, sampled)


@inlined
def _watch_several(i: int, most: int, g: int, plan: Plan, state: State, sampled: bool) -> None:
    """Clearances of robots i to i + 7 to their candidates, of which none has more than so many."""
    q, lists, radius = state.q, state.neighbors, plan.watched_radius
    n, p = q.shape
    groups, width, here = state.clearance.shape[1], lists.shape[1], stack_rows(p)
    own, nearest = _radii(i, plan), everywhere(math.inf)
    load_rows(q, i, here)
    least = gather(state.clearance, i * groups + g, groups)
    who = gather(state.clearance_body, i * groups + g, groups)
    rows = float(width) * lesser(lane_numbers() + float(i), float(n - 1))
    count = pick(lists, rows + float(COUNT))
    for place in range(most):
        others = pick(lists, rows + (float(FIRST) + lesser(count - 1.0, float(place))))
        square = everywhere(0.0)
        for k in range(p):
            x = row_of(here, k) - pick(q, others * float(p) + float(k))
            square = square + x * x
        nearest = where(square < nearest, square, nearest)
        bodies = own + pick(radius, others)
        reach = least + bodies
        if any_of(square < reach * reach):
            clearance = root(square) - bodies
            nearer = clearance < least
            least, who = where(nearer, clearance, least), where(nearer, others, who)
    scatter(state.clearance, i * groups + g, groups, least)
    scatter(state.clearance_body, i * groups + g, groups, who)
    if sampled:
        store(state.robot_distance_min, i, root(nearest))


@inlined
def _watch_one(i: int, g: int, plan: Plan, state: State, sampled: bool) -> None:
    """Clearances of one robot, which may have to look at all others."""
    q, lists = state.q, state.neighbors
    n, p = q.shape
    nearest = math.inf
    for c in range(number_of_candidates(i, n, lists)):
        j = candidate(i, c, lists)
        if j == i:
            continue
        square = 0.0
        for k in range(p):
            x = q[i, k] - q[j, k]
            square += x * x
        nearest = min(nearest, square)
        bodies = plan.watched_radius[i] + plan.watched_radius[j]
        _note(state.clearance[i], state.clearance_body[i], g, square, bodies, j)
    if sampled:
        state.robot_distance_min[i] = root(nearest)
