"""Robots whose motors fail: what they still do, and from when on the team counts them lost."""

from __future__ import annotations

import math
from typing import Annotated, Any

import numpy as np

from escort_mj.components.component import block_at, number_of, reader
from escort_mj.components.setup import MissionSetup
from escort_mj.control.custom.calls import custom_failure
from escort_mj.control.members import asker
from escort_mj.failures import FAILURES, Failure
from escort_mj.failures.failure import MOTORS
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import inlined
from escort_mj.native.lanes import copy_numbers
from escort_mj.native.on_demand import on_demand
from escort_mj.numerics.noise import uniform
from escort_mj.numerics.reform import reform
from escort_mj.plan import Plan, State

NEVER = -1.0  # in place of the block of a robot whose motors do not fail


class FailureParameters(Fields):
    """Whose motors fail; no rows where none do."""

    failure: Annotated[Array, "failing", Value("1", "place in FAILURES; their number for a plugin's")]
    failure_place: Annotated[
        Array, "failing", Value("1", "where its block in `parameters` begins; -1 for none")
    ]
    failure_motors: Annotated[Array, "failing", Value("1", "place in MOTORS: what rotors and servos do")]
    failure_renews: Annotated[Array, "failing", Value("s", "how long random numbers are kept")]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        kind, motors, renews = np.zeros((3, setup.count if setup.failures else 0))
        failing: list[Failure | float] = [NEVER] * len(kind)
        for failure in setup.failures:
            robot = failure.robot - 1
            failing[robot], kind[robot] = failure, number_of(failure, FAILURES)
            motors[robot], renews[robot] = MOTORS.index(failure.motors), failure.renews
        return {
            "failure": kind,
            "failure_place": failing,
            "failure_motors": motors,
            "failure_renews": renews,
        }


class FailureState(Fields):
    """What a failure is given, and what it commands."""

    failure_age: Annotated[Array, 1, Value("s", "how long ago the motors failed")]
    failure_draw: Annotated[Array, "failing", "p", Value("1", "random numbers, uniform in (-1, 1)")]
    failure_command: Annotated[Array, "failing", "p", Value("N", "what the motors are to give")]


_read = reader(Failure)


@inlined
def has_failed(i: int, plan: Plan, state: State) -> bool:
    """Whether the motors of a robot have failed, in a mission in which some fail."""
    if plan.failure_place[i] == NEVER:
        return False
    return state.time[0] + 0.5 * plan.timestep >= _failure_of(i, plan).at


@inlined
def _failure_of(i: int, plan: Plan) -> Any:
    """Return those parameters of the failure of a robot that all failures have."""
    return _read(block_at(int(plan.failure_place[i]), plan), 0)


@on_demand
def notice_losses(plan: Plan, state: State) -> None:
    """Marks robots of which the team now knows that they failed; the others re-form (remark 2)."""
    n = state.lost.shape[0]
    late = state.time[0] + 0.5 * plan.timestep
    news, left = False, 0
    for i in range(n):
        if state.lost[i] == 0.0 and plan.failure_place[i] != NEVER:
            failure = _failure_of(i, plan)
            if late >= failure.at + failure.notice:
                state.lost[i] = 1.0
                news = True
        if state.lost[i] == 0.0:
            left += 1
    if news and plan.team_radius.shape[0] == 0:  # teams close ranks each by itself
        _close_ranks(left, plan, state)


@on_demand
def _close_ranks(left: int, plan: Plan, state: State) -> None:
    """The formation of those left: chords pass over lost robots, and a smaller figure is placed."""
    for c in range(state.predecessors.shape[0]):
        _close_ring(state.predecessors[c], state.lost)
    state.chord_length[0] = 2.0 * plan.radius * math.sin(math.pi / left)
    if state.vertices.shape[0] > 0:
        reform(
            state.q_measured, state.target_position_measured, state.lost, plan.figures, plan.turns,
            state.rotation[0], state.vertices, state.scratch,
        )  # fmt: skip


@inlined
def _close_ring(predecessors: np.ndarray, lost: np.ndarray) -> None:
    """Passes over lost robots in a ring: the robot that followed one now follows the one before it."""
    for i in range(lost.shape[0]):
        other = int(predecessors[i])
        while lost[i] == 0.0 and lost[other] != 0.0:
            other = int(predecessors[other])
        predecessors[i] = other


@on_demand
def command_failing_motors(plan: Plan, state: State) -> None:
    """Command the motors: the law's force where they work, else what is left of them.

    The law asks nothing of a robot that is lost, and neither its reference nor its estimate moves on.
    """
    n, p = state.q.shape
    for i in range(n):
        if state.lost[i] != 0.0:
            state.tau[i] = 0.0
            state.rho_hat_rate[i] = 0.0
            copy_numbers(state.v_measured[i], state.q_d_rate[i], p)
        if has_failed(i, plan, state):
            age = state.time[0] + 0.5 * plan.timestep - _failure_of(i, plan).at
            every, draw = plan.failure_renews[i], int(state.step[0])
            if every > 0.0:
                draw = int(age / every)
            uniform(i, 1.0, plan.seed, draw, state.failure_draw[i])
            state.failure_age[0] = age
            _fail(int(plan.failure[i]), block_at(int(plan.failure_place[i]), plan), i, plan, state)
            copy_numbers(state.failure_command[i], state.command[i], p)


_fail = asker(FAILURES, custom_failure, inlined)
