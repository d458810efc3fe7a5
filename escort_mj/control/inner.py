"""The inner loop: what force each robot is to have, so that it follows the outer loop's velocity."""

from __future__ import annotations

from escort_mj.control.laws.sliding import is_winding_up, smooth_signs
from escort_mj.control.plan import Plan, State
from escort_mj.kernels import inlined


@inlined
def inner_loop(plan: Plan, state: State) -> None:
    """Forces demanded of all robots and the rates of their state (eqs. 7, 9, 10, 17)."""
    n, p = state.q.shape
    switching = state.switching
    for i in range(n):
        for k in range(p):
            e_dot = state.v_d[i, k] - state.v_measured[i, k]
            s = e_dot + plan.slope * state.e[i, k]
            state.e_dot[i, k] = e_dot
            state.s[i, k] = s
            switching[i * p + k] = s / plan.boundary_layer
    smooth_signs(switching, plan.smoothing)
    for i in range(n):
        limit = plan.force_limit[i]
        for k in range(p):
            s = state.s[i, k]
            tau = (
                state.rho_hat[i, k]
                + plan.kp * state.e[i, k]
                + plan.kd * state.e_dot[i, k]
                + plan.k * switching[i * p + k]
            )
            held = plan.anti_windup and is_winding_up(tau, s, limit)
            state.tau[i, k] = tau
            state.rho_hat_rate[i, k] = 0.0 if held else plan.mu * s
            state.q_d_rate[i, k] = state.v_measured[i, k] if held else state.v_d[i, k]
