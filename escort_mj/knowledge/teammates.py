"""Where a robot knows its teammates to be: as it has heard, or as the team's sensors show them."""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.components.parameters import UNLIMITED
from escort_mj.components.setup import MissionSetup
from escort_mj.knowledge.links import radio_of
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import inlined
from escort_mj.native.lanes import (
    WIDTH,
    Lanes,
    copy_numbers,
    everywhere,
    lane_numbers,
    least,
    load,
    pick,
    there,
    where,
)
from escort_mj.native.on_demand import on_demand_unrolled
from escort_mj.native.vectors import (
    Vec,
    dot,
    norm,
    numbers_at,
    one_row,
    rows_at,
    rows_from,
    set_numbers_at,
    unit_of,
)
from escort_mj.plan import Plan, State

Mask = NDArray[np.bool_]


class TeammateParameters(Fields):
    """What bounds where teammates may be by now that have been heard a while ago."""

    mate_acceleration: Annotated[Array, "hearing", Value("m/s^2", "the most that each robot's motors give")]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        return {"mate_acceleration": setup.acceleration if setup.radio is not None else []}


class TeammateState(Fields):
    """The team as one robot knows it, scratch, and who has learned of teammates."""

    mate_position: Annotated[Array, "apart", "p", Value("m", "of each robot")]
    mate_unknown: Annotated[Array, "apart", Value("1", "1 for robots that it does not know of")]
    team_news: Annotated[Array, "apart", Value("1", "1 where a robot learned of teammates in this step")]
    heard_margin: Annotated[
        Array, "hearing", Value("m", "distance beyond the safe one to the nearest that is heard, scratch")
    ]
    heard_pace: Annotated[
        Array, "hearing", Value("m/s", "most by which a velocity that is heard differs from `v_d`, scratch")
    ]


@inlined
def age_of(robot: int, slot: int, plan: Plan, state: State) -> float:
    """Return the age of what a robot has heard in a slot [s]; infinite where it has heard nothing."""
    if state.link_step[robot, slot] < 0.0:
        return math.inf
    return (state.step[0] - state.link_step[robot, slot]) * plan.timestep


@inlined
def teammate_place(robot: int, place: int, age: float, state: State) -> Vec:
    """Return where the teammate at a place of a robot's list is, moved on with its velocity [m]."""
    if state.link_from.shape[0] == 0:
        return numbers_at(state, state.q_measured, place)
    link = robot * state.link_from.shape[1] + place
    return numbers_at(state, state.heard_position, link) + age * heard_velocity(robot, place, state)


@inlined
def heard_velocity(robot: int, place: int, state: State) -> Vec:
    """Return the velocity that the teammate at a place of a robot's list has sent [m/s]."""
    return numbers_at(state, state.heard_velocity, robot * state.link_from.shape[1] + place)


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
    mate, age = place, 0.0
    if state.link_from.shape[0] > 0:
        mate, age = heard_at(robot, place, plan, state)
    elif place == robot or state.lost[place] != 0.0:
        mate = -1
    if mate >= 0 and plan.team_radius.shape[0] > 0 and state.member_of[mate] != state.member_of[robot]:
        mate = -1
    return mate, age


@inlined
def heard_at(robot: int, place: int, plan: Plan, state: State) -> tuple[int, float]:
    """Return which robot, of any team, one has heard within the timeout in a slot; likewise."""
    mate, age = int(state.link_from[robot, place]), age_of(robot, place, plan, state)
    if mate < 0 or age == math.inf or age > radio_of(plan).timeout or state.lost[mate] != 0.0:
        return -1, 0.0
    return mate, age


class Mate(NamedTuple):
    """A teammate of each of robots i to i + 7, as the robot knows it.

    Attributes:
        known: For which robots there is one.
        position: Where it is [m].
        radius: Its radius [m].
        seen: Which robots know it because they hear it, or because it is within the range of their sensors.
    """

    known: Any
    position: Vec
    radius: Lanes
    seen: Any


