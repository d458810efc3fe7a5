"""The inner loop: what force each robot is to have, so that it follows the outer loop's velocity."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Annotated, Any

import numpy as np

from escort_mj.components.component import OUTSIDE, number_of, reader
from escort_mj.components.dispatch import one_of
from escort_mj.components.setup import MissionSetup
from escort_mj.control.custom.calls import custom_law
from escort_mj.laws import LAWS, ApdSmc, Law
from escort_mj.laws.law import evaluation_by, memory_by
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import DOUBLE, data_address, inlined, inlined_once, reachable
from escort_mj.native.lanes import WIDTH, Lanes, copy_lanes, copy_numbers, load, store, where
from escort_mj.native.memory import part_of
from escort_mj.native.on_demand import on_demand
from escort_mj.native.vectors import numbers_at, set_numbers_at
from escort_mj.plan import Plan, State

SEVERAL = len(LAWS) + 1
"""In place of a law's number: robots have different ones."""


class InnerLoopParameters(Fields):
    """What the law is, and what all laws share; those of teams and robots, where they differ."""

    law: Annotated[
        int, Value("1", "place in LAWS; their number for a plugin's, SEVERAL for several, OUTSIDE for none")
    ]
    slope: Annotated[float, Value("1/s", "of the sliding variable")]
    anti_windup: Annotated[bool, Value("1", "whether estimate and reference are held at the limit")]
    acceleration_filter: Annotated[float, Value("s", "time constant of the filter in front of v_d_rate")]
    slope_at_start: Annotated[Array, "n", Value("1/s", "slope of each robot's law")]
    estimate_at_start: Annotated[Array, "n", Value("N", "value at which rho_hat begins")]
    force_limits: Annotated[Array, "n", "p", Value("N", "force_limit, axis by axis")]
    laws: Annotated[Array, "laws", Value("1", "place in LAWS of each law; none where all have the same")]
    laws_place: Annotated[Array, "laws", Value("1", "where its numbers begin in `parameters`")]
    laws_row: Annotated[Array, "laws", Value("1", "where its own memory begins")]
    laws_rows: Annotated[Array, "laws", Value("1", "how many rows it has")]
    laws_slope: Annotated[Array, "laws", Value("1/s", "its slope")]
    laws_filter: Annotated[Array, "laws", Value("s", "its acceleration_filter")]
    team_laws: Annotated[Array, "teams_with_laws", Value("1", "which of them each team has, from 0")]
    own_laws: Annotated[Array, "robots_with_laws", Value("1", "which one a robot has of its own; -1: none")]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        law, number = setup.law, SEVERAL if setup.laws else number_of(setup.law, LAWS)
        return {
            "law": OUTSIDE if setup.outside == "force" else number,
            "slope": law.slope,
            "anti_windup": law.anti_windup,
            "acceleration_filter": law.filter_time,
            "slope_at_start": setup.by_robot("slope"),
            "estimate_at_start": setup.by_robot("estimate_at_start"),
            "force_limits": np.repeat(np.reshape(setup.force_limit, (-1, 1)), setup.axes, axis=1),
            "laws": [number_of(each, LAWS) for each in setup.laws],
            "laws_place": setup.laws,
            "laws_row": setup.memory_rows("laws")[: len(setup.laws)],
            "laws_rows": [len(type(each).memories()) for each in setup.laws],
            "laws_slope": [each.slope for each in setup.laws],
            "laws_filter": [each.filter_time for each in setup.laws],
            "team_laws": setup.team_laws,
            "own_laws": setup.own_laws,
        }


