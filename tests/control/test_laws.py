"""The inner-loop laws: their gains, their switching term, their windup, and what each can hold still."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from escort_mj.control.behaviors import Surface
from escort_mj.control.laws import LAWS, ApdSmc, Asmc, PdSmc
from escort_mj.control.reference import ReferenceController
from escort_mj.control.reference.laws import switching
from escort_mj.control.setup import Setup


class Constant:
    """A vector that stays as it is."""

    def __init__(self, *value: float) -> None:
        self.value = np.array(value)

    def position(self, t: float) -> np.ndarray:
        return self.value

    def velocity(self, t: float) -> np.ndarray:
        return 0.0 * self.value


SMOOTHINGS = ("tanh", "saturation", "sign")
START = np.array([[5.0, 0.0]])
REST = np.zeros((1, 2))
SETUP = Setup(  # one robot on the circle around the origin, which asks nothing more of it
    timestep=0.002,
    seed=0,
    behaviors=(Surface(),),
    law=ApdSmc(),
    radius=5.0,
    target_feedforward=False,
    max_speed=math.inf,
    arrangement=None,
    obstacle_position=np.zeros((0, 2)),
    obstacle_radius=np.zeros(0),
    robot_radius=np.array([0.2]),
    force_limit=np.array([10.0]),
    noise_position=0.0,
    noise_velocity=0.0,
    target=Constant(0.0, 0.0),
    disturbance=Constant(0.0, 0.5),
)


def simulate(setup: Setup, seconds: float, mass: float = 1.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Drives one robot by the law and the disturbance; e, tau and rho_hat over time, each (steps, 2)."""
    controller = ReferenceController(setup)
    controller.reset(START)
    q, v, rows = START, REST, []
    for step in range(round(seconds / setup.timestep)):
        signals = controller.evaluate(step * setup.timestep, q, v)
        limit = setup.force_limit[0]
        v = v + setup.timestep / mass * (np.clip(signals.tau, -limit, limit) + signals.disturbance)
        q = q + setup.timestep * v
        rows.append((signals.e[0], signals.tau[0], signals.rho_hat[0]))
    e, tau, rho_hat = np.array(rows).swapaxes(0, 1)
    return e, tau, rho_hat


def test_gains_are_the_papers() -> None:
    assert ApdSmc().gains() == (30.0, 50.0, 1.0, 20.0, 0.1)
    assert Asmc().gains() == (0.0, 0.0, 80.0, 20.0, 0.1)
    assert PdSmc().gains() == (30.0, 50.0, 1.0, 0.0, 0.0)
    assert {law().slope for law in LAWS} == {20.0}


@pytest.mark.parametrize("law", LAWS)
def test_every_law_has_its_own_name(law) -> None:
    assert law().law in ("apd_smc", "asmc", "pd_smc")
    assert len({other().law for other in LAWS}) == len(LAWS)


@pytest.mark.parametrize(
    ("law", "wrong"),
    [
        (ApdSmc, {"proportional_gain": -1.0}),
        (ApdSmc, {"slope": 0.0}),
        (ApdSmc, {"boundary_layer": 0.0}),
        (ApdSmc, {"smoothing": "step"}),
        (ApdSmc, {"adaptation_rate": math.nan}),
        (Asmc, {"switching_gain": math.inf}),
        (Asmc, {"derivative_gain": 1.0}),
        (PdSmc, {"adaptation_rate": 1.0}),
    ],
)
def test_impossible_parameters_are_refused(law, wrong: dict) -> None:
    with pytest.raises(ValidationError, match=next(iter(wrong))):
        law(**wrong)


@given(st.floats(-100.0, 100.0, allow_subnormal=False), st.floats(0.01, 10.0))
def test_switching_terms(s: float, width: float) -> None:
    for smoothing in SMOOTHINGS:
        value = float(switching(np.array(s), smoothing, width))
        assert abs(value) <= 1.0
        assert value * s >= 0.0
        assert float(switching(np.array(-s), smoothing, width)) == -value
        if abs(s) > 20.0 * width:
            assert value == pytest.approx(math.copysign(1.0, s), abs=1e-15)