@inlined
def mate_of(i: int, place: int, plan: Plan, state: State) -> Mate:
    """Return the teammate at a place of the list of each of robots i to i + 7; as `mate_at`."""
    n = state.q.shape[0]
    known, number = there(n - i), everywhere(float(place))
    if state.link_from.shape[0] > 0:
        slots = state.link_from.shape[1]
        robot = least(lane_numbers() + float(i), float(n - 1))
        link = robot * float(slots) + float(place)
        number, step = pick(state.link_from, link), pick(state.link_step, link)
        age = (state.step[0] - step) * plan.timestep
        known = known & (number > -0.5) & (step > -0.5) & (age <= radio_of(plan).timeout)
        number = where(known, number, 0.0)
        known = known & (pick(state.lost, number) < 0.5) & _of_one_team(i, number, plan, state)
        position = rows_from(state, state.heard_position, link)
        position = position + where(known, age, 0.0) * rows_from(state, state.heard_velocity, link)
        return Mate(known, position, pick(plan.robot_radius, number), known)
    known = known & (abs(lane_numbers() + float(i - place)) > 0.5) & (everywhere(state.lost[place]) < 0.5)
    known = known & _of_one_team(i, number, plan, state)
    position, radius = one_row(state, state.q_measured[place]), everywhere(plan.robot_radius[place])
    seen = known
    if plan.sensing_robots < UNLIMITED:
        gap = norm(rows_at(state, state.q_measured, i) - position) - (load(plan.robot_radius, i) + radius)
        seen = known & (gap <= plan.sensing_robots)
    return Mate(known, position, radius, seen)


@inlined
def _of_one_team(i: int, number: Lanes, plan: Plan, state: State) -> Any:
    """Which of robots i to i + 7 are of the team of another one each, by its number."""
    if plan.team_radius.shape[0] == 0:
        return number > -1.0
    return abs(pick(state.member_of, number) - load(state.member_of, i)) < 0.5


@inlined
def know_teammates(robot: int, plan: Plan, state: State) -> None:
    """Write where a robot knows itself and its teammates to be, by their numbers: `mate_...`."""
    n, p = state.q.shape
    for j in range(n):
        state.mate_unknown[j] = 1.0
    state.mate_unknown[robot] = state.lost[robot]
    copy_numbers(state.q_measured[robot], state.mate_position[robot], p)
    for place in range(places_of(state)):
        j, age = mate_at(robot, place, plan, state)
        if j >= 0:
            state.mate_unknown[j] = 0.0
            set_numbers_at(state.mate_position, j, teammate_place(robot, place, age, state))


@inlined
def may_be(
    robot: int, place: int, to_surface: float, plan: Plan, state: State
) -> tuple[int, float, float, Vec]:  # fmt: skip
    """Find how near a teammate may be by now that a robot has heard: it is in a ball that grows with age.

    Since it spoke, the velocity u that it sent has changed by at most a t, where a is what its motors give.
    It is no faster than V, the speed limit or |u| if that is more. So u carries the center of the ball while
    a t < V, and the radius grows by a t; later the center rests, and the radius grows by V. Forces hold for
    a timestep each, which adds half of one to the time in which they act.

    Args:
        robot: From 0.
        place: Of the teammate in the robot's list.
        to_surface: 1 if distances are measured between surfaces, 0 between centers.
        plan: Gives the limits.
        state: Gives what has been heard.

    Returns:
        Which teammate, -1 for none, the distance to the center of the ball, what part of this is ball and
        bodies [m], and the unit vector away from the center; the first axis at it.
    """
    mate, age = heard_at(robot, place, plan, state)
    q = numbers_at(state, state.q_measured, robot)
    if mate < 0:
        return mate, 0.0, 0.0, q
    fastest = max(plan.max_speed, norm(heard_velocity(robot, place, state)))
    acceleration = plan.mate_acceleration[mate]
    carried = min(age, fastest / acceleration)
    ball = 0.5 * acceleration * carried * (carried + plan.timestep) + fastest * (age - carried)
    away, distance = unit_of(q - teammate_place(robot, place, carried, state))
    return mate, distance, to_surface * (plan.robot_radius[robot] + plan.robot_radius[mate]) + ball, away


@on_demand_unrolled
def find_nearest_heard(i: int, safe: float, to_surface: float, plan: Plan, state: State) -> None:
    """Write how near a teammate may be by now that robots i to i + 7 have heard, and the ways away from it.

    Args:
        i: First robot, from 0.
        safe: Distance that robots keep [m].
        to_surface: 1 if distances are measured between surfaces, 0 between centers.
        plan: Gives the limits of teammates.
        state: `heard_margin`, `heard_pace` and `wished_direction`, unit vectors, are written.
    """
    for robot in range(i, min(i + WIDTH, state.q.shape[0])):
        state.heard_margin[robot], square = UNLIMITED, 0.0
        for place in range(places_of(state)):
            mate, distance, covered, away = may_be(robot, place, to_surface, plan, state)
            margin = distance - (safe + covered)
            if mate < 0:
                continue
            apart = heard_velocity(robot, place, state) - numbers_at(state, state.v_d, robot)
            square = max(square, dot(apart, apart))
            if margin < state.heard_margin[robot]:
                state.heard_margin[robot] = margin
                set_numbers_at(state.wished_direction, robot, away)
        state.heard_pace[robot] = math.sqrt(square)