class InnerLoopState(Fields):
    """Rates of what the loop integrates, and what laws that ask for it are given."""

    slopes: Annotated[Array, "n", Value("1/s", "slope of each robot's law")]
    q_d_rate: Annotated[Array, "n", "p", Value("m/s", "rate of the reference position")]
    rho_hat_rate: Annotated[Array, "n", "p", Value("N/s", "rate of the estimate")]
    v_d_filtered: Annotated[Array, "differentiating", "p", Value("m/s", "v_d behind a filter")]
    v_d_rate: Annotated[Array, "differentiating", "p", Value("m/s^2", "derivative of what is filtered")]
    differentiated: Annotated[Array, 1, Value("1", "whether v_d has been differentiated before")]
    model_mass: Annotated[Array, "modeled", "p*p", Value("kg", "mass matrix of each robot, row by row")]
    model_bias: Annotated[Array, "modeled", "p", Value("N", "bias force of each robot")]
    law_of: Annotated[Array, "mixed", Value("1", "which of the laws each robot has, from 0")]
    kept_tau: Annotated[Array, "mixed", "p", Value("N", "forces by the laws of robots: scratch")]
    kept_rho_hat_rate: Annotated[Array, "mixed", "p", Value("N/s", "likewise")]
    kept_q_d_rate: Annotated[Array, "mixed", "p", Value("m/s", "likewise")]


@inlined
def inner_loop(plan: Plan, state: State) -> None:
    """Forces demanded of all robots and the rates of their state (eqs. 7, 9, 10, 17)."""
    for at in range(0, state.q.shape[0] * state.q.shape[1], WIDTH):
        e_dot = load(state.v_d, at) - load(state.v_measured, at)
        store(state.e_dot, at, e_dot)
        store(state.s, at, e_dot + plan.slope * load(state.e, at))
    if state.v_d_rate.shape[0] > 0:
        _differentiate(plan, state)
    if state.component_memory.shape[0] > 0:
        state.memory_row[0] = 0.0
    if plan.law == DEFAULT:
        _default_loop(0, plan, state)
    elif plan.law != OUTSIDE:
        _force_of(plan.law, 0, plan, state)


@on_demand
def _differentiate(plan: Plan, state: State) -> None:
    """Derivative of the reference velocity; what is filtered follows v_d at the rate that stands for it."""
    lag = plan.acceleration_filter + plan.timestep
    for at in range(0, state.q.shape[0] * state.q.shape[1], WIDTH):
        if state.differentiated[0] == 0.0:
            store(state.v_d_filtered, at, load(state.v_d, at))
        store(state.v_d_rate, at, (load(state.v_d, at) - load(state.v_d_filtered, at)) / lag)
    state.differentiated[0] = 1.0


@inlined
def _demand(anti_windup: bool, plan: Plan, state: State, at: int, tau: Lanes, rate: Lanes) -> None:
    """Demand forces, and let reference and estimate move on unless they would wind up.

    Args:
        anti_windup: Whether the law has it.
        plan: Gives the force limits.
        state: Its `tau` and rates are written.
        at: First of eight axes, of all robots in a row.
        tau: The forces [N].
        rate: Of the estimates [N/s].
    """
    store(state.tau, at, tau)
    velocity = load(state.v_d, at)
    if anti_windup:
        held = (abs(tau) > load(plan.force_limits, at)) & (tau * load(state.s, at) > 0.0)
        rate, velocity = where(held, 0.0, rate), where(held, load(state.v_measured, at), velocity)
    store(state.rho_hat_rate, at, rate)
    store(state.q_d_rate, at, velocity)


@cache
def _loop_of(law: type[Law]) -> Callable[..., Any]:
    """Return the kernel that has a law demand the forces of all robots, with its numbers from a place on."""
    equations = {name: inlined_once(equation) for name, equation in law.equations().items()}
    evaluate, write_memory = (by(law, inlined, equations) for by in (evaluation_by, memory_by))
    read, seen_in = reader(law), part_of(law.view)

    def loop(place: int, plan: Plan, state: State) -> None:
        view = seen_in(state)
        parameters = read(data_address(plan.parameters) + DOUBLE * place, 0)
        for at in range(0, state.q.shape[0] * state.q.shape[1], WIDTH):
            tau, rate = evaluate(parameters, view, at)
            _demand(parameters.anti_windup, plan, state, at, tau, rate)
        write_memory(parameters, view)

    return inlined(loop)


def _kernel_of(law: type[Law]) -> Callable[..., Any]:
    """Return the same as machine code of its own."""
    loop = _loop_of(law)

    def force(place: int, plan: Plan, state: State) -> None:
        loop(place, plan, state)

    return on_demand(reachable(force, f"force_of_{law.own_name()}"))


