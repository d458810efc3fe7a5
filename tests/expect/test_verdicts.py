import json
import math
from dataclasses import asdict

import numpy as np
import pytest
import xarray
from hypothesis import given, settings
from hypothesis import strategies as st

from escort_mj.expect.verdicts import judge, verdict_lines
from escort_mj.expectations.clearance import ClearanceExpectation
from escort_mj.expectations.metric import MetricExpectation as Expectation
from escort_mj.files import write_json
from escort_mj.metrics import METRIC_NAMES
from escort_mj.metrics.measure import Measure
from escort_mj.metrics.metric import Metric
from escort_mj.record.outcome import Outcome
from escort_mj.record.recording import NONE, episode_variables
from tests.expectations.traces import watched

RADIUS = 5.0


def escort(errors, end=10.0):
    """Robots at the radius plus an error, shape (time,) or (time, robot), from a target at 0."""
    errors = np.asarray(errors, float)
    errors = errors[:, None] if errors.ndim == 1 else errors
    q = np.zeros((*errors.shape, 2))
    q[..., 0] = RADIUS + errors
    rows, robots = errors.shape
    return xarray.Dataset(
        {
            "q": (("time", "robot", "axis"), q),
            "target_position": (("time", "axis"), np.zeros((rows, 2))),
            "work": (("time", "robot"), np.zeros((rows, robots))),
            "lost": (("time", "robot"), np.zeros((rows, robots), int)),
            "neighbors": (("edge", "end"), np.zeros((0, 2), int)),
            "spacing": ("edge", np.zeros(0)),
        }
        | episode_variables(NONE),
        coords={"time": np.linspace(0.0, end, rows), "obstacle": np.zeros(0, str)}
        | {"body_group": ("body", ["robots"] * robots)},
        attrs={"mission_radius": RADIUS, "timestep": 0.002},
    )


def expect(metric="radius_error_max", **bounds):
    return Expectation(metric=metric, **bounds)


def verdict(trace, expectation, outcome=Outcome.COMPLETED):
    _, found = judge([expectation], trace, outcome)
    return found


class TestBounds:
    @pytest.mark.parametrize(
        "bounds, margin, passed, near",
        [
            ({"at_most": 1.0}, 0.5, True, False),
            ({"at_most": 0.52}, 0.02, True, True),
            ({"at_most": 0.5}, 0.0, True, True),
            ({"at_most": 0.4}, -0.1, False, False),
            ({"at_least": 0.25}, 0.25, True, False),
            ({"at_least": 0.49}, 0.01, True, True),
            ({"at_least": 0.75}, -0.25, False, False),
            ({"at_least": 0.25, "at_most": 1.0}, 0.25, True, False),
            ({"at_least": 0.25, "at_most": 0.51}, 0.01, True, True),
            ({"at_least": 0.75, "at_most": 1.0}, -0.25, False, False),
        ],
    )
    def test_margin_and_near_miss(self, bounds, margin, passed, near):
        found = verdict(escort([0.0, 0.5, 0.0]), expect(**bounds))
        assert found.value == pytest.approx(0.5)
        assert found.margin == pytest.approx(margin, abs=1e-12)
        assert (found.passed, found.near_miss) == (passed, near)
        assert ("near miss" in found.message) == near

    def test_a_bound_of_zero_has_no_near_miss(self):
        found = verdict(escort([0.0, 0.0]), expect("contacts", at_most=0))
        assert (found.value, found.margin, found.passed, found.near_miss) == (0.0, 0.0, True, False)

    def test_a_ratio_that_is_never_below_one_is_near_by_what_is_above_one(self, monkeypatch):
        monkeypatch.setattr(Metric, "of", lambda *args: Measure(1.0004))
        trace = escort([0.0, 0.0])
        assert not verdict(trace, expect("energy_ratio", at_most=1.001)).near_miss
        assert verdict(trace, expect("energy_ratio", at_most=1.00041)).near_miss

    @settings(max_examples=60)
    @given(value=st.floats(0.0, 4.0), bound=st.floats(-4.0, 4.0))
    def test_the_two_bounds_are_each_others_complement(self, value, bound):
        trace = escort([0.0, value])
        most, least = verdict(trace, expect(at_most=bound)), verdict(trace, expect(at_least=bound))
        assert most.margin == -least.margin
        assert most.passed == (most.value <= bound)
        assert least.passed == (least.value >= bound)
        assert not (most.near_miss and not most.passed)


