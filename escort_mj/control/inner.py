"""The inner loop: what force each robot is to have, so that it follows the outer loop's velocity."""

from __future__ import annotations

from escort_mj.control.laws.computed_torque import force_of
from escort_mj.control.laws.sliding import smooth_sign, smooth_signs
from escort_mj.control.laws.super_twisting import twist
from escort_mj.control.laws.tracking import is_winding_up
from escort_mj.control.own.calls import own_law
from escort_mj.control.plan import (
    COMPUTED_TORQUE,
    DIFFERENTIATING,
    OWN,
    PD,
    SLIDING,
    SUPER_TWISTING,
    Plan,
    State,
)
from escort_mj.kernels import inlined, merged, stack_memory, vector_at
from escort_mj.lanes import WIDTH, Lanes, load, store, where
from escort_mj.on_demand import on_demand


@inlined
def inner_loop(plan: Plan, state: State) -> None:
    """Forces demanded of all robots and the rates of their state (eqs. 7, 9, 10, 17)."""
    if plan.law == SLIDING:
        _sliding_mode(plan, state)
        return
    count = state.q.shape[0] * state.q.shape[1]
    for at in range(0, count, WIDTH):
        _errors(plan, state, at)
    if plan.law == SUPER_TWISTING:
        _super_twisting(plan, state)
    elif plan.law == PD:
        _pd(plan, state)
    elif plan.law == COMPUTED_TORQUE:
        _computed_torque(plan, state)
    elif plan.law == OWN:
        _own(plan, state)


@inlined
def _errors(plan: Plan, state: State, at: int) -> tuple[Lanes, Lanes, Lanes]:
    """The errors e, e_dot and s of axes in a row (eq. 7); the last two are written."""
    e, e_dot = load(state.e, at), load(state.v_d, at) - load(state.v_measured, at)
    s = e_dot + plan.slope * e
    store(state.e_dot, at, e_dot)
    store(state.s, at, s)
    return e, e_dot, s


@merged
def _demand(plan: Plan, state: State, i: int, k: int, tau: float, rate: float) -> None:
    """Demands a force, and lets reference and estimate move on unless they would wind up.

    Args:
        plan: Gives the force limit, and whether there is anti-windup.
        state: Its `tau` and rates are written.
        i: Which robot, from 0.
        k: Which axis, from 0.
        tau: The force [N].
        rate: Of the estimate [N/s].
    """
    held = plan.anti_windup and is_winding_up(tau, state.s[i, k], plan.force_limit[i])
    state.tau[i, k] = tau
    state.rho_hat_rate[i, k] = 0.0 if held else rate
    state.q_d_rate[i, k] = state.v_measured[i, k] if held else state.v_d[i, k]


@merged
def _sliding_mode(plan: Plan, state: State) -> None:
    """Eq. 9, of which APD-SMC, ASMC and PD-SMC are cases; axes of all robots in a row."""
    count = state.q.shape[0] * state.q.shape[1]
    for at in range(0, count, WIDTH):
        e, e_dot, s = _errors(plan, state, at)
        tau = load(state.rho_hat, at) + plan.kp * e + plan.kd * e_dot
        tau = tau + plan.k * smooth_sign(s / plan.boundary_layer, plan.smoothing)
        store(state.tau, at, tau)
        rate, velocity = plan.mu * s, load(state.v_d, at)
        if plan.anti_windup:
            held = (abs(tau) > load(plan.force_limits, at)) & (tau * s > 0.0)
            rate, velocity = where(held, 0.0, rate), where(held, load(state.v_measured, at), velocity)
        store(state.rho_hat_rate, at, rate)
        store(state.q_d_rate, at, velocity)


@on_demand
def _super_twisting(plan: Plan, state: State) -> None:
    """See `laws/super_twisting.py`."""
    n, p = state.q.shape
    for i in range(n):
        for k in range(p):
            state.switching[i * p + k] = state.s[i, k] / plan.boundary_layer
    smooth_signs(state.switching, plan.smoothing)
    for i in range(n):
        for k in range(p):
            switched = state.switching[i * p + k]
            tau = state.rho_hat[i, k] + twist(state.s[i, k], switched, plan.k)
            _demand(plan, state, i, k, tau, plan.mu * switched)


@on_demand
def _pd(plan: Plan, state: State) -> None:
    """See `laws/pd.py`."""
    n, p = state.q.shape
    for i in range(n):
        for k in range(p):
            tau = plan.kp * state.e[i, k] + plan.kd * state.e_dot[i, k] + state.model_bias[i, k]
            _demand(plan, state, i, k, tau, 0.0)


@on_demand
def _own(plan: Plan, state: State) -> None:
    """A plugin's law."""
    n, p = state.q.shape
    own_law(plan, state)
    for i in range(n):
        for k in range(p):
            _demand(plan, state, i, k, state.tau[i, k], state.rho_hat_rate[i, k])


@on_demand
def _computed_torque(plan: Plan, state: State) -> None:
    """See `laws/computed_torque.py`. The filtered reference follows v_d at the rate that stands for a_d."""
    n, p = state.q.shape
    wish = vector_at(stack_memory(), p)
    lag = plan.acceleration_filter + plan.timestep
    for i in range(n):
        for k in range(p):
            if state.clock[DIFFERENTIATING] == 0.0:
                state.v_d_filtered[i, k] = state.v_d[i, k]
            state.v_d_rate[i, k] = (state.v_d[i, k] - state.v_d_filtered[i, k]) / lag
            wish[k] = state.v_d_rate[i, k] + plan.kd * state.e_dot[i, k] + plan.kp * state.e[i, k]
        for k in range(p):
            tau = force_of(wish, state.model_mass[i], state.model_bias[i], k)
            _demand(plan, state, i, k, tau, 0.0)
    state.clock[DIFFERENTIATING] = 1.0
