"""Keep a formation: each robot has an offset in a frame that follows a path or the target and may turn."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from escort_mj.behaviors.goal import Headed, toward_goal
from escort_mj.behaviors.robots import Robots
from escort_mj.behaviors.task import Task
from escort_mj.components.facts import Facts, Misfit, one_each
from escort_mj.components.parameters import Distance, OfTime, Vector
from escort_mj.components.setup import MissionSetup
from escort_mj.components.waypoint import Waypoint
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.on_demand import on_demand, on_demand_unrolled
from escort_mj.native.vectors import (
    norm,
    numbers_at,
    numbers_from,
    quarter_turn,
    set_numbers,
    set_numbers_at,
    where,
)
from escort_mj.numerics.program import evaluate_program
from escort_mj.plan import Plan, State

ALONG = "along"  # in place of a heading
TURNED = 3  # functions of a frame beside its position: cosine and sine of its heading, and its scale
SLOWEST = 1e-9  # m/s; slower frames keep the heading that they had


class FormationParameters(Fields):
    """The frames, of each behavior `formation`."""

    formation_offsets: Annotated[Array, "placed", "p", Value("m", "of each robot; n for each behavior")]
    formation_frames: Annotated[
        Array, "framed", 2, Value("1", "first instruction and their number: position, cosine, sine, scale")
    ]
    formation_phase: Annotated[Array, "formations", Value("1", "phase that the behavior is of")]
    formation_along: Annotated[Array, "formations", Value("1", "1 where the frame heads along its way")]
    formation_follows: Annotated[Array, "formations", Value("1", "1 where the frame is the target's")]
    formation_reach: Annotated[
        Array, "formations", Value("m", "distance from its place up to which it is kept")
    ]
    formation_patience: Annotated[Array, "waiting", Value("m", "distance at which the frame waits; 0: never")]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        frames = setup.formations
        return {
            "formation_offsets": np.concatenate([np.zeros((0, setup.axes)), *(f.offsets for f in frames)]),
            "formation_phase": [phase for phase, _ in setup.numbered(Formation)],
            "formation_along": [frame.along for frame in frames],
            "formation_follows": [frame.follows for frame in frames],
            "formation_reach": [formation.reach for _, formation in setup.numbered(Formation)],
            "formation_patience": [formation.waits or 0.0 for formation in waiting(setup)],
        }


class FormationState(Fields):
    """Where the frames are, and how fast they move."""

    formation_frame: Annotated[Array, 2, "framed", Value("m or 1", "position, cosine, sine, scale; rates")]


class Formation(Headed):
    """Keep each robot at its offset in a frame that moves, turns and scales."""

    python_only: ClassVar[frozenset[str]] = frozenset(
        {"offsets", "position", "waypoints", "interpolation", "heading", "scale", "waits", "reach"}
    )

    behavior: Literal["formation"] = "formation"
    offsets: Annotated[tuple[Vector, ...], Field(min_length=1)]
    """Place of each robot in the frame [m]."""
    position: tuple[OfTime, ...] | None = None
    """Position of the frame per axis [m]: numbers, or expressions in t; null: see `waypoints`."""
    waypoints: Annotated[tuple[Waypoint, ...], Field(min_length=1)] | None = None
    """Timed waypoints of the frame; null: if `position` is null too, the frame moves with the target."""
    interpolation: Literal["linear", "smooth"] = "linear"
    """Motion between waypoints: `linear` at constant speed, or `smooth`, a cubic spline."""
    heading: OfTime | Literal["along"] = 0.0
    """Angle of the frame in the plane of the first two axes [rad]: a number, an expression in t, or `along`
    for the direction in which the frame moves."""
    scale: OfTime = 1.0
    """Factor by which the offsets are multiplied [1]: a number, or an expression in t."""
    waits: Distance | None = None
    """Distance from its place at which a robot makes the frame stand still until it comes nearer [m]: from
    `reach` on, the frame slows down in proportion; null: the frame does not wait."""

    def misfits(self, mission: Facts) -> Iterator[Misfit]:
        """Yield two ways or none by which the frame would move, and offsets that are not the robots'."""
        if self.position is not None and self.waypoints is not None:
            yield Misfit("found both position and waypoints; give one of them")
        if len(self.offsets) != mission.robots:
            yield one_each(len(self.offsets), mission.robots, "offsets")
        if self.waits is not None and self.waits <= self.reach:
            yield Misfit(f"found {self.waits:g} m; expected more than reach, {self.reach:g} m", "waits")
        if self.waits is not None and mission.known_by:
            words = (
                "waits for robots whose places are known to all; each robot knows only what it sees and hears"
            )
            yield Misfit(words, "waits", ((mission.known_by,),))
        if not self.follows:
            return
        if self.waits is not None:
            yield Misfit("goes with the target, which does not wait: give position or waypoints", "waits")
        if mission.teams:
            yield Misfit("follows one target; with teams, give position", "", (("teams",),))
        elif not mission.target:
            words = "found a formation that goes with the target; this mission has none: give position"
            yield Misfit(words, "", (("target",),))
        elif mission.known_by:
            words = "follows the target as one frame for all; each robot knows the target by itself"
            yield Misfit(f"{words}: give position, or use vertices", "", ((mission.known_by,),))

    def task(self, r: Robots) -> Task:
        """Return the task toward the robot's place in the frame."""
        return toward_goal(self.gain, r)

    @property
    def follows(self) -> bool:
        """Whether the frame goes with the target."""
        return self.position is None and self.waypoints is None


