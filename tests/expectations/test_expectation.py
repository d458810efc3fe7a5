import numpy as np

from escort_mj.expect.verdicts import judge_one
from escort_mj.expectations import EXPECTATIONS
from escort_mj.expectations.clearance import ClearanceExpectation
from escort_mj.expectations.expectation import Expectation, Judgment, Windowed
from escort_mj.record.outcome import Outcome
from tests.expectations.traces import watched


class Together(Windowed):
    """No robot is farther from another than so much."""

    kind = "together"

    together: float

    def judge(self, trace):
        """Looks at every sample."""
        q = trace["q"].values
        apart = float(np.linalg.norm(q[:, 0] - q[:, 1], axis=1).max())
        return Judgment(
            np.bool_(apart <= self.together), f"{len(q)} samples", apart, "m", margin=self.together - apart
        )


class Broken(Together):
    """Whatever it sees, it fails."""

    def judge(self, trace):
        """Not at all."""
        trace["q"].values[:] = 0.0


def test_kinds_that_ship_are_found_in_the_order_of_their_ranks() -> None:
    names = [kind.kind for kind in EXPECTATIONS]
    assert names == ["metric", "contacts", "clearance", "settled", "reached", "sanity", "outcome"]
    assert all(issubclass(kind, Expectation) for kind in EXPECTATIONS)


class TestJudging:
    def test_a_kind_is_shown_its_window(self):
        found = judge_one(Together(together=11.0, after=2.0, before=5.0), watched(), Outcome.COMPLETED)
        assert found.message == "together 11.0 after 2 s before 5 s: 4 samples; at samples of 1 s"
        assert (found.passed, found.margin, found.unit) == (True, 1.0, "m")

    def test_a_window_without_a_sample_is_not_judged(self):
        found = judge_one(Together(together=11.0, after=20.0), watched(), Outcome.COMPLETED)
        assert found.message == "together 11.0 after 20 s: the run has no sample in the window"
        assert not found.passed and not found.broken

    def test_an_error_is_no_verdict(self):
        found = judge_one(Broken(together=11.0, xfail="it is broken"), watched(), Outcome.COMPLETED)
        assert found.broken and not found.passed and f"{__file__}:" in found.message

    def test_bodies_are_those_of_the_run(self):
        class Ghost(Together):
            def judge(self, trace):
                return Judgment(True, "seen", bodies=("ghost",))

        found = judge_one(Ghost(together=11.0), watched(), Outcome.COMPLETED)
        assert found.broken and "bodies: found 'ghost', which is no body of this run" in found.message

    def test_so_it_is_of_a_kind_that_ships(self):
        trace = watched().drop_vars("clearance")
        found = judge_one(
            ClearanceExpectation(clearance=("robots", "rock"), at_least=1), trace, Outcome.COMPLETED
        )
        assert found.broken and "touches.py" not in found.message and "clearance.py:" in found.message
