"""Robots whose motors fail: what they still do, and from when on the team counts them lost."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, NonNegativeFloat, PositiveFloat, PositiveInt

from escort_mj.components.parameters import UNLIMITED, Parameters
from escort_mj.components.setup import MissionSetup
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import inlined
from escort_mj.native.on_demand import on_demand
from escort_mj.numerics.noise import uniform
from escort_mj.numerics.reform import ALTERNATIONS, SAME, reform
from escort_mj.plan import Plan, State

Mask = NDArray[np.bool_]

HOLD = 0.5  # how long a mad motor keeps a force [s]
FAILURE_KINDS = ("dead", "stuck", "mad")
DEAD, STUCK, MAD = 0.0, 1.0, 2.0  # their places there


class FailureParameters(Fields):
    """What becomes of each robot's motors; no rows where none fails."""

    failure_start: Annotated[Array, "failing", Value("s", "when they fail; 1e300 for never")]
    failure_kind: Annotated[Array, "failing", Value("1", "place in FAILURE_KINDS")]
    failure_noticed: Annotated[Array, "failing", Value("s", "when the team knows")]
    failure_force: Annotated[Array, "failing", Value("N", "largest force of mad motors")]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        never = [UNLIMITED, DEAD, UNLIMITED, 0.0]
        table = np.tile(never, (setup.count if setup.failures else 0, 1))
        for failure in setup.failures:
            robot = failure.robot - 1
            force = setup.force_limit[robot] if failure.force is None else failure.force
            kind = FAILURE_KINDS.index(failure.kind)
            table[robot] = failure.at, kind, failure.at + failure.notice, force
        names = ("failure_start", "failure_kind", "failure_noticed", "failure_force")
        return dict(zip(names, table.T, strict=True))


class Failure(Parameters):
    """A failure of a robot's motors.

    Once the team knows about it, the robot counts as an obstacle, and the others close ranks.
    """

    robot: PositiveInt
    """Number of the robot, from 1."""
    at: NonNegativeFloat
    """Time of the failure [s]."""
    kind: Literal["dead", "stuck", "mad"] = "dead"
    """`dead`: no force; `stuck`: the last force, held constant; `mad`: random forces, each held for 0.5 s."""
    notice: NonNegativeFloat = 0.5
    """Delay until the team knows about the failure [s]; until then, the robot counts as intact."""
    force: Annotated[PositiveFloat, Field(le=1e12)] | None = None
    """Largest force per axis of a `mad` robot [N]; null: the robot's force limit."""


@on_demand
def notice_losses(plan: Plan, state: State) -> None:
    """Marks robots of which the team now knows that they failed; the others re-form (remark 2)."""
    n = state.lost.shape[0]
    late = state.time[0] + 0.5 * plan.timestep
    news, left = False, 0
    for i in range(n):
        if state.lost[i] == 0.0 and late >= plan.failure_noticed[i]:
            state.lost[i] = 1.0
            news = True
        if state.lost[i] == 0.0:
            left += 1
    if news and plan.team_radius.shape[0] == 0:  # teams close ranks each by itself
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
            plan.turns, state.rotation[0], state.vertices, state.scratch,
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
    late = state.time[0] + 0.5 * plan.timestep
    for i in range(n):
        if state.lost[i] != 0.0:
            for k in range(p):
                state.tau[i, k] = 0.0
                state.q_d_rate[i, k] = state.v_measured[i, k]
                state.rho_hat_rate[i, k] = 0.0
        if late < plan.failure_start[i]:
            continue
        kind = plan.failure_kind[i]
        if kind == MAD:
            held = int((late - plan.failure_start[i]) / HOLD)
            uniform(i, plan.failure_force[i], plan.seed, held, state.command[i])
        else:
            for k in range(p):
                state.command[i, k] = state.force_before[i, k] if kind == STUCK else 0.0


def placed(points: Array, directions: Array, turns: Array) -> Array:
    """Points turned and dealt so that each direction has one near, shape (k, p): assignment, then Kabsch.

    Args:
        points: Of the even figure, shape (k, p).
        directions: Of the robots from the target, shape (k, p).
        turns: Rotations to start from, shape (tries, p, p).
    """
    from scipy.optimize import linear_sum_assignment

    best, highest = points, -np.inf
    for rotation in turns:
        taken = np.full(len(points), -1)
        for _ in range(ALTERNATIONS):
            turned = points @ rotation.T
            found = linear_sum_assignment(directions @ turned.T, maximize=True)[1]
            if (found == taken).all():
                break
            taken = found
            u, _, vt = np.linalg.svd(directions.T @ points[taken])
            u[:, -1] *= np.sign(np.linalg.det(u @ vt))
            rotation = u @ vt
        alignment = float((directions * turned[taken]).sum())
        if alignment > highest + SAME:
            best, highest = turned[taken], alignment
    return best
