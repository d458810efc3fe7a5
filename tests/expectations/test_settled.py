"""Expectations of settling, of arrival at the last goals, and of the outcome."""

import numpy as np
import pytest

from escort_mj.expect.verdicts import judge, judge_one
from escort_mj.expectations.outcome import OutcomeExpectation
from escort_mj.expectations.reached import ReachedExpectation
from escort_mj.expectations.settled import SettledExpectation
from escort_mj.record.outcome import Outcome
from tests.expectations.traces import RADIUS, watched

WAY = (3, 2, 1, 0.5, 0.2, 0.1, 0.04, -0.03, 0.02, 0.2, 0.01)
"""How far robot 2 is from where it is to be at 0, 1, 2 ... 10 s; robot 1 is there."""


def approaching():
    """To the mission's radius."""
    trace = watched()
    trace["q"][:, 1, 0] = -RADIUS - np.array(WAY)
    return trace


def going(left=0):
    """To goals; robot 1 has waypoints left in some samples."""
    trace = watched()
    goal = trace["q"].values.copy()
    goal[:, 1, 1] = WAY
    trace["goal"] = (("time", "robot", "axis"), goal)
    trace["goals_left"] = (("time", "robot"), np.zeros((11, 2), int))
    trace["goals_left"][:left, 0] = 1
    return trace


TRACE = approaching()


@pytest.mark.parametrize(
    ("within", "by", "before", "value", "time", "words"),
    [
        (0.25, 4.0, None, 0.2, 4.0, "from 4 s on"),
        (0.05, 6.0, 8.5, 0.04, 6.0, "from 6 s on"),
        (0.05, 6.0, None, 0.2, 9.0, "from 10 s on"),
        (0.005, 6.0, None, 0.2, 9.0, None),
        (5.0, 0.0, None, 3.0, 0.0, "from the start"),
    ],
)
@pytest.mark.parametrize(
    ("kind", "trace", "never"),
    [
        (SettledExpectation, TRACE, "not settled at the end"),
        (ReachedExpectation, going(), "1 of 2 robots not there at the end"),
    ],
    ids=["settled", "reached"],
)
def test_the_worst_error_from_then_on(kind, trace, never, within, by, before, value, time, words):
    found = judge_one(kind(by=by, before=before, **{kind.kind: within}), trace, Outcome.COMPLETED)
    assert (found.value, found.time, found.bodies) == (pytest.approx(value), time, ("robot_2",))
    assert found.held == (value <= within)
    assert found.margin == pytest.approx(within - value)
    assert found.found.endswith(f"{words or never}; at samples of 1 s")
    assert found.demanded == f"within {within:g} m by {by:g} s" + (" before 8.5 s" if before else "")


def test_waypoints_left_and_no_goals():
    wanted = ReachedExpectation(reached=5.0, by=4.0)
    found = judge_one(wanted, going(left=6), Outcome.COMPLETED)
    assert not found.held and found.found == "robot 1 has waypoints left at 4.00 s"
    assert judge_one(wanted, going(left=4), Outcome.COMPLETED).held
    found = judge_one(wanted, watched(), Outcome.COMPLETED)
    assert not found.held and found.found == "robots have no goals"


class TestOutcome:
    def test_nobody_has_to_ask_for_completion(self):
        first, _ = judge([SettledExpectation(settled=5.0, by=0.0)], TRACE, Outcome.DIVERGED)
        assert (first.metric, first.passed, first.expectation) == ("outcome", False, None)

    @pytest.mark.parametrize("outcome", [Outcome.COMPLETED, Outcome.DIVERGED, Outcome.UNSTABLE])
    def test_another_ending_can_be_what_is_wanted(self, outcome):
        wanted = OutcomeExpectation(outcome="diverged")
        first, second = judge([SettledExpectation(settled=5.0, by=0.0), wanted], TRACE, outcome)
        assert (first.metric, first.demanded, first.expectation) == ("outcome", "diverged", 1)
        assert first.passed == (outcome is Outcome.DIVERGED)
        assert (second.metric, second.expectation) == ("settled", 0)