def test_switching_at_the_surface() -> None:
    zero = np.zeros(1)
    for smoothing in SMOOTHINGS:
        assert switching(zero, smoothing, 1.0)[0] == 0.0
    assert switching(np.array([0.5]), "saturation", 2.0)[0] == 0.25
    assert switching(np.array([1e-300]), "sign", 1.0)[0] == 1.0


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("smoothing", SMOOTHINGS)
def test_force_is_eq_9(law, smoothing: str) -> None:
    chosen = law(smoothing=smoothing, boundary_layer=0.5, slope=7.0)
    controller = ReferenceController(replace(SETUP, law=chosen))
    controller.reset(START)
    signals = controller.evaluate(0.0, START + [[0.1, -0.03]], np.array([[0.2, 0.4]]))
    kp, kd, k, _, rho = chosen.gains()
    np.testing.assert_allclose(signals.e, [[-0.1, 0.03]])
    np.testing.assert_allclose(signals.e_dot, signals.v_d - signals.v_measured)
    np.testing.assert_allclose(signals.s, signals.e_dot + 7.0 * signals.e)
    term = {
        "tanh": np.tanh(signals.s / 0.5),
        "saturation": np.clip(signals.s / 0.5, -1, 1),
        "sign": np.sign(signals.s),
    }
    np.testing.assert_allclose(signals.tau, rho + kp * signals.e + kd * signals.e_dot + k * term[smoothing])


def test_adaptation_finds_the_disturbance() -> None:
    """Against a constant push the adaptive laws end with e = 0 and rho_hat = -push; PD-SMC keeps an error."""
    for law in (ApdSmc(adaptation_rate=100.0), Asmc(adaptation_rate=100.0)):
        e, tau, rho_hat = simulate(replace(SETUP, law=law), 10.0)
        assert np.abs(e[-1]).max() < 1e-4
        np.testing.assert_allclose(rho_hat[-1], [0.0, -0.5], atol=1e-3)
        np.testing.assert_allclose(tau[-1], [0.0, -0.5], atol=1e-3)
    e, tau, rho_hat = simulate(replace(SETUP, law=PdSmc()), 8.0)
    assert np.all(rho_hat == 0.0)
    np.testing.assert_allclose(tau[-1], [0.0, -0.5], atol=2e-3)
    # At rest kp e + k tanh(slope e) carries the push, along the circle to first order.
    assert 30.0 * e[-1, 1] + math.tanh(20.0 * e[-1, 1]) == pytest.approx(-0.5, abs=2e-3)


def test_sign_chatters_and_tanh_does_not() -> None:
    variation = {
        smoothing: np.abs(
            np.diff(simulate(replace(SETUP, law=ApdSmc(smoothing=smoothing)), 4.0)[1][-500:], axis=0)
        ).sum()
        for smoothing in ("tanh", "sign")
    }
    assert variation["sign"] > 1000.0 * variation["tanh"]


@pytest.mark.parametrize("push", [11.0, -11.0])
def test_anti_windup_holds_the_state_while_saturated(push: float) -> None:
    """A push beyond the limit: without anti-windup e and rho_hat run away, with it both stay small."""
    hard = replace(SETUP, disturbance=Constant(0.0, push))
    e, tau, rho_hat = simulate(replace(hard, law=ApdSmc()), 2.0)
    saturated = np.abs(tau[:, 1]) > 10.0
    assert saturated[-500:].all()
    assert np.abs(e).max() < 0.2
    assert np.abs(rho_hat).max() < 10.0

    e, _, rho_hat = simulate(replace(hard, law=ApdSmc(anti_windup=False)), 2.0)
    assert np.abs(e).max() > 1.0
    assert np.abs(rho_hat).max() > 100.0


def test_anti_windup_acts_axis_by_axis_and_only_outward() -> None:
    setup = replace(SETUP, timestep=0.5, disturbance=None)
    limit = setup.force_limit[0]
    q, v = START + [[0.0, -1.0]], np.array([[0.3, 0.0]])
    for anti_windup in (True, False):
        controller = ReferenceController(replace(setup, law=ApdSmc(anti_windup=anti_windup)))
        controller.reset(START)
        first = controller.evaluate(0.0, q, v)
        held = (np.abs(first.tau) > limit) & (first.s * first.tau > 0.0) & anti_windup
        second = controller.evaluate(0.5, q, v)
        np.testing.assert_allclose(
            second.rho_hat, np.where(held, first.rho_hat, first.rho_hat + 0.5 * 20.0 * first.s)
        )
        np.testing.assert_allclose(second.q_d, first.q_d + 0.5 * np.where(held, v, first.v_d))
        assert held[0, 1] == anti_windup

    # Saturated by a large estimate while s points inward: the estimate must be free to come back.
    controller = ReferenceController(replace(setup, law=ApdSmc(initial_estimate=50.0)))
    controller.reset(START)
    inward = controller.evaluate(0.0, START, np.array([[0.05, 0.05]]))
    assert np.all(inward.tau > limit) and np.all(inward.s < 0.0)
    np.testing.assert_allclose(controller.evaluate(0.5, START, REST).rho_hat, 50.0 + 0.5 * 20.0 * inward.s)
