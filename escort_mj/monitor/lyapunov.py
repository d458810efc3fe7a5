"""The Lyapunov function of the paper's proof (eqs. 11-16), and why it changes, per robot and step.

V1 = (s.M s + (k_p + slope k_d) |e|^2 + |rho - rho_hat|^2 / mu) / 2, of true states. Its change over a step is
booked under `CAUSES`; `docs/theory.md` derives them.
"""

from __future__ import annotations

from typing import Annotated, Any

from escort_mj.components.setup import MissionSetup
from escort_mj.laws import ApdSmc
from escort_mj.laws.sliding import SMOOTHINGS, SlidingModeLaw, smooth_signs
from escort_mj.monitor.signals import CAUSES
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import inlined, merged, stack_memory, vector_at
from escort_mj.plan import Plan, State

DISSIPATION, REFERENCE, EXTERNAL, NOISE, SATURATION, ANTI_WINDUP, UNEXPLAINED = range(len(CAUSES))


class LyapunovParameters(Fields):
    """Gains of the Lyapunov function."""

    lyapunov: Annotated[bool, Value("1", "whether V1 is recorded")]
    proportional_gain: Annotated[float, Value("N/m", "gain of the position error")]
    derivative_gain: Annotated[float, Value("N s/m", "gain of the velocity error")]
    switching_gain: Annotated[float, Value("N", "gain of the switching term")]
    adaptation_rate: Annotated[float, Value("N/m", "rate of the estimate; 0 without adaptation")]
    boundary_layer: Annotated[float, Value("m/s", "width of the smoothed zone of s")]
    smoothing: Annotated[int, Value("1", "place in SMOOTHINGS")]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        law = setup.law if isinstance(setup.law, SlidingModeLaw) else ApdSmc()  # of others V1 is not recorded
        return {
            **law.gains()._asdict(),
            "boundary_layer": law.boundary_layer,
            "smoothing": SMOOTHINGS.index(law.smoothing),
        }


class LyapunovState(Fields):
    """What is forecast."""

    pending: Annotated[Array, "judged", len(CAUSES), Value("J", "change of V1 in the step that begins")]


@inlined
def account(i: int, plan: Plan, state: State, first: bool) -> None:
    """Writes V1 of one robot, books the step that has ended, and forecasts the one that begins.

    Args:
        i: The robot.
        plan: Gives gains and timestep.
        state: The truth channel of this step is read, `lyapunov` and `lyapunov_change` are written.
        first: Whether no step has ended yet.
    """
    value = _value(i, plan, state)
    if not first:
        change, pending = state.lyapunov_change[i], state.pending[i]
        pending[REFERENCE] += _moved_reference(i, plan, state)
        pending[UNEXPLAINED] = value - state.lyapunov[i]
        for cause in range(UNEXPLAINED):
            change[cause] += pending[cause]
            pending[UNEXPLAINED] -= pending[cause]
        change[UNEXPLAINED] += pending[UNEXPLAINED]
    state.lyapunov[i] = value
    _forecast(i, plan, state, first)


@merged
def _sliding(i: int, a: int, plan: Plan, state: State) -> float:
    """S = (v_d - v) + slope (q_d - q) along an axis, of true states [m/s]."""
    return state.v_d[i, a] - state.v[i, a] + plan.slope * (state.q_d[i, a] - state.q[i, a])


@merged
def _value(i: int, plan: Plan, state: State) -> float:
    """V1 of one robot [J]; without adaptation (mu = 0) the estimate has no part in it."""
    p = state.q.shape[1]
    twice = 0.0
    for a in range(p):
        s = _sliding(i, a, plan, state)
        for b in range(p):
            twice += s * state.mass_matrix[i, a * p + b] * _sliding(i, b, plan, state)
        e = state.q_d[i, a] - state.q[i, a]
        twice += (plan.proportional_gain + plan.slope * plan.derivative_gain) * e * e
        if plan.adaptation_rate > 0.0:
            error = state.reference_torque[i, a] - state.rho_hat[i, a]
            twice += error * error / plan.adaptation_rate
    return 0.5 * twice


@merged
def _moved_reference(i: int, plan: Plan, state: State) -> float:
    """What the motion of the reference did to V1 at the end of the step, exactly [J].

    The law takes its new reference velocity only then: it enters s after the robot has moved. The reference
    torque's change enters the estimate's error.
    """
    p = state.q.shape[1]
    moved = 0.0
    for a in range(p):
        jump = state.v_d[i, a] - state.v_d_before[i, a]
        halfway = _sliding(i, a, plan, state) - 0.5 * jump
        for b in range(p):
            other = state.v_d[i, b] - state.v_d_before[i, b]
            moved += halfway * state.mass_matrix[i, a * p + b] * other
        if plan.adaptation_rate > 0.0:
            now = state.reference_torque[i, a] - state.rho_hat[i, a]
            before = state.reference_torque_before[i, a] - state.rho_hat[i, a]
            moved += 0.5 * (now * now - before * before) / plan.adaptation_rate
    return moved


@merged
def _forecast(i: int, plan: Plan, state: State, first: bool) -> None:
    """The change of V1 by each cause over the step that begins: timestep times the present rates."""
    p = state.q.shape[1]
    dt, pending = plan.timestep, state.pending[i]
    signs = vector_at(stack_memory(), p)
    for a in range(p):
        signs[a] = _sliding(i, a, plan, state) / plan.boundary_layer
    smooth_signs(signs, plan.smoothing)
    k_p, k_d = plan.proportional_gain, plan.derivative_gain
    k, mu = plan.switching_gain, plan.adaptation_rate
    for cause in range(pending.shape[0]):
        pending[cause] = 0.0
    for a in range(p):
        e, e_dot = state.q_d[i, a] - state.q[i, a], state.v_d[i, a] - state.v[i, a]
        s = _sliding(i, a, plan, state)
        error = state.reference_torque[i, a] - state.rho_hat[i, a]
        ideal = state.rho_hat[i, a] + k_p * e + k_d * e_dot + k * signs[a]
        held = state.q_d_rate[i, a] - state.v_d[i, a]
        pending[DISSIPATION] -= dt * (k_d * e_dot * e_dot + plan.slope * k_p * e * e + k * s * signs[a])
        pending[EXTERNAL] -= dt * s * state.external_force[i, a]
        pending[NOISE] -= dt * s * (state.tau[i, a] - ideal)
        pending[SATURATION] -= dt * s * (state.force[i, a] - state.tau[i, a])
        pending[ANTI_WINDUP] += dt * (k_p + plan.slope * k_d) * e * held
        if plan.adaptation_rate > 0.0:
            pending[NOISE] -= dt * error * (state.s[i, a] - s)
            pending[ANTI_WINDUP] += dt * error * (state.s[i, a] - state.rho_hat_rate[i, a] / mu)
        else:
            pending[REFERENCE] += dt * s * error
        for b in range(p):
            momentum = dt * s * state.mass_matrix[i, a * p + b]
            pending[ANTI_WINDUP] += plan.slope * momentum * (state.q_d_rate[i, b] - state.v_d[i, b])
            if not first:  # the part of rho that the law's own reference velocity will bring about
                pending[REFERENCE] -= momentum * (state.v_d[i, b] - state.v_d_before[i, b]) / dt
