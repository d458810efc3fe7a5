"""Opponents: which come, are intercepted or reach the target, and which robot guards against which."""

from __future__ import annotations

import math
from typing import Annotated, Any

from escort_mj.components.movers import COMES, INTERCEPTED, REACHED, WAITS
from escort_mj.components.setup import MissionSetup
from escort_mj.components.teams import team_of
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import inlined
from escort_mj.native.lanes import copy_numbers
from escort_mj.native.on_demand import on_demand_in_space
from escort_mj.native.vectors import Vec, norm, numbers_at, numbers_from, set_numbers_at
from escort_mj.plan import Plan, State

NOT_ONE = -1.0  # of the opponents
KEPT = 0.8  # of the distance: what another robot has to beat to take over a threat
NEAR = 1e-9  # m
ARRIVAL = 2.0  # 1/s, gain of the distance from the start


class OpponentParameters(Fields):
    """Opponents, in the order in which a trace numbers them."""

    opponent_obstacle: Annotated[Array, "opponents", Value("1", "which obstacle each is, from 0")]
    opponent_start: Annotated[Array, "opponents", Value("s", "when it comes")]
    opponent_capture: Annotated[Array, "opponents", Value("m", "gap to a robot that intercepts it")]
    opponent_reach: Annotated[Array, "opponents", Value("m", "gap to the target that it has reached")]
    mover_opponent: Annotated[Array, "movers", Value("1", "which opponent it is, from 0; -1 for none")]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        places = [*setup.opponent_places]
        each = [(group, number) for group in setup.opponents for number in range(group.count)]
        movers = [mover.obstacle for mover in setup.movers]
        return {
            "opponent_obstacle": places,
            "opponent_start": [group.start + number * group.interval for group, number in each],
            "opponent_capture": [group.capture_distance for group, _ in each],
            "opponent_reach": [group.reach_distance for group, _ in each],
            "mover_opponent": [places.index(mover) if mover in places else NOT_ONE for mover in movers],
        }


class OpponentState(Fields):
    """What robots guard against."""

    threat_position: Annotated[
        Array, "guarding", "p", Value("m", "of the opponent that a robot guards against")
    ]
    threat_velocity: Annotated[Array, "guarding", "p", Value("m/s", "likewise")]


@on_demand_in_space
def judge_opponents(plan: Plan, state: State) -> None:
    """Lets opponents come when it is time, and sees which are intercepted or have reached the target.

    Args:
        plan: Gives the rules.
        state: Gives true positions; `opponent_status` and `interceptor` are written.
    """
    for o in range(plan.opponent_obstacle.shape[0]):
        j = int(plan.opponent_obstacle[o])
        if state.opponent_status[o] == WAITS and state.time[0] >= plan.opponent_start[o]:
            state.opponent_status[o] = COMES
        if state.opponent_status[o] != COMES:
            continue
        here, size = numbers_at(state, state.obstacle_position, j), plan.obstacle_radius[j]
        for i in range(state.q.shape[0]):
            gap = norm(numbers_at(state, state.q, i) - here) - plan.robot_radius[i] - size
            if gap <= plan.opponent_capture[o] and state.lost[i] == 0.0:
                state.opponent_status[o], state.interceptor[o] = INTERCEPTED, i + 1.0
                break
        gap = norm(numbers_from(state, state.target_position, 0) - here) - plan.target_radius - size
        if plan.team_radius.shape[0] > 0:
            nearest = int(plan.target_obstacle[nearest_target(here, plan, state)])
            gap = norm(numbers_at(state, state.obstacle_position, nearest) - here)
            gap = gap - plan.obstacle_radius[nearest] - size
        if state.opponent_status[o] == COMES and gap <= plan.opponent_reach[o]:
            state.opponent_status[o] = REACHED


@inlined
def nearest_target(here: Vec, plan: Plan, state: State) -> int:
    """Return which of the targets that teams escort is nearest to a point."""
    found, least = 0, math.inf
    for place in range(plan.target_obstacle.shape[0]):
        j = int(plan.target_obstacle[place])
        distance = norm(numbers_at(state, state.obstacle_position, j) - here)
        if distance < least and team_of(place, plan, state) > 0:
            found, least = place, distance
    return found