class TestWords:
    def test_what_was_demanded_and_found_by_whom_and_when(self):
        errors = np.zeros((11, 3))
        errors[4, 1] = 0.25
        found = verdict(escort(errors), expect(at_most=0.125, after=2.0, before=8.0))
        assert found.metric == "radius_error_max"
        assert found.demanded == "at most 0.125 m after 2 s before 8 s"
        assert (found.unit, found.time, found.who) == ("m", 4.0, "robot 2")
        assert (
            found.message
            == "radius_error_max at most 0.125 m after 2 s before 8 s: 0.25 m (robot 2 at 4.00 s); "
            "at samples of 1 s"
        )

    def test_numbers_without_unit(self):
        found = verdict(escort([0.0, 0.0]), expect("contacts", at_most=3))
        assert found.message == "contacts at most 3: 0"

    def test_never(self):
        found = verdict(escort([1.0, 1.0]), expect("settling_time", at_most=5.0))
        assert (found.value, found.margin, found.passed) == (math.inf, -math.inf, False)
        assert found.message == "settling_time at most 5 s: never (robot 1 at 10.00 s); at samples of 10 s"

    def test_a_table(self):
        expectations = [expect(at_most=1.0), expect("settling_time", at_least=3.0, at_most=4.0, before=9.0)]
        lines = verdict_lines(judge(expectations, escort([0.0, 0.5, 0.0]), Outcome.COMPLETED))
        assert lines == [
            "  pass  outcome           completed                              completed",
            "  pass  radius_error_max  at most 1 m                            0.5 m (robot 1 at 5.00 s); "
            "at samples of 5 s",
            "  FAIL  settling_time     at least 3 and at most 4 s before 9 s  never (robot 1 at 5.00 s); "
            "at samples of 5 s",
        ]

    def test_an_empty_table(self):
        assert verdict_lines([]) == []


class TestRunsThatBreak:
    @pytest.mark.parametrize("outcome", Outcome)
    def test_the_outcome_is_the_first_verdict(self, outcome):
        first, second = judge([expect(at_most=1.0)], escort([0.0, 0.0]), outcome)
        assert first.metric == "outcome"
        assert first.passed == outcome.good
        assert outcome.value in first.message
        assert outcome.good or outcome.meaning in first.message
        assert second.passed

    @pytest.mark.parametrize("outcome", [Outcome.DIVERGED, Outcome.COMPLETED])
    def test_a_window_without_a_sample_fails_and_says_so(self, outcome):
        found = verdict(escort([0.0] * 11), expect(at_most=1.0, after=10.5, before=12.0), outcome)
        assert not found.passed
        assert found.value is None
        assert found.margin is None
        assert found.message.endswith("the run has no sample in the window")

    def test_a_window_that_the_run_broke_off_in_fails(self):
        expectation = expect(at_most=1.0, after=5.0, before=12.0)
        found = verdict(escort([0.0] * 11), expectation, Outcome.DIVERGED)
        assert not found.passed
        assert found.message.endswith("the run ended at 10 s, inside the window")

    def test_a_last_step_just_short_of_the_end_is_no_early_end(self):
        # Steps are 2 ms long: none is at 10.0005 s.
        assert verdict(escort([0.0] * 11), expect(at_most=1.0, before=10.0005), Outcome.DIVERGED).passed
        assert not verdict(escort([0.0] * 11), expect(at_most=1.0, before=10.002), Outcome.DIVERGED).passed

    def test_what_is_watched_between_samples_is_not_known_of_any_window(self):
        """A second between samples: a run that nobody asked to look there knows nothing of 4.5 s."""
        near = ClearanceExpectation(clearance=("robots", "target"), at_least=0.1, after=4.0, before=5.0)
        assert verdict(watched(), near).held
        for window, missing in [((4.5, 6.0), 4.5), ((4.0, 5.5), 5.5), ((4.0, 4.001), 3.998)]:
            after, before = window
            found = verdict(watched(), near.model_copy(update={"after": after, "before": before}))
            assert not found.held
            assert f"the run has no sample at {missing:g} s, at an end of the window" in found.message
        assert verdict(watched(), expect(at_most=1.0, after=4.5, before=5.5)).held

    def test_a_run_without_any_sample(self):
        found = verdict(escort(np.zeros((0, 2))), expect(at_most=1.0), Outcome.FAILED)
        assert not found.passed

    @pytest.mark.parametrize("metric", ["obstacle_distance_min", "robot_distance_min", "spacing_error_max"])
    @pytest.mark.parametrize("bounds", [{"at_most": 1.0}, {"at_least": 0.1}])
    def test_a_metric_that_says_nothing_of_this_run_fails(self, metric, bounds):
        found = verdict(escort([0.0, 0.0]), expect(metric, **bounds))
        assert (found.value, found.passed) == (None, False)
        assert "there " in found.message or "no formation" in found.message


def test_verdicts_are_json_without_nan(tmp_path):
    verdicts = judge([expect("settling_time", at_most=1.0)], escort([1.0, 1.0]), Outcome.KILLED)
    write_json(tmp_path / "verdicts.json", [asdict(one) for one in verdicts])
    back = json.loads((tmp_path / "verdicts.json").read_text(), parse_constant=pytest.fail)
    assert back[1]["value"] is None
    assert back[1]["passed"] is False


def test_every_metric_can_be_expected():
    for name in METRIC_NAMES:
        assert Expectation(metric=name, at_most=1.0).metric == name
