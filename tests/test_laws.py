"""The inner-loop laws: their gains, their switching term, their windup, and what each can hold still."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from escort_mj.behaviors import Surface
from escort_mj.control.setup import Setup
from escort_mj.laws import LAWS, ApdSmc, Asmc, ComputedTorque, Pd, PdSmc, SuperTwisting
from escort_mj.sensing.sensors import Sensors
from tests.control.twins import Kernel, vector
from tests.oracle.laws import switching
from tests.oracle.reference import ReferenceController

PAPER = (ApdSmc, Asmc, PdSmc)
SMOOTHINGS = ("tanh", "saturation", "sign")
SIGNALS = ("q_d", "v_d", "e", "e_dot", "s", "tau", "rho_hat")
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
    sensing=Sensors(),
    target=vector(0.0, 0.0),
    disturbance=vector(0.0, 0.5),
)


def fly(
    setup: Setup, seconds: float, mass: float = 1.0, gravity: float | np.ndarray = 0.0
) -> dict[str, np.ndarray]:
    """Drives one robot by the compiled law and the disturbance; its signals over time, each (steps, p)."""
    p = setup.axes
    kernel = Kernel(setup)
    start, model = (
        np.eye(1, p) * START[0, 0],
        (mass * np.eye(p)[None], np.broadcast_to(-mass * gravity, (1, p))),
    )
    q, v, rows = start, 0.0 * start, []
    for step in range(round(seconds / setup.timestep)):
        state = kernel.evaluate(step * setup.timestep, q, v, *model)
        limit = setup.force_limit[0]
        force = np.clip(state.tau, -limit, limit) + state.disturbance
        v = v + setup.timestep * (force / mass + gravity)
        q = q + setup.timestep * v
        rows.append([getattr(state, name)[0].copy() for name in SIGNALS])
    return dict(zip(SIGNALS, np.array(rows).swapaxes(0, 1), strict=True))


def simulate(setup: Setup, seconds: float, mass: float = 1.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Drives one robot; e, tau and rho_hat over time, each (steps, 2)."""
    flown = fly(setup, seconds, mass)
    return flown["e"], flown["tau"], flown["rho_hat"]


def test_gains_are_the_papers() -> None:
    assert ApdSmc().gains() == (30.0, 50.0, 1.0, 20.0)
    assert Asmc().gains() == (0.0, 0.0, 80.0, 20.0)
    assert PdSmc().gains() == (30.0, 50.0, 1.0, 0.0)
    assert [law().estimate_at_start for law in (ApdSmc, Asmc, PdSmc)] == [0.1, 0.1, 0.0]
    assert {law().slope for law in PAPER} == {20.0}


def test_every_law_has_its_own_name() -> None:
    names = [law().law for law in LAWS]
    assert names == sorted(set(names)) and {"apd_smc", "asmc", "pd_smc"} <= set(names)
    needing = {law().law for law in LAWS if law.needs_model}
    assert needing == {"pd", "computed_torque"}


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
        (Pd, {"proportional_gain": -1.0}),
        (Pd, {"smoothing": "sign"}),
        (ComputedTorque, {"acceleration_filter": -0.1}),
        (ComputedTorque, {"proportional_gain": 1.0}),
        (SuperTwisting, {"root_gain": -1.0}),
        (SuperTwisting, {"slope": 0.0}),
    ],
)
def test_impossible_parameters_are_refused(law, wrong: dict) -> None:
    with pytest.raises(ValidationError, match=next(iter(wrong))):
        law(**wrong)


@given(st.floats(-100.0, 100.0, allow_subnormal=False), st.floats(0.01, 10.0))
def test_switching_terms(s: float, width: float) -> None:
    for smoothing in SMOOTHINGS:
        value = float(switching(ApdSmc(smoothing=smoothing, boundary_layer=width), np.array(s)))
        assert abs(value) <= 1.0
        assert value * s >= 0.0
        assert float(switching(ApdSmc(smoothing=smoothing, boundary_layer=width), np.array(-s))) == -value
        if abs(s) > 20.0 * width:
            assert value == pytest.approx(math.copysign(1.0, s), abs=1e-15)


def test_switching_at_the_surface() -> None:
    zero = np.zeros(1)
    for smoothing in SMOOTHINGS:
        assert switching(ApdSmc(smoothing=smoothing, boundary_layer=1.0), zero)[0] == 0.0
    assert switching(ApdSmc(smoothing="saturation", boundary_layer=2.0), np.array([0.5]))[0] == 0.25
    assert switching(ApdSmc(smoothing="sign", boundary_layer=1.0), np.array([1e-300]))[0] == 1.0


