"""The expectation of arrival at the last goals."""

import numpy as np
import pytest

from escort_mj.expect.verdicts import judge_one
from escort_mj.expectations.reached import ReachedExpectation
from escort_mj.record.outcome import Outcome
from tests.expectations.traces import watched


def going(*distances, left=0):
    """Robot 2 that far from its goal at 0, 1, 2 ... 10 s, robot 1 at its own."""
    trace = watched()
    goal = trace["q"].values.copy()
    goal[:, 1, 1] = distances
    trace["goal"] = (("time", "robot", "axis"), goal)
    trace["goals_left"] = (("time", "robot"), np.zeros((11, 2), int))
    trace["goals_left"][:left, 0] = 1
    return trace


WAY = (3, 2, 1, 0.5, 0.2, 0.1, 0.04, -0.03, 0.02, 0.2, 0.01)


@pytest.mark.parametrize(
    ("within", "by", "before", "value", "time", "words"),
    [
        (0.25, 4.0, None, 0.2, 4.0, "from 4 s on"),
        (0.05, 6.0, 8.5, 0.04, 6.0, "from 6 s on"),
        (0.05, 6.0, None, 0.2, 9.0, "from 10 s on"),
        (0.005, 6.0, None, 0.2, 9.0, "1 of 2 robots not there at the end"),
        (5.0, 0.0, None, 3.0, 0.0, "from the start"),
    ],
)
def test_the_worst_distance_from_then_on(within, by, before, value, time, words):
    wanted = ReachedExpectation(reached=within, by=by, before=before)
    found = judge_one(wanted, going(*WAY), Outcome.COMPLETED)
    assert (found.value, found.time, found.bodies) == (pytest.approx(value), time, ("robot_2",))
    assert found.held == (value <= within) and found.margin == pytest.approx(within - value)
    assert found.found.endswith(
        f"{words}; at samples of 1 s"
    ) and found.demanded == f"within {within:g} m by {by:g} s" + (" before 8.5 s" if before else "")


def test_waypoints_left_and_no_goals():
    wanted = ReachedExpectation(reached=5.0, by=4.0)
    found = judge_one(wanted, going(*WAY, left=6), Outcome.COMPLETED)
    assert not found.held and found.found == "robot 1 has waypoints left at 4.00 s"
    assert judge_one(wanted, going(*WAY, left=4), Outcome.COMPLETED).held
    found = judge_one(wanted, watched(), Outcome.COMPLETED)
    assert not found.held and found.found == "robots have no goals"
