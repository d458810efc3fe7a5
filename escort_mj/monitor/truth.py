"""What the simulator knows and the law does not: mass matrix, bias, external force, reference torque.

Observed after the solve of every physics step (eqs. 1, 25), when the scenario asks for it; no law reads it.
"""

from __future__ import annotations

import math
from typing import Annotated

from escort_mj.monitor.lyapunov import account
from escort_mj.monitor.mass import INT, mass_block
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import DOUBLE, double_at, inlined, int_at, merged
from escort_mj.native.on_demand import on_demand_unrolled
from escort_mj.plan import Plan, State
from escort_mj.robots.addresses import Addresses


class TruthParameters(Fields):
    """Whether the truth is recorded."""

    truth: Annotated[bool, Value("1", "whether the truth channel is recorded")]


class TruthState(Fields):
    """What the step before brought."""

    mass_before: Annotated[Array, "known", "p*p", Value("kg", "mass_matrix of the step before")]
    reference_torque_before: Annotated[Array, "known", "p", Value("N", "likewise")]
    v_d_before: Annotated[Array, "known", "p", Value("m/s", "likewise")]


@on_demand_unrolled
def observe_truth(
    plan: Plan,
    state: State,
    addresses: Addresses,
    mass: int,
    row_sizes: int,
    row_starts: int,
    columns: int,
    bias: int,
    acceleration: int,
) -> None:
    """Writes the truth channel of one solved physics step; before `note_step`, which counts the step as seen.

    Args:
        plan: What the controller is given.
        state: `q`, `v` and the law's signals are read, the truth channel is written.
        addresses: Where robots are in MuJoCo's arrays.
        mass: Address of MuJoCo's sparse mass matrix, rows with their columns up to the diagonal.
        row_sizes: Address of the number of entries of each row.
        row_starts: Address of the first entry of each row.
        columns: Address of the column of each entry.
        bias: Address of the bias force.
        acceleration: Address of the acceleration that the solver found.
    """
    step = round(state.time[0] / plan.timestep) + 1.0
    if step == state.watched_step[0]:  # mj_forward at the same time: nothing new has happened
        return
    first = state.watched_step[0] == 0.0
    n, p = state.q.shape
    for i in range(n):
        dof = int(addresses.dof_address[i])
        for c in range(p * p):
            state.mass_before[i, c] = state.mass_matrix[i, c]
        mass_block(mass, row_sizes, row_starts, columns, dof, p, state.mass_matrix[i])
        end = int(addresses.tree_end[i])
        state.mass_coupling[i] = _coupling(dof, p, end, mass, row_sizes, row_starts, columns)
        for a in range(p):
            state.bias_force[i, a] = double_at(bias + DOUBLE * (dof + a)) - addresses.lift[i, a]
            external = state.bias_force[i, a] - state.force[i, a]
            for b in range(p):
                external += state.mass_matrix[i, a * p + b] * double_at(acceleration + DOUBLE * (dof + b))
            state.external_force[i, a] = external
        _reference_torque(i, plan, state, first)
        if plan.lyapunov:
            account(i, plan, state, first)
        for a in range(p):
            state.v_d_before[i, a] = state.v_d[i, a]


@inlined
def _coupling(dof: int, p: int, end: int, mass: int, row_sizes: int, row_starts: int, columns: int) -> float:
    """Norm of the mass matrix's entries between a robot's coordinates and the rest of its tree [kg].

    Rows reach up to the diagonal: those of the robot hold its ancestors, those behind it, up to `end`, it.
    """
    squares = 0.0
    for row in range(dof, end):
        start = int_at(row_starts + INT * row)
        for entry in range(start, start + int_at(row_sizes + INT * row)):
            column = int_at(columns + INT * entry)
            if column < dof if row < dof + p else dof <= column < dof + p:
                squares += double_at(mass + DOUBLE * entry) ** 2
    return math.sqrt(squares)


@merged
def _reference_torque(i: int, plan: Plan, state: State, first: bool) -> None:
    """Rho = M q_r'' + C q_r' + g with q_r' = v_d + slope e (eqs. 6, 8), of true states.

    With q_r' = v + s it is M (v_d' + slope (v_d - v)) + (C v + g) + C s. The bracket is the bias force, and C
    is M'/2 but for its skew rest, which does no work on s. Derivatives are differences from the step before;
    at the first step they are zero.
    """
    p, slope = state.q.shape[1], state.slopes[i]
    for a in range(p):
        state.reference_torque_before[i, a] = state.reference_torque[i, a]
        rho = state.bias_force[i, a]
        for b in range(p):
            rate = state.v_d[i, b] - state.v[i, b]
            s = rate + slope * (state.q_d[i, b] - state.q[i, b])
            mass = state.mass_matrix[i, a * p + b]
            rho += mass * slope * rate
            if not first:
                rho += mass * (state.v_d[i, b] - state.v_d_before[i, b]) / plan.timestep
                rho += 0.5 * (mass - state.mass_before[i, a * p + b]) / plan.timestep * s
        state.reference_torque[i, a] = rho