@on_demand
def _force_of_plugin(place: int, plan: Plan, state: State) -> None:
    """Have a plugin's law demand the forces of all robots."""
    custom_law(plan, state)
    for at in range(0, state.q.shape[0] * state.q.shape[1], WIDTH):
        _demand(plan.anti_windup, plan, state, at, load(state.tau, at), load(state.rho_hat_rate, at))


_KERNELS = [_kernel_of(law) for law in LAWS]
_force_of_shipped = one_of(_KERNELS)


@on_demand
def _force_of_each(place: int, plan: Plan, state: State) -> None:
    """Have each law demand the forces of all robots, and keep those of the robots that have it."""
    n, p = state.q.shape
    for i in range(n):
        e, e_dot = numbers_at(state, state.e, i), numbers_at(state, state.e_dot, i)
        set_numbers_at(state.s, i, e_dot + state.slopes[i] * e)
        if state.v_d_rate.shape[0] > 0:
            ahead = numbers_at(state, state.v_d, i) - numbers_at(state, state.v_d_filtered, i)
            lag = plan.laws_filter[int(state.law_of[i])] + plan.timestep
            set_numbers_at(state.v_d_rate, i, ahead / lag)
    for law in range(plan.laws.shape[0]):
        state.memory_row[0] = plan.laws_row[law]
        _force_of_shipped(int(plan.laws[law]), int(plan.laws_place[law]), plan, state)
        _keep_own_memory(law, plan, state)
        for i in range(n):
            if state.law_of[i] == float(law):
                copy_numbers(state.tau[i], state.kept_tau[i], p)
                copy_numbers(state.rho_hat_rate[i], state.kept_rho_hat_rate[i], p)
                copy_numbers(state.q_d_rate[i], state.kept_q_d_rate[i], p)
    copy_lanes(state.kept_tau, state.tau, n * p)
    copy_lanes(state.kept_rho_hat_rate, state.rho_hat_rate, n * p)
    copy_lanes(state.kept_q_d_rate, state.q_d_rate, n * p)


@inlined
def _keep_own_memory(law: int, plan: Plan, state: State) -> None:
    """Hold the memory of a law for robots of other laws; one that comes back goes on from there."""
    first = int(plan.laws_row[law])
    for row in range(first, first + int(plan.laws_rows[law])):
        for i in range(state.q.shape[0]):
            if state.law_of[i] != float(law):
                state.component_rate[row, i] = 0.0


@inlined
def law_in(i: int, team: int, plan: Plan) -> float:
    """Return which of the laws a robot has in a team: its own, or the team's.

    Args:
        i: The robot, from 0.
        team: The team, from 0; 0 where all robots are one.
        plan: Gives the laws.
    """
    return plan.own_laws[i] if plan.own_laws[i] >= 0.0 else plan.team_laws[team]


@inlined
def change_law(i: int, team: int, plan: Plan, state: State) -> None:
    """Let a robot take over the law of a team, if it differs: the derivative of v_d goes on as it was.

    Args:
        i: The robot, from 0.
        team: Its team from now on, from 0.
        plan: Gives the laws.
        state: What is filtered moves to where the new filter gives the same derivative.
    """
    if plan.laws.shape[0] == 0:
        return
    old, new = int(state.law_of[i]), int(law_in(i, team, plan))
    state.law_of[i], state.slopes[i] = float(new), plan.laws_slope[new]
    if state.v_d_rate.shape[0] > 0:
        ahead = plan.laws_filter[old] - plan.laws_filter[new]
        filtered = numbers_at(state, state.v_d_filtered, i)
        set_numbers_at(state.v_d_filtered, i, filtered + ahead * numbers_at(state, state.v_d_rate, i))


_force_of = one_of([*_KERNELS, _force_of_plugin, _force_of_each])
DEFAULT = LAWS.index(ApdSmc)
_default_loop = _loop_of(ApdSmc)  # of most missions: part of `evaluate`
