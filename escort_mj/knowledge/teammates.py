"""Where a robot knows its teammates to be: as it has heard, or as the team's sensors show them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated

from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import inlined

if TYPE_CHECKING:
    from escort_mj.memory.layout import Plan, State


class TeammateState(Fields):
    """The team as one robot knows it, scratch, and who has learned of teammates."""

    mate_position: Annotated[Array, "apart", "p", Value("m", "of each robot")]
    mate_unknown: Annotated[Array, "apart", Value("1", "1 for robots that it does not know of")]
    team_news: Annotated[Array, "apart", Value("1", "1 where a robot learned of teammates in this step")]


@inlined
def age_of(robot: int, slot: int, plan: Plan, state: State) -> float:
    """Return the age of what a robot has heard in a slot [s]; infinite where it has heard nothing."""
    if state.link_step[robot, slot] < 0.0:
        return math.inf
    return (state.step[0] - state.link_step[robot, slot]) * plan.timestep


@inlined
def place_of(robot: int, place: int, age: float, k: int, state: State) -> float:
    """Return where on axis k the teammate at a place of a robot's list is, moved on with its velocity [m]."""
    if state.link_from.shape[0] == 0:
        return state.q_measured[place, k]
    link = robot * state.link_from.shape[1] + place
    return state.heard_position[link, k] + age * state.heard_velocity[link, k]


@inlined
def places_of(state: State) -> int:
    """Return how many places a robot's list of teammates has: slots of the radio, or one for each robot."""
    return state.link_from.shape[1] if state.link_from.shape[0] > 0 else state.q.shape[0]


@inlined
def mate_at(robot: int, place: int, plan: Plan, state: State) -> tuple[int, float]:
    """Return which teammate a robot knows of at a place of its list, -1 for none, and the age of this [s].

    With a radio, these are the teammates that it has heard within the timeout; without one, all left of its
    team.
    """
    if state.link_from.shape[0] == 0:
        known = place != robot and state.lost[place] == 0.0
        if plan.team_radius.shape[0] > 0:
            known = known and state.member_of[place] == state.member_of[robot]
        return (place if known else -1), 0.0
    mate, age = int(state.link_from[robot, place]), age_of(robot, place, plan, state)
    if mate < 0 or age == math.inf or age > plan.radio_timeout or state.lost[mate] != 0.0:
        return -1, 0.0
    return mate, age


@inlined
def know_teammates(robot: int, plan: Plan, state: State) -> None:
    """Write where a robot knows itself and its teammates to be, by their numbers: `mate_...`."""
    n, p = state.q.shape
    for j in range(n):
        state.mate_unknown[j] = 1.0
    state.mate_unknown[robot] = state.lost[robot]
    for k in range(p):
        state.mate_position[robot, k] = state.q_measured[robot, k]
    for place in range(places_of(state)):
        j, age = mate_at(robot, place, plan, state)
        if j >= 0:
            state.mate_unknown[j] = 0.0
            for k in range(p):
                state.mate_position[j, k] = place_of(robot, place, age, k, state)
