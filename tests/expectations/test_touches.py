"""Expectations of contacts and clearances, on traces whose touches are known."""

import pytest

from escort_mj.expect.verdicts import judge_one
from escort_mj.expectations.clearance import ClearanceExpectation
from escort_mj.expectations.contacts import ContactExpectation
from escort_mj.measuring import measure
from escort_mj.record.outcome import Outcome
from tests.expectations.traces import episode, watched

TOUCHES = (
    episode("robot_1", "rock", 3.0, long=0.1, force=2.0),
    episode("robot_2", "wall_1", 5.0, long=1.0, force=7.0, depth=2e-3),
    episode("robot_1", "robot_2", 8.0, long=0.002, force=40.0),
    episode("robot_1", "floor", 0.0, long=10.0, force=9.81),
)


def contacts(sides, trace=None, outcome=Outcome.COMPLETED, **bounds):
    return judge_one(
        ContactExpectation(contacts=sides, **bounds), watched(*TOUCHES) if trace is None else trace, outcome
    )


class TestWhoTouches:
    @pytest.mark.parametrize(
        ("sides", "count", "bodies"),
        [
            ("none", 3, ("robot_1", "rock")),
            (("robots", "obstacles"), 1, ("robot_1", "rock")),
            (("obstacles", "robots"), 1, ("robot_1", "rock")),
            (("robots", "walls"), 1, ("robot_2", "wall_1")),
            (("robots", "robots"), 1, ("robot_1", "robot_2")),
            (("robots", "floor"), 1, ("robot_1", "floor")),
            (("robot_1", "robots"), 1, ("robot_1", "robot_2")),
            (("robot_2", "obstacles"), 0, ()),
            (("robot_2", "wall_1"), 1, ("robot_2", "wall_1")),
            (("robots", "target"), 0, ()),
            (("target", "rock"), 0, ()),
        ],
    )
    def test_only_the_pairs_that_are_meant_count(self, sides, count, bodies):
        found = contacts(sides)
        assert (found.value, found.bodies, found.held) == (count, bodies, count == 0)
        assert found.margin == -count

    def test_all_of_it_in_words(self):
        found = contacts(("robots", "obstacles"))
        assert found.metric == "contacts robots/obstacles"
        assert found.demanded == "at most 0"
        assert found.time == 3.0
        assert found.found == "1 (robot 1 and rock at 3.000 s: 100 ms, up to 2 N, 0.1 N s, 1 mm deep)"
        assert contacts("none").found.endswith("deep, the first)")


class TestBounds:
    @pytest.mark.parametrize(
        ("bounds", "value", "unit", "time", "bodies"),
        [
            ({"touch_time": 0.5}, 1.0, "s", 5.0, ("robot_2", "wall_1")),
            ({"peak_force": 30.0}, 40.0, "N", 8.001, ("robot_1", "robot_2")),
            ({"impulse": 3.0}, 3.5, "N s", 5.0, ("robot_2", "wall_1")),
            ({"penetration": 1.5e-3}, 2e-3, "m", 5.5, ("robot_2", "wall_1")),
            ({"at_most": 2}, 3.0, "", 3.0, ("robot_1", "rock")),
        ],
    )
    def test_each_finds_its_worst_touch(self, bounds, value, unit, time, bodies):
        found = contacts("any", **bounds)
        assert not found.held
        assert (found.value, found.unit, found.bodies) == (pytest.approx(value), unit, bodies)
        assert found.time == pytest.approx(time)
        (bound,) = bounds.values()
        assert found.margin == pytest.approx(bound - value)

    def test_a_bound_on_force_allows_any_number(self):
        assert contacts("any", peak_force=40.0).held
        assert contacts("any", peak_force=40.0, touch_time=1.0, impulse=3.5, penetration=2e-3).held

    def test_of_several_bounds_the_tightest_counts(self):
        found = contacts("any", peak_force=50.0, touch_time=1.0, at_most=20)
        assert (found.held, found.near_miss, found.unit) == (True, True, "s")
        assert found.demanded == "at most 20, touch time at most 1 s, peak force at most 50 N"
        share = contacts("any", peak_force=80.0, impulse=17.5)
        assert share.unit == "N", "half of its bound is left, and more of the other"
        found = contacts("any", peak_force=39.0, touch_time=0.5)
        assert (found.held, found.unit) == (False, "s")

    def test_at_least(self):
        assert contacts(("robots", "obstacles"), at_least=1).held
        found = contacts(("robots", "target"), at_least=1)
        assert (found.held, found.value, found.margin) == (False, 0.0, -1.0)


class TestWindows:
    @pytest.mark.parametrize(
        ("after", "before", "count"),
        [
            (0.0, None, 3),
            (3.05, None, 3),
            (3.2, None, 2),
            (3.2, 4.9, 0),
            (0.0, 3.0, 1),
            (0.0, 2.9, 0),
            (8.5, None, 0),
        ],
    )
    def test_a_touch_belongs_to_every_window_that_it_reaches_into(self, after, before, count):
        assert contacts("none", after=after, before=before).value == count

    def test_of_its_time_only_what_lies_in_the_window(self):
        found = contacts(("robots", "walls"), touch_time=0.1, after=5.25, before=5.5)
        assert found.value == pytest.approx(0.25)

    def test_a_run_that_broke_off_in_the_window_proves_nothing(self):
        bounds = {"after": 8.5, "before": 30.0}
        found = contacts("none", outcome=Outcome.DIVERGED, **bounds)
        assert (found.held, found.value) == (False, None)
        assert found.found == "the run ended at 10 s, inside the window"
        found = contacts("none", outcome=Outcome.DIVERGED, after=7.5, before=30.0)
        assert (found.held, found.value) == (False, 1.0)  # what went wrong before is told


