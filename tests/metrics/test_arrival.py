"""Metrics of arrival: three robots on lines to their goals, one by one late, astray, waiting or lost."""

import math

import numpy as np
import pytest

from escort_mj.measuring import measure
from tests.metrics.motions import TIME, steps

START = np.array([[0.0, 0.0], [0.0, 2.0], [0.0, 4.0]])
GOAL = START + [4.0, 0.0]


def ways(*arrivals):
    """Straight to the goals at constant speed, each there at a time, and then at rest."""
    share = np.minimum(TIME[:, None] / np.array(arrivals), 1.0)
    return START + share[..., None] * (GOAL - START)


@pytest.fixture
def traced(make_trace):
    def make(q, **given):
        return make_trace(TIME, robots=3, q=q, goal=GOAL, **given)

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


def test_no_goals_no_value(make_trace):
    trace = make_trace(TIME, robots=2, truth=False)
    for name in ("arrival_time", "arrived", "goal_distance_max"):
        assert measure(name, trace).reason == "robots have no goals"
    for name in ("radius_error_mean", "radius_error_max", "settling_time", "hull_margin"):
        assert (
            measure(name, make_trace(TIME, robots=2, about={"target_radius": 0.0})).reason
            == "there is no target"
        )


def _there(again):
    """Who is at the last of its waypoints, and how far each is from its own, shape (steps, robots)."""
    goal = next(b for b in again.case.keys["mission"]["behaviors"] if dict(b).get("behavior") == "goal")
    reach, there, away = goal.get("reach", 0.1), [], []
    for robot, entry in enumerate(goal["goals"]):
        points = np.atleast_2d(entry)
        at, rows = 0, []
        for place in again.q[:, robot]:
            if at + 1 < len(points) and np.linalg.norm(place - points[at]) <= reach:
                at += 1
            rows.append((at + 1 == len(points), np.linalg.norm(place - points[at])))
        last, distance = np.array(rows).T
        there.append((last > 0) & (distance <= reach))
        away.append(distance)
    return np.array(there).T, np.array(away).T


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