@pytest.mark.parametrize("law", PAPER)
@pytest.mark.parametrize("smoothing", SMOOTHINGS)
def test_force_is_eq_9(law, smoothing: str) -> None:
    chosen = law(smoothing=smoothing, boundary_layer=0.5, slope=7.0)
    controller = ReferenceController(replace(SETUP, law=chosen))
    controller.reset(START)
    signals = controller.evaluate(0.0, START + [[0.1, -0.03]], np.array([[0.2, 0.4]]))
    kp, kd, k, _ = chosen.gains()
    rho = chosen.estimate_at_start
    np.testing.assert_allclose(signals.e, [[-0.1, 0.03]])
    np.testing.assert_allclose(signals.e_dot, signals.v_d - signals.v_measured)
    np.testing.assert_allclose(signals.s, signals.e_dot + 7.0 * signals.e)
    term = {
        "tanh": np.tanh(signals.s / 0.5),
        "saturation": np.clip(signals.s / 0.5, -1, 1),
        "sign": np.sign(signals.s),
    }
    np.testing.assert_allclose(signals.tau, rho + kp * signals.e + kd * signals.e_dot + k * term[smoothing])


@pytest.mark.parametrize("law", [ApdSmc, Asmc])
def test_adaptation_finds_the_disturbance(law) -> None:
    """Against a constant push the adaptive laws end with e = 0 and rho_hat = -push."""
    setup = replace(SETUP, law=law(adaptation_rate=100.0), timestep=0.004)
    e, tau, rho_hat = simulate(setup, 10.0)
    assert np.abs(e[-1]).max() < 1e-4
    np.testing.assert_allclose(rho_hat[-1], [0.0, -0.5], atol=1e-3)
    np.testing.assert_allclose(tau[-1], [0.0, -0.5], atol=1e-3)


def test_pd_smc_keeps_an_error_against_a_constant_push() -> None:
    e, tau, rho_hat = simulate(replace(SETUP, law=PdSmc(), timestep=0.004), 8.0)
    assert np.all(rho_hat == 0.0)
    np.testing.assert_allclose(tau[-1], [0.0, -0.5], atol=2e-3)
    # At rest kp e + k tanh(slope e) carries the push, along the circle to first order.
    assert 30.0 * e[-1, 1] + math.tanh(20.0 * e[-1, 1]) == pytest.approx(-0.5, abs=2e-3)


def test_sign_chatters_and_tanh_does_not() -> None:
    variation = {
        smoothing: np.abs(
            np.diff(simulate(replace(SETUP, law=ApdSmc(smoothing=smoothing)), 2.0)[1][-250:], axis=0)
        ).sum()
        for smoothing in ("tanh", "sign")
    }
    assert variation["sign"] > 1000.0 * variation["tanh"]


@pytest.mark.parametrize("push", [11.0, -11.0])
def test_anti_windup_holds_the_state_while_saturated(push: float) -> None:
    """A push beyond the limit: without anti-windup e and rho_hat run away, with it both stay small."""
    hard = replace(SETUP, disturbance=vector(0.0, push))
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


MASS = np.array([[[2.0, 0.3], [0.3, 1.5]]])
BIAS = np.array([[0.7, -9.0]])
OFF_PLACE = START + [[0.1, -0.03]], np.array([[0.2, 0.4]])


def first_signals(law, **model):
    controller = ReferenceController(replace(SETUP, law=law))
    controller.reset(START)
    return controller.evaluate(0.0, *OFF_PLACE, **model)


def test_pd_is_its_equation() -> None:
    found = first_signals(Pd(proportional_gain=7.0, derivative_gain=3.0), mass=MASS, bias=BIAS)
    np.testing.assert_allclose(found.tau, 7.0 * found.e + 3.0 * found.e_dot + BIAS, rtol=1e-15)


def test_computed_torque_is_its_equation() -> None:
    """M (a_d + k_v e_dot + k_p e) + bias; at the first step there is nothing yet to differentiate."""
    law = ComputedTorque(position_gain=7.0, velocity_gain=3.0, acceleration_filter=0.05)
    controller = ReferenceController(replace(SETUP, law=law))
    controller.reset(START)
    (q, v), dt = OFF_PLACE, SETUP.timestep
    first = controller.evaluate(0.0, q, v, MASS, BIAS)
    wish = 3.0 * first.e_dot + 7.0 * first.e
    np.testing.assert_allclose(first.tau[0], MASS[0] @ wish[0] + BIAS[0], rtol=1e-14)
    for _ in range(2):  # at one time nothing advances
        second = controller.evaluate(dt, q + 0.01, v, MASS, BIAS)
        a_d = (second.v_d - first.v_d) / (0.05 + dt)
        wish = a_d + 3.0 * second.e_dot + 7.0 * second.e
        np.testing.assert_allclose(second.tau[0], MASS[0] @ wish[0] + BIAS[0], rtol=1e-12)
    third = controller.evaluate(2 * dt, q - 0.02, v, MASS, BIAS)
    a_d = (third.v_d - second.v_d + 0.05 * a_d) / (0.05 + dt)
    wish = a_d + 3.0 * third.e_dot + 7.0 * third.e
    np.testing.assert_allclose(third.tau[0], MASS[0] @ wish[0] + BIAS[0], rtol=1e-12)


