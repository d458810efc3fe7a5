"""Robots whose motors fail: what they still do, and from when on the team counts them lost."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from pydantic import Field, NonNegativeFloat, PositiveFloat, PositiveInt

from escort_mj.components.parameters import UNLIMITED, Parameters
from escort_mj.components.plan import FAILURE_SIZE
from escort_mj.native.kernels import inlined
from escort_mj.native.on_demand import on_demand
from escort_mj.numerics.noise import uniform
from escort_mj.numerics.reform import reform

if TYPE_CHECKING:
    from escort_mj.components.plan import Plan, State

HOLD = 0.5  # how long a mad motor keeps a force [s]
FAILURE_KINDS = ("dead", "stuck", "mad")
DEAD, STUCK, MAD = 0.0, 1.0, 2.0  # their places there
START, KIND, NOTICE, FORCE = range(FAILURE_SIZE)
"""Columns of a failure: start [s], kind, when it is noticed [s], force of a mad motor [N]."""


class Failure(Parameters):
    """A robot's motors fail. Once the team knows, the robot is an obstacle, and the others re-form."""

    robot: PositiveInt
    """Which robot, counted from 1."""
    at: NonNegativeFloat
    """When its motors fail [s]."""
    kind: Literal["dead", "stuck", "mad"] = "dead"
    """`dead`: no force; `stuck`: the last force stays; `mad`: random forces, each held for 0.5 s."""
    notice: NonNegativeFloat = 0.5
    """After how long the team knows, as from a drive that reports its fault [s]; till then it is trusted."""
    force: Annotated[PositiveFloat, Field(le=1e12)] | None = None
    """Largest force per axis of a `mad` robot [N]; null: its force limit."""

    def row(self, force_limit: float) -> list[float]:
        """The failure as the plan holds it: start, kind, when the team knows, force.

        Args:
            force_limit: The robot's own [N].
        """
        force = force_limit if self.force is None else self.force
        return [self.at, FAILURE_KINDS.index(self.kind), self.at + self.notice, force]


NEVER = [UNLIMITED, DEAD, UNLIMITED, 0.0]  # row of a robot that does not fail


@on_demand
def notice_losses(plan: Plan, state: State) -> None:
    """Marks robots of which the team now knows that they failed; the others re-form (remark 2)."""
    n = state.lost.shape[0]
    late = state.time[0] + 0.5 * plan.timestep
    news, left = False, 0
    for i in range(n):
        if state.lost[i] == 0.0 and late >= plan.failures[i, NOTICE]:
            state.lost[i] = 1.0
            news = True
        if state.lost[i] == 0.0:
            left += 1
    if news:
        _close_ranks(left, plan, state)


@on_demand
def _close_ranks(left: int, plan: Plan, state: State) -> None:
    """The formation of those left: chords pass over lost robots, and a smaller figure is placed."""
    n = state.lost.shape[0]
    for c in range(state.predecessors.shape[0]):
        _close_ring(state.predecessors[c], state.lost)
    state.chord_length[0] = 2.0 * plan.radius * math.sin(math.pi / left)
    if state.vertices.shape[0] > 0:
        first = 0
        for count in range(left + 1, n):
            first += count
        reform(
            state.q_measured, state.target_position_measured, state.lost, left, plan.figures, first,
            plan.turns, state.rotation, state.vertices, state.scratch,
        )  # fmt: skip


@inlined
def _close_ring(predecessors: np.ndarray, lost: np.ndarray) -> None:
    """Passes over lost robots in a ring: whoever followed one now follows the one before it."""
    for i in range(lost.shape[0]):
        other = int(predecessors[i])
        while lost[i] == 0.0 and lost[other] != 0.0:
            other = int(predecessors[other])
        predecessors[i] = other


@on_demand
def command_motors(plan: Plan, state: State) -> None:
    """What the motors are told: the law's force where they work, else what is left of them.

    The law asks nothing of a robot that is lost, and neither its reference nor its estimate moves on.
    """
    n, p = state.q.shape
    late = state.time[0] + 0.5 * plan.timestep
    for i in range(n):
        if state.lost[i] != 0.0:
            for k in range(p):
                state.tau[i, k] = 0.0
                state.q_d_rate[i, k] = state.v_measured[i, k]
                state.rho_hat_rate[i, k] = 0.0
        if late < plan.failures[i, START]:
            continue
        kind = plan.failures[i, KIND]
        if kind == MAD:
            held = int((late - plan.failures[i, START]) / HOLD)
            uniform(i, plan.failures[i, FORCE], plan.seed, held, state.command[i])
        else:
            for k in range(p):
                state.command[i, k] = state.force_before[i, k] if kind == STUCK else 0.0