def waiting(setup: MissionSetup) -> list[Formation]:
    """Return all formations of a mission where one of them waits for its robots; none where none does."""
    formations = [formation for _, formation in setup.numbered(Formation)]
    return formations if any(formation.waits is not None for formation in formations) else []


@on_demand_unrolled
def place_formations(plan: Plan, state: State) -> None:
    """Writes where each robot of a formation is to be, and how fast that moves: `goal`, `goal_velocity`.

    Args:
        plan: Gives the frames.
        state: Gives time, phases and the measured target.
    """
    (n, p), values, rates = state.q.shape, state.formation_frame[0], state.formation_frame[1]
    for b in range(plan.formation_phase.shape[0]):
        row = b * (p + TURNED)
        _find_frame(b, row, plan, state)
        place, velocity, turn = numbers_from(state, values, row), numbers_from(state, rates, row), row + p
        cosine, sine, scale = values[turn], values[turn + 1], values[turn + 2]
        turning, rising, growing = rates[turn], rates[turn + 1], rates[turn + 2]
        pace = 1.0 if plan.formation_patience.shape[0] == 0 else _wait(b, plan, state)
        first = b == 0 and state.evaluated[0] == 0.0 and plan.goal_phase.shape[0] == 0
        for i in range(n):
            if state.phase[i] != plan.formation_phase[b] and not first:  # first: where it goes once it may
                continue
            offset = numbers_at(state, plan.formation_offsets, b * n + i)
            side = quarter_turn(offset)
            level = -quarter_turn(side)  # its part that turns
            turned = offset - level + cosine * level + sine * side
            set_numbers_at(state.goal, i, place + scale * turned)
            motion = velocity + growing * turned + scale * (turning * level + rising * side)
            set_numbers_at(state.goal_velocity, i, pace * motion)
            state.goals_left[i] = 0.0


@on_demand
def _wait(b: int, plan: Plan, state: State) -> float:
    """Return the share of its speed at which a frame goes on; its lag grows by what that falls short."""
    patience, reach, worst = plan.formation_patience[b], plan.formation_reach[b], 0.0
    if patience == 0.0:
        return 1.0
    for i in range(state.q.shape[0]):
        if state.phase[i] == plan.formation_phase[b] and state.lost[i] == 0.0:
            away = numbers_at(state, state.goal, i) - numbers_at(state, state.q_measured, i)
            worst = max(worst, norm(away))
    pace = min(max((patience - worst) / (patience - reach), 0.0), 1.0)
    if state.evaluated[0] == 0.0:  # no robot has been told of its place yet
        pace = 0.0
    state.formation_lag[b] += (1.0 - pace) * plan.timestep
    return pace


@on_demand
def _find_frame(b: int, row: int, plan: Plan, state: State) -> None:
    """Writes position, cosine, sine and scale of a frame, and their rates."""
    p, time = state.q.shape[1], state.time[0]
    if plan.formation_patience.shape[0] > 0:
        time -= state.formation_lag[b]
    values, rates = state.formation_frame[0], state.formation_frame[1]
    along, old_cosine, old_sine = plan.formation_along[b] != 0.0, values[row + p], values[row + p + 1]
    for k in range(p + TURNED):
        first, count = int(plan.formation_frames[row + k, 0]), int(plan.formation_frames[row + k, 1])
        values[row + k], rates[row + k] = evaluate_program(
            plan.code, first, count, plan.segments, time, state.operands
        )
    x, y, later_x, later_y = rates[row], rates[row + 1], 0.0, 0.0
    if plan.formation_follows[b] != 0.0:
        velocity = numbers_from(state, state.target_velocity_measured, 0)
        set_numbers(values, row, numbers_from(state, state.target_position_measured, 0))
        set_numbers(rates, row, where(plan.target_feedforward, velocity, 0.0))
        x, y = state.target_velocity_measured[0], state.target_velocity_measured[1]
    elif along:
        for k in range(2):
            first, count = int(plan.formation_frames[row + k, 0]), int(plan.formation_frames[row + k, 1])
            _, rate = evaluate_program(
                plan.code, first, count, plan.segments, time + plan.timestep, state.operands
            )
            later_x, later_y = (rate, later_y) if k == 0 else (later_x, rate)
    if not along:
        return
    speed, later = math.sqrt(x * x + y * y), math.sqrt(later_x * later_x + later_y * later_y)
    rates[row + p] = rates[row + p + 1] = 0.0
    if speed > SLOWEST:
        values[row + p], values[row + p + 1] = x / speed, y / speed
        if later > SLOWEST:
            rates[row + p] = (later_x / later - x / speed) / plan.timestep
            rates[row + p + 1] = (later_y / later - y / speed) / plan.timestep
    elif old_cosine != 0.0 or old_sine != 0.0:
        values[row + p], values[row + p + 1] = old_cosine, old_sine
