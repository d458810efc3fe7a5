"""How components of each kind are tried: the missions that they take part in, and what only they see."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from pydantic import ValidationError

from escort_mj.behaviors.behavior import Behavior
from escort_mj.components.component import Component
from escort_mj.control.outer_loops import OuterLoop
from escort_mj.disturbances import Disturbance
from escort_mj.estimators import Estimator
from escort_mj.failures import Failure
from escort_mj.laws.law import Law
from escort_mj.memory.layout import State
from escort_mj.policies import Policy
from escort_mj.radios import Radio
from escort_mj.robots import RobotKind
from escort_mj.rules import Rule
from escort_mj.scenario.kinds import kind_of
from escort_mj.scenario.reader.plugin_shape import required_parameters
from escort_mj.sensors import Sensor

QUESTIONS = 2  # that radios and sensors are asked
IN_SPACE = 3  # axes
HEARING = 0.5  # share of the draws in which a robot hears a message


class Part(NamedTuple):
    """A component that takes part in a mission; see `table_with`."""

    member: Any
    own: dict[str, Any]
    axes: int
    measures: Sequence[str]


def _among_robots(state: State) -> int:
    return len(state.q)


def _draw_nothing(state: State, random: np.random.Generator, scale: float) -> None:
    """What all components see is drawn already."""


class Trial(NamedTuple):
    """How components of a kind are tried.

    Attributes:
        tables: Return tables of a scenario in which one takes part.
        required: Keys that its own table has to have beside its name.
        draw: Draw what only this kind sees: `(state, random, scale)`.
        numbers: Return for how many robots, bodies or questions it can be called.
        keeps_outputs: Whether it changes what it writes instead of writing all of it.
    """

    tables: Callable[[Part], dict[str, Any]]
    required: Mapping[str, Any] = {}
    draw: Callable[[State, np.random.Generator, float], None] = _draw_nothing
    numbers: Callable[[State], int] = _among_robots
    keeps_outputs: bool = False


def _estimating(part: Part) -> dict[str, Any]:
    """Robots with an estimator measure with errors, and some messages are lost."""
    measures = part.measures or part.member.needs[0]
    noise = dict.fromkeys(measures, 0.05)
    sight = {"robots": (1,), "measures": tuple(measures), "noise": noise}
    return {
        "knowledge": {"estimator": part.own, "target": sight, "initial": {"position": 0.5}},
        "communication": {"rate": 50.0, "delay": 0.04, "loss": 0.2},
    }


def _with_opponents(part: Part) -> dict[str, Any]:
    """A stack of one behavior, and, in as many axes as they can move in, somebody to guard against."""
    threats = ({"policy": {"policy": "straight"}},) if part.axes <= IN_SPACE else ()
    return {"mission": {"behaviors": (part.own,)}, "opponents": threats}


def _ruled(part: Part) -> dict[str, Any]:
    phase = {"behaviors": ("surface",), "when": part.own}
    return {"mission": {"behaviors": ("surface",), "supervisor": (phase,)}}


def _draw_beliefs(state: State, random: np.random.Generator, scale: float) -> None:
    """Draw what robots believe, see and hear: one of the messages, or none."""
    rows = len(state.sent_belief)
    for name in ("belief", "sent_belief", "seen_position", "seen_velocity", "seen_bearing"):
        getattr(state, name)[:] = random.standard_normal(getattr(state, name).shape)
    state.seen_range[:] = random.uniform(0.5, 5.0, state.seen_range.shape)
    state.seen_bearing /= np.linalg.norm(state.seen_bearing, axis=1, keepdims=True)
    for times in (state.belief_time, state.belief_fix, state.sent_belief_time, state.sent_fix):
        times[:] = state.time[0] - random.uniform(0.0, 1.0, times.shape)
    for rows_of in (state.belief_covariance, state.sent_covariance):
        for row in rows_of:
            root = random.standard_normal((state.belief.shape[1],) * 2)
            row[:] = (root @ root.T + 0.1 * np.eye(len(root))).ravel()
    state.message[0] = random.integers(-1, rows) if random.random() < HEARING else -1.0


def _draw_places(state: State, random: np.random.Generator, scale: float) -> None:
    """Draw where behaviors that ship send robots: to vertices beside them, and to opponents that threaten."""
    way = state.q_measured - state.target_position_measured
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    state.rotation[:] = np.eye(way.shape[1])
    state.vertices[:] = (way + 0.2 * random.standard_normal(way.shape))[: len(state.vertices)]
    for values in (state.threat_position, state.threat_velocity):
        values[:] = random.standard_normal(values.shape)
    state.threat[:] = random.integers(0, 2, state.threat.shape)


def _draw_message(state: State, random: np.random.Generator, scale: float) -> None:
    """Draw a message of a robot to another."""
    state.message_sender[0], state.message_receiver[0] = random.integers(0, len(state.q), 2)
    state.message_number[0], state.message_distance[0] = random.integers(0, 1000), random.random()
    state.message_draws[:] = random.random(2)
    state.link_memory[:] = random.integers(0, 2, len(state.link_memory))


def _draw_motors(state: State, random: np.random.Generator, scale: float) -> None:
    """Draw what motors that fail are told and gave."""
    for values in (state.failure_age, state.failure_draw, state.tau, state.force_before):
        values[:] = random.uniform(-1.0, 1.0, values.shape)


def _draw_truth(state: State, random: np.random.Generator, scale: float) -> None:
    """Draw what is measured."""
    for name in ("sensor_truth", "sensor_normals", "sensor_memory"):
        getattr(state, name)[:] = scale * random.standard_normal(getattr(state, name).shape)
    state.sensor_draw[:] = random.random(state.sensor_draw.shape)


TRIALS: dict[type[Any], Trial] = {
    Law: Trial(lambda part: {"controller": part.own}),
    Behavior: Trial(
        _with_opponents,
        draw=_draw_places,
        numbers=lambda state: 1,
    ),
    OuterLoop: Trial(lambda part: {"mission": {"outer": part.own}}),
    Policy: Trial(
        lambda part: {"target": {"position": (0.0,) * part.axes, "policy": part.own}},
        numbers=lambda state: len(state.mover_position),
    ),
    Estimator: Trial(_estimating, draw=_draw_beliefs, keeps_outputs=True),
    Radio: Trial(
        lambda part: {"knowledge": {"target": {"robots": (1,)}}, "communication": part.own},
        draw=_draw_message,
        numbers=lambda state: QUESTIONS,
    ),
    Disturbance: Trial(lambda part: {"uncertainty": {"disturbances": (part.own,)}}),
    Sensor: Trial(
        lambda part: {"sensing": dict.fromkeys(part.member.measures, part.own)},
        draw=_draw_truth,
        numbers=lambda state: QUESTIONS,
    ),
    Failure: Trial(
        lambda part: {"robots": {"failures": (part.own,)}, "mission": {"behaviors": ("surface",)}},
        required={"robot": 1, "at": 0.5},
        draw=_draw_motors,
    ),
    Rule: Trial(_ruled, required={"below": 1.0}, numbers=lambda state: 1),
    RobotKind: Trial(lambda part: {"robots": {**part.own, "force_limit": 100.0}}),
}
"""Behaviors and rules are called for eight robots at once."""


def table_of(member: type[Any], axes: int) -> dict[str, Any]:
    """The table of a member as a scenario gives it: its name, and what it has to be given in so many axes."""
    vectors = member.vectors() if issubclass(member, Component) else ()
    vector = tuple(1.0 / (1.0 + axis) for axis in range(axes))
    needed = required_parameters(member) if issubclass(member, Component) else ()
    numbers = {name: _allowed(member, name) for name in needed if name not in vectors}
    required = TRIALS[kind_of(member)].required
    return {member.named_by: member.own_name(), **dict.fromkeys(vectors, vector), **numbers, **required}


def _allowed(member: type[Any], name: str) -> float:
    """A number that a parameter may be."""
    for value in (1.0, 0.5, 2.0, 10.0, 0.1, -1.0):
        try:
            member.__pydantic_validator__.validate_assignment(member.model_construct(), name, value)
        except ValidationError:
            continue
        return value
    return 0.0


def table_with(
    member: type[Any], own: dict[str, Any], axes: int, measures: Sequence[str] = ()
) -> dict[str, Any]:  # fmt: skip
    """Return tables of a scenario in which a component takes part.

    Args:
        member: The component.
        own: Its table.
        axes: Of the mission.
        measures: What robots with an estimator measure; empty for what it needs.
    """
    return TRIALS[kind_of(member)].tables(Part(member, own, axes, measures))
