"""The supervisor (paper fig. 2): which behaviors rule each robot, in which order, by time and condition."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.behaviors import Behavior
from escort_mj.components.obstacles import obstacles_seen
from escort_mj.components.parameters import Parameters
from escort_mj.components.setup import MissionSetup
from escort_mj.knowledge.belief import target_place
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import inlined, merged
from escort_mj.native.on_demand import on_demand
from escort_mj.plan import Plan, State

Mask = NDArray[np.bool_]

QUANTITIES = (
    "obstacle_distance",
    "robot_distance",
    "target_distance",
    "target_obstacle_distance",
    "robots_lost",
)
OBSTACLE, ROBOT, TARGET, TARGET_OBSTACLE, LOST = 0.0, 1.0, 2.0, 3.0, 4.0

ALWAYS = -1.0  # quantity of a phase without a condition


class SupervisorParameters(Fields):
    """The phases of a mission, the first of them without a condition."""

    phase_first: Annotated[Array, "phases", Value("1", "first of its levels")]
    phase_levels: Annotated[Array, "phases", Value("1", "how many levels it has")]
    phase_after: Annotated[Array, "phases", Value("s", "not before this time")]
    phase_before: Annotated[Array, "phases", Value("s", "only before this time")]
    phase_quantity: Annotated[Array, "phases", Value("1", "place in QUANTITIES; -1 for no condition")]
    phase_below: Annotated[Array, "phases", Value("1", "1 where it begins below its threshold")]
    phase_threshold: Annotated[Array, "phases", Value("m or 1", "where it begins")]
    phase_release: Annotated[Array, "phases", Value("m or 1", "where it ends")]
    phase_team: Annotated[Array, "phases", Value("1", "1 where all robots change over together")]
    phase_members: Annotated[Array, "phases", Value("1", "team that it rules, from 1; 0 for all robots")]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        phases = [ControlPhase("", setup.behaviors), *setup.phases]
        conditions = [phase.when for phase in phases]
        return {
            "phase_first": np.cumsum([0, *(len(phase.behaviors) for phase in phases[:-1])]),
            "phase_levels": [len(phase.behaviors) for phase in phases],
            "phase_after": [phase.after for phase in phases],
            "phase_before": [phase.before for phase in phases],
            "phase_quantity": [QUANTITIES.index(when.quantity) if when else ALWAYS for when in conditions],
            "phase_below": [when is not None and when.below is not None for when in conditions],
            "phase_threshold": [when.threshold if when else 0.0 for when in conditions],
            "phase_release": [when.end if when else 0.0 for when in conditions],
            "phase_members": [phase.team for phase in phases],
            "phase_team": [when is not None and when.scope == "team" for when in conditions],
        }


class SupervisorState(Fields):
    """What hysteresis remembers."""

    latched: Annotated[Array, "n", "phases", Value("1", "1 while a phase's condition holds")]


class Condition(Parameters):
    """Condition for a phase, evaluated with the robots' measurements (`sensing`)."""

    quantity: Literal[QUANTITIES]  # type: ignore[valid-type]
    """Compared quantity: the distance from a robot to the nearest obstacle or to the nearest other robot,
    surface to surface [m]; the distance between the centers of the robot and the target [m]; the distance
    from the target's center to the surface of the nearest obstacle [m]; or the number of failed robots
    [1]."""
    below: float | None = None
    """The phase begins when the quantity falls below this value [m or 1]. Set `below` or `above`."""
    above: float | None = None
    """The phase begins when the quantity rises above this value [m or 1]."""
    release: float | None = None
    """The phase ends when the quantity passes this value on its way back [m or 1]; null: the threshold
    itself, without hysteresis."""
    scope: Literal["robot", "team"] = "robot"
    """Which robots change phase: the `robot` that meets the condition, or the whole `team` as soon as one
    robot does."""

    @property
    def threshold(self) -> float:
        """Where the phase begins [m]."""
        return self.below if self.below is not None else float(self.above or 0.0)

    @property
    def end(self) -> float:
        """Where the phase ends [m]."""
        return self.threshold if self.release is None else self.release


