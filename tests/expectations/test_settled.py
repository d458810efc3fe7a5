"""Expectations of settling and of the outcome."""

import numpy as np
import pytest

from escort_mj.expect.verdicts import judge, judge_one
from escort_mj.expectations.outcome import OutcomeExpectation
from escort_mj.expectations.settled import SettledExpectation
from escort_mj.record.outcome import Outcome
from tests.expectations.traces import RADIUS, watched


def approach(*errors):
    """Robot 2 that far from the mission's radius at 0, 1, 2 ... 10 s."""
    trace = watched()
    trace["q"][:, 1, 0] = -RADIUS - np.asarray(errors, float)
    return trace


TRACE = approach(3, 2, 1, 0.5, 0.2, 0.1, 0.04, -0.03, 0.02, 0.2, 0.01)


@pytest.mark.parametrize(
    ("within", "by", "before", "value", "time", "words"),
    [
        (0.25, 4.0, None, 0.2, 4.0, "from 4 s on"),
        (0.05, 6.0, 8.5, 0.04, 6.0, "from 6 s on"),
        (0.05, 6.0, None, 0.2, 9.0, "from 10 s on"),
        (0.005, 6.0, None, 0.2, 9.0, "not settled at the end"),
        (5.0, 0.0, None, 3.0, 0.0, "from the start"),
    ],
)
def test_the_worst_error_from_then_on(within, by, before, value, time, words):
    found = judge_one(SettledExpectation(settled=within, by=by, before=before), TRACE, Outcome.COMPLETED)
    assert (found.value, found.time, found.bodies) == (pytest.approx(value), time, ("robot_2",))
    assert found.held == (value <= within)
    assert found.margin == pytest.approx(within - value)
    assert found.found.endswith(f"{words}; at samples of 1 s")
    assert found.demanded.startswith(f"within {within:g} m by {by:g} s")


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