def clearance(sides, trace, at_least=0.1, **window):
    expectation = ClearanceExpectation(clearance=sides, at_least=at_least, **window)
    return judge_one(expectation, trace, Outcome.COMPLETED)


class TestClearance:
    TRACE = watched(
        clearance=[
            (4, 0, "obstacles", 0.05, "rock"),
            (4, 0, "rock", 0.05, "rock"),
            (6, 1, "walls", 0.102, "wall_1"),
            (7, 1, "robots", 0.2, "robot_1"),
            (7, 0, "robots", 0.2, "robot_2"),
            (2, 0, "target", 0.5, "target"),
        ],
        target_clearance=[(9, "obstacles", 0.7, "rock"), (9, "rock", 0.7, "rock")],
    )

    @pytest.mark.parametrize(
        ("sides", "value", "time", "bodies"),
        [
            (("robots", "obstacles"), 0.05, 4.0, ("robot_1", "rock")),
            (("obstacles", "robots"), 0.05, 4.0, ("robot_1", "rock")),
            (("robots", "rock"), 0.05, 4.0, ("robot_1", "rock")),
            (("robot_1", "rock"), 0.05, 4.0, ("robot_1", "rock")),
            (("robot_2", "obstacles"), 3.0, 0.0, ("robot_2", "rock")),
            (("robots", "walls"), 0.102, 6.0, ("robot_2", "wall_1")),
            (("robots", "robots"), 0.2, 7.0, ("robot_1", "robot_2")),
            (("robot_2", "robots"), 0.2, 7.0, ("robot_2", "robot_1")),
            (("target", "robots"), 0.5, 2.0, ("robot_1", "target")),
            (("target", "obstacles"), 0.7, 9.0, ("target", "rock")),
            (("rock", "target"), 0.7, 9.0, ("target", "rock")),
        ],
    )
    def test_the_nearest_of_the_pairs_that_are_meant(self, sides, value, time, bodies):
        found = clearance(sides, self.TRACE)
        assert (found.value, found.time, found.bodies) == (value, time, bodies)
        assert found.margin == pytest.approx(value - 0.1)
        assert found.held == (value >= 0.1)

    def test_near_misses_and_windows(self):
        found = clearance(("robots", "walls"), self.TRACE)
        assert found.held and found.near_miss and found.found.endswith("a near miss")
        assert clearance(("robots", "obstacles"), self.TRACE, after=5.0).held

    def test_what_was_not_recorded_is_no_pass(self):
        found = clearance(("robots", "wall_1"), self.TRACE)
        assert (found.held, found.value) == (False, None)
        assert "were not recorded" in found.found

    def test_no_touch_but_almost(self):
        trace = watched(clearance=[(4, 1, "walls", 0.004, "wall_1")])
        found = contacts(("robots", "walls"), trace)
        assert found.held and found.near_miss
        assert found.found == "none, a near miss: 4 mm (robot 2 and wall_1 by 4.00 s)"
        assert not contacts(("robots", "walls"), trace, after=5.0).near_miss
        assert contacts("none", trace).near_miss
        deeper = watched(clearance=[(4, 1, "walls", -0.001, "wall_1")])  # touched before the window
        assert contacts(("robots", "walls"), deeper).found == "none"
        assert not contacts(("robots", "obstacles"), trace).near_miss


def test_a_log_that_was_too_small_proves_nothing():
    trace = watched(contacts_untold=[0, 0, 0, 0, 0, 0, 7, 7, 7, 7, 7])
    found = contacts("none", trace)
    assert not found.held and found.found == "the contact log had no room for 7 contacts"
    assert contacts("none", trace, after=6.0).held


class TestKnownToFail:
    def test_it_passes_as_long_as_it_fails(self):
        found = contacts("none", xfail="the rock is in the way")
        assert (found.held, found.passed, found.xfail) == (False, True, "the rock is in the way")
        assert found.message.endswith("; expected failure: the rock is in the way")

    def test_it_fails_as_soon_as_it_holds(self):
        found = contacts(("robots", "target"), xfail="the rock is in the way")
        assert (found.held, found.passed) == (True, False)
        assert found.message.endswith("; passed, but failure was expected: the rock is in the way")


class TestByGeometry:
    """Touches of a target that is led with what stands: MuJoCo never sees them."""

    trace = watched(episode("target", "rock", 3.0, long=0.1, force=0.0, depth=0.9))

    @pytest.mark.parametrize("sides", ["none", ("target", "obstacles"), ("target", "rock")])
    def test_they_count_and_the_verdict_says_how_they_were_found(self, sides):
        found = contacts(sides, self.trace)
        assert not found.held
        assert found.found == (
            "1 (target and rock at 3.000 s: 100 ms, 900 mm deep, by geometry, which knows no force)"
        )

    def test_where_nothing_was_found_the_verdict_says_by_what(self):
        assert contacts(("target", "wall_1"), self.trace).found == "none, by geometry"
        assert contacts(("robots", "rock"), self.trace).found == "none"

    @pytest.mark.parametrize("bound", ["peak_force", "impulse"])
    def test_a_bound_on_their_force_is_not_met(self, bound):
        found = contacts(("target", "rock"), self.trace, **{bound: 1e9})
        assert not found.held and found.value is None
        assert found.found == "touches were found by geometry, which knows no force"
        assert contacts(("target", "rock"), self.trace, penetration=1.0).held

    def test_the_largest_force_is_not_known(self):
        assert measure("contact_force_max", self.trace).value is None
        assert measure("contacts", self.trace).value == 1.0