@inlined
def aim(b: int, plan: Plan, state: State) -> None:
    """Let what a body with a policy sees as the target be the nearest of the teams' targets."""
    here, p = numbers_at(state, state.mover_position, b), state.q.shape[1]
    j = int(plan.target_obstacle[nearest_target(here, plan, state)])
    copy_numbers(state.obstacle_position[j], state.target_position, p)
    copy_numbers(state.obstacle_velocity[j], state.target_velocity, p)


@on_demand_in_space
def turn_back(b: int, plan: Plan, state: State) -> None:
    """Lets an opponent that does not come yet, or no longer, be at its start or go there.

    Args:
        b: Which body with a drive it is.
        plan: Says where it starts, and how fast it is.
        state: `mover_wish` is written: the body slows down where it arrives.
    """
    way = numbers_at(state, plan.mover_start, b) - numbers_at(state, state.mover_position, b)
    share = min(plan.mover_speed[b], ARRIVAL * norm(way)) / max(norm(way), NEAR)
    set_numbers_at(state.mover_wish, b, share * way)


@on_demand_in_space
def assign_guards(plan: Plan, state: State) -> None:
    """Gives each opponent that comes a robot: the most urgent one first, the nearest robot to its way.

    Urgent is what can reach the target soonest, as fast as it moves now. How far a robot is from an
    opponent's way is measured at the mission's radius, or at the opponent where that is nearer to the
    target. A robot keeps its opponent unless another one is nearer by a fifth. With teams, the team of the
    nearest target guards, and the middle of its targets is the target.

    Args:
        plan: Gives the opponents.
        state: Gives measured positions; `threat`, `threat_position` and `threat_velocity` are written.
    """
    n, p = state.q.shape
    count = plan.opponent_obstacle.shape[0]
    for i in range(n):
        state.threat[i] = -state.threat[i]  # negative: what it was
    done = 0.0  # time to reach the target up to which opponents have been seen to
    last = -1
    for _ in range(min(n, count)):
        soonest, urgent = math.inf, -1
        for o in range(count):
            time = _time_to_reach(o, plan, state)
            later = time > done or (time == done and o > last)
            if state.opponent_status[o] == COMES and later and time < soonest:
                soonest, urgent = time, o
        if urgent < 0:
            break
        done, last = soonest, urgent
        j, nearest, least = int(plan.opponent_obstacle[urgent]), -1, math.inf
        team, radius = threatened(j, plan, state), plan.radius
        if team > 0:
            radius = state.team_radius[team - 1]
        center = middle_of(team, state)
        way = numbers_at(state, state.obstacle_position, j) - center
        point = center + (min(radius, norm(way)) / max(norm(way), NEAR)) * way
        for i in range(n):
            if state.threat[i] > 0.0 or state.lost[i] != 0.0:
                continue
            if team > 0 and state.member_of[i] != team:
                continue
            distance = norm(point - numbers_at(state, state.q_measured, i))
            distance = distance * (KEPT if state.threat[i] == -(urgent + 1.0) else 1.0)
            if distance < least:
                nearest, least = i, distance
        if nearest >= 0:
            state.threat[nearest] = urgent + 1.0
    for i in range(n):
        state.threat[i] = max(state.threat[i], 0.0)
        if state.threat[i] > 0.0:
            j = int(plan.opponent_obstacle[int(state.threat[i]) - 1])
            copy_numbers(state.obstacle_position[j], state.threat_position[i], p)
            copy_numbers(state.obstacle_velocity[j], state.threat_velocity[i], p)


@inlined
def _time_to_reach(o: int, plan: Plan, state: State) -> float:
    """How soon an opponent can be at the target [s], at its present speed."""
    j = int(plan.opponent_obstacle[o])
    way = numbers_at(state, state.obstacle_position, j) - middle_of(threatened(j, plan, state), state)
    soonest: float = norm(way) / max(norm(numbers_at(state, state.obstacle_velocity, j)), 0.1)
    return soonest


@inlined
def threatened(j: int, plan: Plan, state: State) -> int:
    """Return the team, from 1, whose target is nearest to an obstacle; 0 where all are one team."""
    if plan.team_radius.shape[0] == 0:
        return 0
    return team_of(nearest_target(numbers_at(state, state.obstacle_position, j), plan, state), plan, state)


@inlined
def middle_of(team: int, state: State) -> Vec:
    """Return the middle of the targets of a team, from 1, or the target where all are one team [m]."""
    if team > 0:
        return numbers_at(state, state.team_center, team - 1)
    return numbers_from(state, state.target_position_measured, 0)