class ControlPhase(NamedTuple):
    """A stretch of the mission with a priority stack of its own.

    Attributes:
        name: For the trace.
        behaviors: By priority, the most important first.
        after: Not before this time [s].
        before: Only before this time [s]; inf for no end.
        when: Condition beside the time; None for none.
        team: Which team it rules, from 1; 0 for all robots.
    """

    name: str
    behaviors: tuple[Behavior, ...]
    after: float = 0.0
    before: float = math.inf
    when: Condition | None = None
    team: int = 0


@on_demand
def supervise(plan: Plan, state: State) -> None:
    """Chooses each robot's phase: the last one whose time and condition hold; phase 0 always does.

    Args:
        plan: Gives the phases.
        state: Gives time and measured positions; `phase` and `latched` are written.
    """
    n = state.q.shape[0]
    time = state.time[0] + 0.5 * plan.timestep  # times of the scenario are met to the nearest step
    for i in range(n):
        state.phase[i] = 0.0
    for f in range(1, plan.phase_first.shape[0]):
        in_time = plan.phase_after[f] <= time < plan.phase_before[f]
        always, someone = plan.phase_quantity[f] == ALWAYS, False
        for i in range(n):
            holds = in_time and _rules(i, f, plan, state) and (always or _holds(i, f, plan, state))
            state.latched[i, f] = 1.0 if holds else 0.0
            someone = someone or holds
        for i in range(n):
            if plan.phase_team[f] != 0.0 and someone and _rules(i, f, plan, state):
                state.latched[i, f] = 1.0
            if state.latched[i, f] != 0.0:
                state.phase[i] = float(f)


@inlined
def _rules(i: int, phase: int, plan: Plan, state: State) -> bool:
    """Whether a robot is in the team that a phase rules."""
    return plan.phase_members[phase] == 0.0 or plan.phase_members[phase] == state.member_of[i]


@merged
def _holds(i: int, phase: int, plan: Plan, state: State) -> bool:
    """Whether a robot meets a phase's condition; a phase that rules is left at its release only."""
    latched = state.latched[i, phase] != 0.0
    bound = plan.phase_release[phase] if latched else plan.phase_threshold[phase]
    value = _quantity(i, plan.phase_quantity[phase], plan, state)
    return value < bound if plan.phase_below[phase] != 0.0 else value > bound


@merged
def _quantity(i: int, quantity: float, plan: Plan, state: State) -> float:
    """What a condition looks at, for robot i [m or 1]; infinite where there is nothing to be near to."""
    q, p = state.q_measured, state.q.shape[1]
    if quantity == LOST:
        losses = 0.0
        for j in range(q.shape[0]):
            losses += state.lost[j]
        return losses
    if quantity == TARGET:
        square = 0.0
        for k in range(p):
            square += (q[i, k] - target_place(i, plan, state)[k]) ** 2
        return math.sqrt(square)
    nearest = math.inf
    if quantity == ROBOT:
        for j in range(q.shape[0]):
            square = 0.0
            for k in range(p):
                square += (q[i, k] - q[j, k]) ** 2
            if j != i:
                nearest = min(nearest, math.sqrt(square) - plan.robot_radius[i] - plan.robot_radius[j])
        return nearest if nearest <= plan.sensing_robots else math.inf
    of_target = quantity == TARGET_OBSTACLE
    seen, around = obstacles_seen(i, plan, state), obstacles_seen(q.shape[0], plan, state)
    for j in range(plan.obstacle_radius.shape[0]):
        square = of_target_square = 0.0
        for k in range(p):
            square += (q[i, k] - seen[j, k]) ** 2
            of_target_square += (target_place(i, plan, state)[k] - around[j, k]) ** 2
        gap = math.sqrt(square) - plan.robot_radius[i] - plan.seen_radius[j]
        if gap > plan.sensing_obstacles:
            continue
        if of_target:
            gap = math.sqrt(of_target_square) - plan.obstacle_radius[j]
        nearest = min(nearest, gap)
    return nearest
