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

    mate_position: Annotated[Array, "informed", "p", Value("m", "of each robot")]
    mate_unknown: Annotated[Array, "informed", Value("1", "1 for robots that it does not know of")]
    team_news: Annotated[Array, "informed", Value("1", "1 where a robot learned of teammates in this step")]


@inlined
def age_of(robot: int, slot: int, plan: Plan, state: State) -> float:
    """Return the age of what a robot has heard in a slot [s]; infinite where it has heard nothing."""
    if state.link_step[robot, slot] < 0.0:
        return math.inf
    return (state.step[0] - state.link_step[robot, slot]) * plan.timestep


@inlined
def place_of(robot: int, place: int, age: float, k: int, heard: bool, state: State) -> float:
    """Return where on axis k a teammate is: that of a slot as the robot has heard, or by its number [m]."""
    if not heard:
        return state.q_measured[place, k]
    link = robot * state.link_from.shape[1] + place
    return state.heard_position[link, k] + age * state.heard_velocity[link, k]


@inlined
def know_teammates(robot: int, plan: Plan, state: State) -> None:
    """Write where a robot knows its teammates to be: `mate_position`, `mate_unknown`.

    With a radio, these are the teammates that it has heard within the timeout, moved on with their
    velocities; without one, all that are left.
    """
    n, p, slots = state.q.shape[0], state.q.shape[1], state.link_from.shape[1]
    heard = state.link_from.shape[0] > 0
    for j in range(n):
        state.mate_unknown[j] = 1.0 if heard and j != robot else state.lost[j]
        for k in range(p):
            state.mate_position[j, k] = state.q_measured[j, k]
    if not heard:
        return
    for s in range(slots):
        j, age = int(state.link_from[robot, s]), age_of(robot, s, plan, state)
        if j >= 0 and age <= plan.radio_timeout and age < math.inf:
            state.mate_unknown[j] = state.lost[j]
            for k in range(p):
                state.mate_position[j, k] = place_of(robot, s, age, k, True, state)
