"""Robots in teams: which targets each team has, where they are, and who changes over to which team.

A team demands a number of robots, which may depend on time. One that has too few, because of a loss or a new
demand, gets the robot nearest to its targets of those that other teams can spare: a team spares robots
beyond its own demand, and keeps one at least. Earlier teams come first.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from escort_mj.components.teams import team_of
from escort_mj.control.inner import change_law
from escort_mj.native.kernels import inlined
from escort_mj.native.on_demand import on_demand_in_space
from escort_mj.native.vectors import dot, numbers_at, set_numbers_at, zero_like
from escort_mj.numerics.reform import reform
from escort_mj.plan import Plan, State

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@on_demand_in_space
def form_teams(plan: Plan, state: State) -> None:
    """Finds which targets teams have, and where, and moves robots from one team to another.

    Args:
        plan: Gives teams, their targets and demands.
        state: Gives time, obstacles and measured positions; who is in which team is written, and so are
            `vertices` and `rotation` of teams that changed.
    """
    n, teams, step = state.q.shape[0], plan.team_radius.shape[0], state.step[0]
    first = state.evaluated[0] == 0.0
    for t in range(teams):
        state.team_left[t], state.team_radius[t] = 0.0, _radius(t, plan, state)
        if first:
            state.team_formed[t] = state.team_aimed[t] = -1.0
    _find_targets(first, plan, state)
    for i in range(n):
        state.told[i] = 0.0
        if first:
            state.member_of[i] = plan.team_start[i]
        t = int(state.member_of[i]) - 1
        if state.lost[i] == 0.0:
            state.team_left[t] += 1.0
        elif state.missed[i] == 0.0:
            state.missed[i], state.team_formed[t] = 1.0, step
    for t in range(teams):
        while state.team_left[t] < _demand(t, plan, state):
            i = _spare(t, plan, state)
            if i < 0:
                break
            other = int(state.member_of[i]) - 1
            state.team_left[other] -= 1.0
            state.team_left[t] += 1.0
            state.team_formed[other] = state.team_formed[t] = step
            state.member_of[i], state.told[i] = t + 1.0, 1.0
            change_law(i, t, plan, state)
    for i in range(n):
        t = int(state.member_of[i]) - 1
        state.own_radius[i] = state.team_radius[t]
        if state.team_aimed[t] == step:
            state.told[i] = 1.0
        state.team_news[i] = 1.0
    if plan.figures.shape[0] > 0:
        for t in range(teams):
            if state.team_formed[t] == step and state.team_left[t] > 0.0:
                _close_ranks(t, plan, state)


@inlined
def _find_targets(first: bool, plan: Plan, state: State) -> None:
    """Write which targets each team has, and their middle and mean velocity."""
    targets = plan.target_team.shape[0]
    for target in range(targets):
        j, team = int(plan.target_obstacle[target]), team_of(target, plan, state)
        before = int(state.obstacle_team[j])
        if team != before and not first:
            if team > 0:
                state.team_aimed[team - 1] = state.step[0]
            if before > 0:
                state.team_aimed[before - 1] = state.step[0]
        state.obstacle_team[j] = team
    for t in range(plan.team_radius.shape[0]):
        number, center = 0.0, zero_like(numbers_at(state, state.team_center, t))
        velocity = center
        for target in range(targets):
            j = int(plan.target_obstacle[target])
            if state.obstacle_team[j] == t + 1.0:
                number += 1.0
                center = center + numbers_at(state, state.obstacle_position, j)
                velocity = velocity + numbers_at(state, state.obstacle_velocity, j)
        set_numbers_at(state.team_center, t, center / number)
        set_numbers_at(state.team_velocity, t, velocity / number)


@inlined
def _radius(t: int, plan: Plan, state: State) -> float:
    """Return the distance that a team keeps now [m]."""
    time, found = state.time[0] + 0.5 * plan.timestep, plan.team_radius[t]
    for c in range(plan.circle_team.shape[0]):
        if plan.circle_team[c] == t + 1.0 and plan.circle_after[c] <= time:
            found = plan.circle_radius[c]
    return found


@inlined
def _demand(t: int, plan: Plan, state: State) -> float:
    """Return how many robots a team needs now."""
    time, found = state.time[0] + 0.5 * plan.timestep, 0.0
    for d in range(plan.demand_team.shape[0]):
        if plan.demand_team[d] == t + 1.0 and plan.demand_after[d] <= time:
            found = plan.demand_robots[d]
    return found


@inlined
def _spare(t: int, plan: Plan, state: State) -> int:
    """Return the robot nearest to a team's targets that another team can spare; -1 where there is none."""
    nearest, least = -1, math.inf
    for i in range(state.q.shape[0]):
        other = int(state.member_of[i]) - 1
        if other == t or state.lost[i] != 0.0:
            continue
        if state.team_left[other] <= max(_demand(other, plan, state), 1.0):
            continue
        way = numbers_at(state, state.q_measured, i) - numbers_at(state, state.team_center, t)
        square = dot(way, way)
        if square < least:
            nearest, least = i, square
    return nearest


@inlined
def _close_ranks(t: int, plan: Plan, state: State) -> None:
    """Give the members of a team that are left places in their even figure."""
    (n, p), one = state.q.shape, -1
    for i in range(n):
        member = state.member_of[i] == t + 1.0 and state.lost[i] == 0.0
        state.mate_unknown[i] = 0.0 if member else 1.0
        if member and one < 0:
            one = i
    reform(
        state.q_measured, state.team_center[t], state.mate_unknown, plan.figures, plan.turns,
        state.rotation[one], state.mate_position, state.scratch,
    )  # fmt: skip
    for i in range(n):
        if state.mate_unknown[i] == 0.0:
            for a in range(p):
                state.vertices[i, a] = state.mate_position[i, a]
                for b in range(p):
                    state.rotation[i, a, b] = 1.0 if a == b else 0.0
