"""Go to a goal: each robot has its own point, or waypoints that it passes one after another."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Discriminator, Field, PositiveFloat, Tag

from escort_mj.behaviors.behavior import Behavior
from escort_mj.behaviors.robots import Robots
from escort_mj.behaviors.task import Task, move
from escort_mj.components.facts import Facts, Misfit, one_each
from escort_mj.components.parameters import Distance, Vector
from escort_mj.components.random_placement import RandomPlacement
from escort_mj.components.setup import MissionSetup
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import inlined
from escort_mj.native.lanes import copy_numbers, everywhere
from escort_mj.native.on_demand import on_demand_unrolled
from escort_mj.native.vectors import dot, norm, numbers_at, where
from escort_mj.plan import Plan, State

POINT, WAYPOINTS, LISTED, NAMED, DRAWN = "a point", "waypoints", "listed", "named", "drawn"


def _one_or_several(value: Any) -> str | None:
    """Tells a point from a list of waypoints."""
    if not isinstance(value, list | tuple) or not len(value):
        return None
    return WAYPOINTS if isinstance(value[0], list | tuple) else POINT


def _way_to_say(value: Any) -> str | None:
    """Tells how goals are given."""
    kinds: dict[str, Any] = {LISTED: (list, tuple), NAMED: str, DRAWN: (dict, RandomPlacement)}
    return next((kind for kind, types in kinds.items() if isinstance(value, types)), None)


Entry = Annotated[
    Annotated[Vector, Tag(POINT)] | Annotated[tuple[Vector, ...], Field(max_length=1000), Tag(WAYPOINTS)],
    Discriminator(
        _one_or_several, custom_error_type="goal", custom_error_message="a point or a list of waypoints"
    ),
]
Goals = Annotated[
    Annotated[tuple[Entry, ...], Field(min_length=1), Tag(LISTED)]
    | Annotated[Literal["opposite"], Tag(NAMED)]
    | Annotated[RandomPlacement, Tag(DRAWN)],
    Discriminator(
        _way_to_say,
        custom_error_type="goals",
        custom_error_message="one goal for each robot, opposite, or a table with within",
    ),
]


class GoalParameters(Fields):
    """The waypoints of all robots, of each behavior `goal` one behind the other."""

    goal_points: Annotated[Array, "waypoints", "p", Value("m", "those of one robot behind each other")]
    goal_first: Annotated[Array, "goals", Value("1", "row of a robot's first; n for each behavior")]
    goal_count: Annotated[Array, "goals", Value("1", "how many it has")]
    goal_reach: Annotated[Array, "goal_stacks", Value("m", "distance at which a waypoint is passed")]
    goal_phase: Annotated[Array, "goal_stacks", Value("1", "phase that the behavior is of")]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        lists = [points for goals in setup.goals for points in goals]
        counts = [len(points) for points in lists]
        stacks = setup.numbered(Goal)
        return {
            "goal_points": np.concatenate([np.zeros((0, setup.axes)), *lists]),
            "goal_first": np.cumsum([0, *counts])[:-1],
            "goal_count": counts,
            "goal_reach": [goal.reach for _, goal in stacks],
            "goal_phase": [phase for phase, _ in stacks],
        }


class GoalState(Fields):
    """How far along its waypoints each robot is."""

    goal_at: Annotated[Array, "goals", Value("1", "waypoint that it goes to, from 0")]
    goal_velocity: Annotated[Array, "headed", "p", Value("m/s", "how fast the point that it goes to moves")]


@inlined
def toward_goal(gain: float, r: Robots) -> Task:
    """Return the task sigma = q, which is to become the goal: it takes all directions."""
    way = where(r.there, r.goal - r.q, 0.0)
    velocity = where(r.there, gain * way + r.goal_velocity, 0.0)
    return move(velocity, everywhere(1.0), norm(way))


class Headed(Behavior):
    """Base of behaviors that say where each robot is to be."""

    frame: ClassVar[Literal["target", "world"]] = "world"

    gain: PositiveFloat = 0.8
    """Gain of the distance to the goal [1/s]."""
    reach: Distance = 0.1
    """Distance within which a robot has reached its goal, or passed a waypoint on the way there [m]."""

    @property
    def arrives_within(self) -> float:
        """Distance within which a robot is where it is sent [m]."""
        return self.reach


class Goal(Headed):
    """Send each robot to its own goal, directly or along waypoints."""

    python_only: ClassVar[frozenset[str]] = frozenset({"goals", "reach"})

    behavior: Literal["goal"] = "goal"
    goals: Goals
    """One entry per robot, a point or a list of waypoints [m]; `opposite`: each robot's start, mirrored
    through the mean of all starts; a table: random points in a ball, drawn like `robots.placement`."""

    def misfits(self, mission: Facts) -> Iterator[Misfit]:
        """Yield goals that are not the robots'."""
        if isinstance(self.goals, tuple) and len(self.goals) != mission.robots:
            yield one_each(len(self.goals), mission.robots, "goals")

    def task(self, r: Robots) -> Task:
        """Return the task toward the goal."""
        return toward_goal(self.gain, r)


@on_demand_unrolled
def choose_goals(plan: Plan, state: State) -> None:
    """Writes the point that each robot goes to: `goal` and `goals_left`. Call it once per step.

    Args:
        plan: Gives the waypoints, and which phase they are of.
        state: `goal_at` moves on where a robot has come to its waypoint.
    """
    n = state.q.shape[0]
    for b in range(plan.goal_phase.shape[0]):
        for i in range(n):
            row = b * n + i
            if state.phase[i] != plan.goal_phase[b]:
                if b == 0 and state.evaluated[0] == 0.0:  # where it goes once a phase lets it
                    _go(i, row, plan, state)
                continue
            last = plan.goal_count[row] - 1.0
            state.goal_at[row] = min(state.goal_at[row], last)  # fewer may be left after a change
            at = int(plan.goal_first[row] + state.goal_at[row])
            way = numbers_at(state, plan.goal_points, at) - numbers_at(state, state.q_measured, i)
            if dot(way, way) <= plan.goal_reach[b] * plan.goal_reach[b] and state.goal_at[row] < last:
                state.goal_at[row] += 1.0
            _go(i, row, plan, state)


@inlined
def _go(i: int, row: int, plan: Plan, state: State) -> None:
    """Sends a robot to its present waypoint, of those in a row."""
    at = int(plan.goal_first[row] + state.goal_at[row])
    copy_numbers(plan.goal_points[at], state.goal[i], state.q.shape[1])
    state.goals_left[i] = plan.goal_count[row] - 1.0 - state.goal_at[row]