@pytest.mark.parametrize("smoothing", SMOOTHINGS)
def test_super_twisting_is_its_equation(smoothing: str) -> None:
    law = SuperTwisting(smoothing=smoothing, boundary_layer=0.5, slope=7.0, root_gain=3.0, integral_gain=11.0)
    controller = ReferenceController(replace(SETUP, law=law))
    controller.reset(START)
    found = controller.evaluate(0.0, *OFF_PLACE)
    sw = switching(ApdSmc(smoothing=smoothing, boundary_layer=0.5), found.s)
    np.testing.assert_allclose(found.tau, 3.0 * np.sqrt(np.abs(found.s)) * sw, rtol=1e-15)
    assert np.all(found.rho_hat == 0.0)
    after = controller.evaluate(SETUP.timestep, *OFF_PLACE)
    np.testing.assert_allclose(after.rho_hat, SETUP.timestep * 11.0 * sw, rtol=1e-15)


@pytest.mark.parametrize("law", [Pd(), ComputedTorque()])
def test_gravity_makes_nothing_sag(law) -> None:
    """In space, with gravity and without any other disturbance, a heavy robot on its place stays there."""
    space = replace(
        SETUP,
        law=law,
        obstacle_position=np.zeros((0, 3)),
        force_limit=np.array([100.0]),
        target=vector(0.0, 0.0, 0.0),
        disturbance=None,
    )
    gravity = np.array([[0.3, 0.0, -9.81]])
    flown = fly(space, 2.0, mass=3.0, gravity=gravity)
    np.testing.assert_allclose(flown["tau"], np.broadcast_to(-3.0 * gravity[0], (1000, 3)), atol=1e-10)
    assert np.abs(flown["e"]).max() < 1e-12
    sagging = fly(replace(space, law=PdSmc()), 2.0, mass=3.0, gravity=gravity)
    assert np.abs(sagging["e"]).max() > 0.1


def test_computed_torque_gives_the_error_its_own_dynamics() -> None:
    """e'' + k_v e' + k_p e = 0 whatever the mass: without noise and push, as far as steps can tell."""
    errors = []
    for timestep in (0.002, 0.001, 0.0005):
        law = ComputedTorque(position_gain=30.0, velocity_gain=6.0, acceleration_filter=0.0)
        moving = replace(
            SETUP,
            timestep=timestep,
            law=law,
            force_limit=np.array([math.inf]),
            radius=4.0,
            disturbance=None,
        )
        flown = fly(moving, 0.5, mass=3.7)
        time = timestep * np.arange(len(flown["e"]))
        # The first reference velocity is a jump, which leaves e(0) = 0, e'(0) = v_d(0).
        rate, frequency = 3.0, math.sqrt(30.0 - 9.0)
        start = flown["v_d"][0]
        exact = start / frequency * (np.exp(-rate * time) * np.sin(frequency * time))[:, None]
        errors.append(np.abs(flown["e"] - exact).max() / np.abs(exact).max())
    assert errors[0] < 0.02
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.1)  # first order in the timestep
    assert errors[1] / errors[2] == pytest.approx(2.0, rel=0.1)


@pytest.mark.parametrize(
    "push",
    [
        pytest.param(vector(0.0, 2.0), id="constant"),
        pytest.param(vector("2*sin(1.5*t)", "1.5*cos(2*t)"), id="swinging"),
    ],
)
def test_super_twisting_reaches_the_surface_in_finite_time(push) -> None:
    """And stays: s is zero but for the steps, w becomes the push; PD-SMC keeps an s."""
    pushed = replace(SETUP, law=SuperTwisting(), disturbance=push, force_limit=np.array([math.inf]))
    s = np.abs(fly(pushed, 4.0)["s"]).max(axis=1)
    reached = int(np.flatnonzero(s > 1e-3)[-1]) + 1
    assert s[: reached // 2].max() > 0.01
    assert reached * SETUP.timestep < 3.0
    finer = fly(replace(pushed, timestep=0.001), 4.0)
    assert np.abs(finer["s"][-1000:]).max() < s[-500:].max() / 3.0  # of second order: steps squared
    last = push.position(4.0)
    np.testing.assert_allclose(finer["rho_hat"][-1], -last, atol=0.02)
    assert np.abs(fly(replace(pushed, law=PdSmc()), 4.0)["s"][-500:]).max() > 20.0 * s[-500:].max()
