"""Robots that intercept the target: meeting points in closed form, both forms agree, and a whole pursuit."""

import math
from dataclasses import replace

import numpy as np
import pytest

from escort_mj import api
from escort_mj.behaviors import Intercept, Surface
from escort_mj.errors import ScenarioError
from escort_mj.estimators.kalman import Kalman
from escort_mj.scenario.reader.load import scenario_of
from tests.control.test_knowing import RADIOS, SIGHTS, informed
from tests.control.twins import AVOID, compare, mission
from tests.oracle.behaviors import toward_meeting


def meeting(way, course, speed: float) -> tuple[np.ndarray, float]:
    """The velocity, and how far the robot is from the target where both are nearest, searched for."""
    way, course = np.asarray(way, float), np.asarray(course, float)
    (velocity,) = toward_meeting(way[None], course[None], speed)
    return velocity, _miss(way, course - velocity)


def _miss(way: np.ndarray, drift: np.ndarray) -> float:
    square = float(drift @ drift)
    time = max(-float(way @ drift) / square, 0.0) if square else 0.0
    return float(np.linalg.norm(way + time * drift))


@pytest.mark.parametrize(
    ("way", "course", "speed", "time"),
    [
        ([3.0, 0.0], [0.0, 0.0], 2.0, 1.5),  # at rest
        ([3.0, 0.0], [-1.0, 0.0], 2.0, 1.0),  # head-on
        ([3.0, 0.0], [1.0, 0.0], 2.0, 3.0),  # a chase
        ([4.0, 0.0], [0.0, 3.0], 5.0, 1.0),  # 3, 4, 5
        ([0.0, 8.0, 0.0], [0.0, -4.0, 3.0], 5.0, 1.0),
        ([3.0, 4.0], [-2.0, 0.0], 2.0, 25.0 / 12.0),  # as fast as the robot
        ([6.0, 1.0], [-2.0, 0.0], 1.0, (12.0 - math.sqrt(33.0)) / 3.0),  # faster, on its way past the robot
    ],
)
def test_meeting_times(way, course, speed: float, time: float) -> None:
    velocity, miss = meeting(way, course, speed)
    np.testing.assert_allclose(velocity, np.add(course, np.divide(way, time)), rtol=1e-12, atol=1e-12)
    assert np.linalg.norm(velocity) == pytest.approx(speed, rel=1e-12)
    assert miss == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("axes", [2, 3])
def test_no_other_heading_comes_nearer(axes: int) -> None:
    """Robots that meet the target could not meet it earlier; the others head for where they miss it least."""
    rng, met = np.random.default_rng(axes), 0
    for _ in range(200):
        way, course = rng.normal(size=(2, axes))
        course *= rng.uniform(0.1, 1.5)
        velocity, miss = meeting(way, course, 1.0)
        assert np.linalg.norm(velocity) == pytest.approx(1.0, rel=1e-9)
        if miss > 1e-9:
            times = np.linspace(0.0, 30.0, 30001)
            reach = np.linalg.norm(way + times[:, None] * course, axis=1) - times  # beyond the robot's
            at = times[reach.argmin()]
            nearest = way + at * course
            assert reach.min() > 0.0
            assert velocity @ nearest > (1.0 - 1e-4) * np.linalg.norm(nearest)
        else:
            met += 1
            rate = float((velocity - course) @ way) / float(way @ way)
            times = np.linspace(0.0, 1.0 / rate, 100)[:-1]
            assert (np.linalg.norm(way + times[:, None] * course, axis=1) > times).all(), "no earlier meeting"
    assert 50 < met < 190


def test_the_heading_is_continuous() -> None:
    """Across the cone in which a faster target can be met, at its own speed, and at the target."""
    angle = np.linspace(0.0, 2.0 * np.pi, 20001)
    course = np.column_stack([np.cos(angle), np.sin(angle)])
    way = np.broadcast_to([2.0, 0.0], course.shape)
    for speed, most in (
        (0.7, 0.06),
        (1.0 - 1e-9, 0.06),
        (1.3, 0.002),
    ):  # square roots at the edge of the cone
        steps = np.linalg.norm(np.diff(toward_meeting(way, course, speed), axis=0), axis=1)
        assert steps.max() < most, speed
    side = np.array([[2.0, 1.0]])
    below, above = (
        toward_meeting(side, np.array([[0.5, 0.3]]) * k, math.hypot(0.5, 0.3)) for k in (1 - 1e-8, 1 + 1e-8)
    )
    np.testing.assert_allclose(below, above, atol=1e-3)
    np.testing.assert_array_equal(toward_meeting(0.0 * side, side, 1.0), side)


