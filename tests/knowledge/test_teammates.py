"""Where a teammate may be by now that has been heard a while ago."""

import numpy as np
import pytest

import escort_mj
from escort_mj.scenario import parse_scenario
from tests.oracle.teammates import ball

MISSION = """
name: random
seed: 4
duration: 8
axes: 2
target: {position: [sin(0.4*t), 0.3*t]}
robots: {count: 6, radius: 0.2, force_limit: 10, placement: {within: 5, least_gap: 0.5}}
obstacles: [{position: [1, 2], radius: 0.4}, {position: [-1.5, 1], radius: 0.3}]
mission:
  radius: 1.6
  max_speed: 1.5
  outer: set_based
  behaviors: [{behavior: avoid_obstacles, safe_distance: 0.3, teammates: heard}, vertices, surface]
communication: {rate: 20, delay: [0.05, 0.2], loss: 0.3}
controller: {law: apd_smc, gains: auto}
recording: {rate: 100}
"""


@pytest.mark.parametrize(
    ("age", "speed", "carried", "radius"),
    [
        (0.0, 1.0, 0.0, 0.0),
        (0.1, 1.0, 0.1, 0.5 * 10.0 * 0.1 * 0.102),
        (0.5, 1.0, 0.2, 0.5 * 10.0 * 0.2 * 0.202 + 2.0 * 0.3),
        (0.5, 3.0, 0.3, 0.5 * 10.0 * 0.3 * 0.302 + 3.0 * 0.2),
    ],
)
def test_the_ball_by_hand(age: float, speed: float, carried: float, radius: float) -> None:
    """10 m/s^2 and 2 m/s, in steps of 2 ms; a teammate that is faster than the limit may stay so."""
    found = ball(np.array(age), np.array(speed), np.array(10.0), 2.0, 0.002)
    np.testing.assert_allclose(found, (carried, radius), rtol=1e-12)


def test_a_ball_with_one_limit_only() -> None:
    age, speed = np.array(0.4), np.array(1.0)
    np.testing.assert_allclose(ball(age, speed, np.array(np.inf), 2.0, 0.0), (0.0, 0.8), atol=1e-12)
    np.testing.assert_allclose(ball(age, speed, np.array(10.0), np.inf, 0.0), (0.4, 0.8), rtol=1e-12)


def test_the_ball_contains_the_teammate(compiled: None) -> None:
    """At all ages up to 1 s, but for the errors of the law that follows what the speed limit bounds."""
    trace = escort_mj.run(parse_scenario(MISSION)).trace
    q, v = trace["q"].values, trace["v"].values
    lag = np.linalg.norm(trace["q_d"].values - q, axis=2)
    acceleration = np.sqrt(2.0) * trace["force_limit"].values / trace["robot_mass"].values
    slack = []
    for samples in (1, 2, 5, 10, 20, 50, 100):
        speed = np.linalg.norm(v[:-samples], axis=2)
        carried, radius = ball(np.array(0.01 * samples), speed, acceleration, 1.5, 0.002)
        off = np.linalg.norm(q[samples:] - q[:-samples] - carried[..., None] * v[:-samples], axis=2)
        assert (off <= radius + 2.0 * lag.max() + 1e-9).all(), samples
        slack.append((1.0 - off / radius).min())
    assert lag.max() < 0.01 and max(slack) < 0.2, "and it is no larger than it has to be"
