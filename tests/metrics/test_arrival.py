"""Metrics of arrival: three robots on lines to their goals, one by one late, astray, waiting or lost."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from escort_mj.measuring import measure
from tests.metrics.motions import TIME, steps
from tests.synthetic import make_trace

START = np.array([[0.0, 0.0], [0.0, 2.0], [0.0, 4.0]])
GOAL = START + [4.0, 0.0]


def ways(*arrivals):
    """Straight to the goals at constant speed, each there at a time, and then at rest."""
    share = np.minimum(TIME[:, None] / np.array(arrivals), 1.0)
    return START + share[..., None] * (GOAL - START)


@pytest.fixture
def traced(make_trace):
    def make(q, **given):
        return make_trace(TIME, robots=3, q=q, **({"goal": GOAL} | given))

    return make


def test_all_arrive(traced):
    trace = traced(ways(2.0, 8.0, 4.0))
    found = measure("arrival_time", trace)
    assert found.value == pytest.approx(7.82) and found.who == "robot 2"
    assert measure("arrived", trace).value == 1.0
    assert measure("path_length", trace).value == pytest.approx(4.0)
    assert measure("goal_distance_max", trace).value == pytest.approx(4.0)


def test_who_leaves_again_arrives_later(traced):
    q = ways(2.0, 2.0, 2.0)
    q[:, 2, 1] += steps(TIME, 5.0, 0.3) - steps(TIME, 6.0, 0.3)
    found = measure("arrival_time", traced(q))
    assert (found.value, found.bodies) == (pytest.approx(6.0), ("robot_3",))
    assert measure("path_length", traced(q)).value == pytest.approx(4.2)


def test_who_waits_never_arrives(traced):
    q = ways(2.0, 2.0, 2.0)
    q[:, 1] = [2.0, 2.0] + 0.01 * np.stack([np.sin(9 * TIME), np.cos(9 * TIME)], axis=1)
    found = measure("arrival_time", traced(q))
    assert (found.value, found.time, found.bodies) == (math.inf, 10.0, ("robot_2",))
    assert measure("arrived", traced(q)).value == pytest.approx(2 / 3)


def test_waypoints_left_and_losses(traced):
    left = np.zeros((len(TIME), 3))
    left[:300, 0] = 1
    found = measure("arrival_time", traced(ways(2.0, 2.0, 2.0), goals_left=left))
    assert (found.value, found.bodies) == (pytest.approx(TIME[300]), ("robot_1",))
    lost = np.zeros((len(TIME), 3))
    lost[100:, 2] = 1
    q = ways(4.0, 4.0, 40.0)
    found = measure("arrival_time", traced(q, lost=lost))
    assert (found.value, found.bodies) == (np.inf, ("robot_3",))
    assert measure("arrived", traced(q, lost=lost)).value == pytest.approx(2 / 3)


class TestAgainstTheStraightWay:
    """Robots have 4 m to go, and are there once they are within 0.1 m; the speed limit is 2 m/s."""

    @pytest.fixture
    def limited(self, traced):
        return lambda q, **given: traced(q, about={"max_speed": 2.0}, **given)

    def test_who_leaves_again_comes_later(self, limited):
        q = ways(2.0, 2.0, 2.0)
        q[:, 2, 1] += steps(TIME, 5.0, 0.3) - steps(TIME, 6.0, 0.3)
        trace = limited(q)
        assert measure("extra_time_to_goal", trace).value == pytest.approx((6.0 - 1.95) / 3.0, abs=0.02)
        assert measure("success_by_path_length", trace).value == pytest.approx((2.0 + 4.0 / 4.6) / 3.0)

    def test_who_never_comes(self, limited):
        trace = limited(ways(2.0, 40.0, 2.0))
        found = measure("extra_time_to_goal", trace)
        assert (found.value, found.bodies, found.reason) == (math.inf, ("robot_2",), "never arrives")
        assert measure("success_by_path_length", trace).value == pytest.approx(2 / 3)

    def test_without_a_speed_limit(self, traced):
        found = measure("extra_time_to_goal", traced(ways(2.0, 2.0, 2.0)))
        assert found.reason == "there is no speed limit (mission.max_speed)"

    @given(places=arrays(float, (9, 3, 2), elements=st.floats(-5.0, 5.0)))
    def test_no_way_is_shorter_than_the_straight_one(self, places):
        trace = make_trace(np.arange(9.0), robots=3, q=places, goal=places[-1])
        found = measure("success_by_path_length", trace).value
        straight, taken = (
            np.linalg.norm(np.diff(way, axis=0), axis=2).sum(axis=0) for way in (places[[0, -1]], places)
        )
        assert np.mean(straight / np.maximum(taken, 1e-300)) - 1e-9 <= found <= 1.0


def test_no_goals_no_value(make_trace):
    trace = make_trace(TIME, robots=2, truth=False)
    names = ("arrival_time", "arrived", "goal_distance_max", "extra_time_to_goal", "success_by_path_length")
    for name in names:
        assert measure(name, trace).reason == "robots have no goals"
    for name in ("radius_error_mean", "radius_error_max", "settling_time", "hull_margin"):
        assert (
            measure(name, make_trace(TIME, robots=2, about={"target_radius": 0.0})).reason
            == "there is no target"
        )


def _there(again):
    """Who is at the last of its waypoints, how far each is from its own, and which, shape (steps, robots)."""
    goal = next(b for b in again.case.keys["mission"]["behaviors"] if dict(b).get("behavior") == "goal")
    reach, there, away, goals = goal.get("reach", 0.1), [], [], []
    for robot, entry in enumerate(goal["goals"]):
        points = np.atleast_2d(entry)
        at, rows = 0, []
        for place in again.q[:, robot]:
            if at + 1 < len(points) and np.linalg.norm(place - points[at]) <= reach:
                at += 1
            rows.append((at + 1 == len(points), np.linalg.norm(place - points[at]), at))
        last, distance, which = np.array(rows).T
        there.append((last > 0) & (distance <= reach))
        away.append(distance)
        goals.append(which)
    return np.array(there).T, np.array(away).T, np.array(goals).T


def _heads(again):
    return any("goal" in str(each) for each in again.case.keys.get("mission", {}).get("behaviors", ()))


def recomputed_goal_distance_max(again):
    return float(_there(again)[1][again.tail].max()) if _heads(again) else None


def recomputed_arrival_time(again):
    if not _heads(again):
        return None
    absent = np.flatnonzero(~_there(again)[0].all(axis=1))
    return math.inf if absent[-1] == again.steps - 1 else float(again.time[absent[-1] + 1])


def recomputed_arrived(again):
    return float(_there(again)[0][-1].mean()) if _heads(again) else None


def recomputed_path_length(again):
    return float(np.linalg.norm(np.diff(again.q, axis=0), axis=2).sum(axis=0).mean())


def _ways(again):
    """When each robot is there to stay, its straight way and the way that it takes until then."""
    goal = next(b for b in again.case.keys["mission"]["behaviors"] if dict(b).get("behavior") == "goal")
    there = _there(again)[0]
    for robot, entry in enumerate(goal["goals"]):
        absent = np.flatnonzero(~there[:, robot])
        row = absent[-1] + 1 if len(absent) else 0
        legs = [np.vstack([again.q[0, robot], np.atleast_2d(entry)]), again.q[: row + 1, robot]]
        yield row, *(sum(np.linalg.norm(np.diff(leg, axis=0), axis=1)) for leg in legs)


def recomputed_extra_time_to_goal(again):
    limit = again.case.keys.get("mission", {}).get("max_speed")
    if not _heads(again) or limit is None:
        return None
    found = [
        again.time[row] - max(straight - 0.1, 0.0) / limit if row < again.steps else math.inf
        for row, straight, _ in _ways(again)
    ]
    return float(np.mean(found))


def recomputed_success_by_path_length(again):
    if not _heads(again):
        return None
    found = [
        straight / max(straight, taken) if straight and row < again.steps else float(row < again.steps)
        for row, straight, taken in _ways(again)
    ]
    return float(np.mean(found))