def test_robots_slow_down_as_far_as_they_still_meet_it() -> None:
    """The velocity relative to the target leads to it, and is the one asked for where the speed allows it."""
    rng = np.random.default_rng(5)
    way, course = rng.normal(size=(2, 4000, 2))
    course[way[:, 0] > 0.0] *= 0.3
    full, slow = (toward_meeting(way, course, 1.0, closing) for closing in (np.inf, 0.05))
    meets = np.abs(_across(full - course, way)) < 1e-9
    relative = np.linalg.norm(slow - course, axis=1)
    assert 1000 < meets.sum() < 3500 and (np.linalg.norm(slow, axis=1) < 1.0 + 1e-9).all()
    assert (np.abs(_across(slow - course, way)[meets]) < 1e-9).all()
    assert ((slow - course) * way).sum(axis=1)[meets].min() >= 0.0
    slower = np.linalg.norm(course, axis=1) < 0.95
    np.testing.assert_allclose(relative[slower], 0.05, rtol=1e-9)
    held = meets & ~slower & (relative > 0.05 + 1e-9)
    np.testing.assert_allclose(np.linalg.norm(slow[held], axis=1), 1.0, rtol=1e-9)
    assert held.sum() > 50
    np.testing.assert_array_equal(slow[~meets], full[~meets])


def _across(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / np.linalg.norm(b, axis=1)


@pytest.mark.parametrize(("axes", "max_speed"), [(2, np.inf), (3, 1.5), (5, np.inf)])
@pytest.mark.parametrize("speed", [0.6, 3.0])
def test_kernel_and_numpy_agree(axes: int, max_speed: float, speed: float) -> None:
    setup, q, v = mission(axes, seed=41)
    q[0] = setup.target.position(0.0)
    for stack in ((Intercept(speed=speed, within=2.0), Surface()), (AVOID, Intercept(speed=speed, gain=9.0))):
        compare(replace(setup, behaviors=stack, max_speed=max_speed), q, v)


def test_each_robot_goes_by_what_it_believes_of_the_target() -> None:
    setup, q, v = informed(
        2, 4, sight=SIGHTS["some, badly"], radio=RADIOS["late and lossy"], estimator=Kalman(),
        start_deviation=(0.5, 0.2, 0.1), behaviors=(Intercept(speed=1.0),),
    )  # fmt: skip
    compare(setup, q, v, steps=6)


DASH = {
    "duration": 4.0,
    "target": {"position": ["0.8*t", 0], "radius": 0.3},
    "robots": {"positions": [[4.0, 3.0], [-3.0, 0.0]], "radius": 0.2, "force_limit": None},
    "mission": {"max_speed": 1.0, "behaviors": [{"behavior": "intercept", "within": 0.6, "gain": 5}]},
}


def test_robots_catch_the_target_where_both_meet_and_go_along(compiled: None) -> None:
    """The first meets it at the intersection of its straight way with the course, the other one chases it."""
    trace = api.run(DASH).trace
    q, c = trace["q"].values, trace["target_position"].values
    late = trace["time"].values > 3.9
    gap = np.linalg.norm(q - c[:, None], axis=2)
    assert gap[late, 0] == pytest.approx(0.6, abs=0.02)
    np.testing.assert_allclose(trace["v_d"].values[late, 0], [[0.8, 0.0]] * int(late.sum()), atol=0.02)
    early = (trace["time"].values > 0.5) & (gap[:, 0] > 1.0)
    way = q[early, 0] - [4.0, 3.0]
    heading = way / np.linalg.norm(way, axis=1, keepdims=True)
    ((wanted,),) = (toward_meeting(np.array([[-4.0, -3.0]]), np.array([[0.8, 0.0]]), 1.0),)
    np.testing.assert_allclose(heading, np.broadcast_to(wanted, heading.shape), atol=0.02)
    assert gap[-1, 1] == pytest.approx(3.0 - 0.2 * 4.0, abs=0.05)


def test_what_an_interception_needs() -> None:
    for change, message in (
        ({"target": None}, "found intercept, which needs a target"),
        ({"mission": {"behaviors": ["intercept"]}}, "found intercept without a speed; give speed or"),
        ({"mission": {"behaviors": [{"behavior": "intercept", "speed": 0}]}}, "speed: found 0"),
        (
            {"mission": {"behaviors": [{"behavior": "intercept", "speed": 1, "within": -1}]}},
            "within: found -1",
        ),
    ):
        with pytest.raises(ScenarioError, match=message):
            scenario_of(DASH | change)
