"""Gains by the closed rule: the poles that it promises, and what it limits."""

import math

import numpy as np
import pytest

from escort_mj.api import load_scenario
from escort_mj.laws.gains import LAWS_WITH_A_RULE, MOST_RATE, NOISE_SHARE, Robot, gains_of, rate_of
from escort_mj.mission import fly
from escort_mj.scenario.geometry.team_gains import proposal

SLOW = Robot(mass=2.0, delay=0.1, force_limit=20.0, disturbed=True)
CALM = SLOW._replace(disturbed=False)


def loops(law: str, robot: Robot) -> tuple[float, float, float]:
    """Damping, stiffness and integral of a law near its sliding surface, per mass."""
    gains = LAWS_WITH_A_RULE[law].gains(robot, rate_of(law, robot).value)
    switched = gains.get("switching_gain", 0.0) / gains.get("boundary_layer", 1.0)
    adaptation = gains.get("adaptation_rate", 0.0)
    damping = gains.get("derivative_gain", 0.0) + switched
    stiffness = gains.get("proportional_gain", 0.0) + adaptation + gains["slope"] * switched
    return damping / robot.mass, stiffness / robot.mass, adaptation * gains["slope"] / robot.mass


def poles(law: str, robot: Robot) -> np.ndarray:
    """Poles of a mass behind a lag, in units of the velocity loop's rate."""
    polynomial = [robot.delay, 1.0, *loops(law, robot)]
    return np.roots(polynomial if polynomial[-1] else polynomial[:-1]) / rate_of(law, robot).value


def test_the_papers_law_has_two_pairs_with_damping_071() -> None:
    assert rate_of("apd_smc", SLOW) == (pytest.approx(5.0), "the drive")
    found = poles("apd_smc", SLOW)
    assert np.abs(found.real + 0.5).max() < 1e-3 and np.abs(np.abs(found.imag) - 0.5).max() < 1e-3


@pytest.mark.parametrize("law", ["apd_smc", "asmc", "pd_smc"])
def test_where_no_force_changes_a_step_of_velocity_overshoots_little(law: str) -> None:
    from scipy import signal  # slow to import

    overshoots = []
    for robot in (SLOW, CALM):
        pid = loops(law, robot)
        _, answer = signal.step((pid, [robot.delay, 1.0, *pid]), T=np.linspace(0.0, 20.0, 2001))
        overshoots.append(answer.max() - 1.0)
    assert overshoots[0] > 0.4 and overshoots[1] < 0.21


@pytest.mark.parametrize("law", ["apd_smc", "asmc"])
def test_the_first_estimate_is_a_velocity_of_2_mm_per_s(law: str) -> None:
    light = Robot(mass=0.027, delay=0.25, force_limit=0.01)
    gains = gains_of(law, light, rate_of(law, light).value)
    assert gains["initial_estimate"] == pytest.approx(0.002 * loops(law, light)[0] * light.mass, rel=5e-3)


@pytest.mark.parametrize("law", ["pd_smc", "pd"])
def test_laws_without_an_integral_are_butterworth(law: str) -> None:
    assert np.abs(poles(law, SLOW)) == pytest.approx(1.0, abs=1e-6)


def test_asmc_is_damped() -> None:
    found = poles("asmc", SLOW)
    assert (-found.real / np.abs(found)).min() > 0.5


@pytest.mark.parametrize("law", ["apd_smc", "asmc"])
def test_an_integral_drives_no_swing(law: str) -> None:
    robot = Robot(mass=1.0, delay=0.01, force_limit=10.0, swing=3.5)
    damping, _, integral = loops(law, robot)
    assert damping - integral / robot.swing**2 == pytest.approx(0.5 * damping)
    assert loops(law, robot._replace(swing=math.inf))[2] > integral


@pytest.mark.parametrize("law", ["apd_smc", "pd_smc", "asmc"])
def test_noise_takes_its_share_of_the_force(law: str) -> None:
    robot = Robot(mass=1.5, delay=1e-3, force_limit=12.0, position_noise=0.01, velocity_noise=0.02)
    rate, reason = rate_of(law, robot)
    damping, stiffness, _ = loops(law, robot)
    direct = stiffness - LAWS_WITH_A_RULE[law].gains(robot, rate).get("adaptation_rate", 0.0) / robot.mass
    force = robot.mass * math.hypot(damping * robot.velocity_noise, direct * robot.position_noise)
    assert reason == "noise" and force == pytest.approx(NOISE_SHARE * 12.0, rel=1e-6)


def test_what_else_limits_the_rate() -> None:
    quick = Robot(mass=1.0, delay=1e-3)
    assert rate_of("apd_smc", quick) == (MOST_RATE, "the paper's rate")
    assert rate_of("apd_smc", quick._replace(force_limit=4.0, max_speed=2.0)) == (10.0, "saturation")


def test_a_gain_has_three_digits() -> None:
    assert gains_of("pd", SLOW._replace(mass=1.23456), 5.0) == {
        "derivative_gain": 6.17,
        "proportional_gain": 15.4,
        "slope": 2.5,
    }


def test_a_team_gets_the_gains_of_its_slowest() -> None:
    scenario = load_scenario(
        "main", {"robots.overrides": [{"robot": 3, "actuators": {"lag": 0.2}}, {"robot": 4, "mass": 9.0}]}
    )
    found = proposal(scenario)
    assert found is not None and found.robot == 3 and found.rate.reason == "the drive"
    assert found.about.delay == pytest.approx(0.2 + 1.5 * scenario.physics.timestep)
    sphere = proposal(load_scenario("main", {"robots.kind": "rolling_sphere"}))
    assert sphere is not None and sphere.about.mass == pytest.approx(1.4)


def test_quadrotors_no_longer_saturate() -> None:
    base = {"duration": 6, "expect": [], "robots.count": 3, "obstacles": []}
    paper, auto = (
        fly(load_scenario("robots/quadrotor", {**base, "controller": law})).measures
        for law in ("apd_smc", {"gains": "auto"})
    )
    assert paper["saturated_share"].value > 0.5 > 0.1 > auto["saturated_share"].value
    assert auto["chattering"].value < 0.25 * paper["chattering"].value
