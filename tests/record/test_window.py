import numpy as np
import pytest
import xarray
from hypothesis import given, settings
from hypothesis import strategies as st

from escort_mj.measuring import measure
from escort_mj.record.window import Span, rate_of, window
from escort_mj.signals import SIGNALS
from tests.metrics.motions import TIME
from tests.synthetic import as_recording


class TestWindows:
    def test_both_ends_are_included(self, make_trace):
        part = window(make_trace(TIME), 2.0, 4.0)
        assert (part.time.values[0], part.time.values[-1], part.sizes["time"]) == (TIME[100], TIME[200], 101)

    @pytest.mark.parametrize("rate, step", [(50.0, 0.02), (30.0, 1 / 30), (1000.0, 0.001)])
    def test_rounding_of_time_costs_no_sample(self, make_trace, rate, step):
        trace = make_trace(np.cumsum(np.full(int(10 * rate), step)))  # as a simulator adds up its clock
        part = window(trace, 2.0, 4.0)
        assert part.sizes["time"] == round(2.0 * rate) + 1

    @settings(max_examples=40)
    @given(after=st.floats(0.0, 12.0), length=st.floats(0.0, 12.0))
    def test_a_window_holds_what_lies_in_it(self, after, length):
        trace = xarray.Dataset(coords={"time": TIME}, attrs={"timestep": 1e-5})
        inside = window(trace, after, after + length).time.values
        expected = TIME[(TIME >= after - 1e-8) & (TIME <= after + length + 1e-8)]
        np.testing.assert_array_equal(inside, expected)


class TestWatchedBetweenSamples:
    """A sample tells of the steps since the one before, some of which may be before a window."""

    @pytest.mark.parametrize("read", ["recording", "xarray"])
    @pytest.mark.parametrize(("before", "least"), [(1.98, 1.0), (1.998, 0.1)])
    def test_a_window_does_not_look_back(self, make_trace, read, before, least):
        """At 2 s a sample holds 0.1 m: of a step before that, or else of the step at 2 s itself."""
        time = np.array([0.0, before, 2.0, 2.02, 2.04])
        clearance = np.array([2.0, 2.0, 0.1, 1.0, 1.5])[:, None, None] * np.ones(4)
        trace = make_trace(time, robots=2, clearance=clearance, speed_max=9.0, kinetic_energy=9.0, v=0.1)
        if read == "recording":
            trace = as_recording(trace)
        assert measure("robot_clearance_min", trace, 2.0, 2.04).value == least
        assert measure("robot_clearance_min", trace).value == 0.1
        first = window(trace, 2.0, 2.04)
        fast = 9.0 if least == 0.1 else pytest.approx(0.1 * 2**0.5)
        assert first["speed_max"].values[0, 0] == fast and first["speed_max"].values[1, 0] == 9.0
        assert trace["clearance"].values[2, 0, 0] == 0.1

    def test_every_signal_that_looks_back_is_cut(self, make_trace):
        trace = make_trace([0.0, 2.0, 2.02], robots=2, obstacles=1)
        part, whole = window(trace, 2.0), trace.isel(time=slice(1, None))
        changed = {name for name in whole if part[name].values.tobytes() != whole[name].values.tobytes()}
        looks_back = {one.name for one in SIGNALS if "since the previous sample" in one.meaning}
        looks_back -= {"watch_value"}  # recorded where an expectation asks
        assert changed | {
            "speed_max",
            "point_speed_max",
            "kinetic_energy",
            "target_speed_max",
            "obstacle_speed_max",
        } == looks_back | {
            "clearance_body",
            "target_clearance_body",
        }


class TestSpans:
    @pytest.mark.parametrize(
        ("span", "first", "last", "words"),
        [
            (Span(), 0.0, 10.0, "whole run"),
            (Span("whole"), 0.0, 10.0, "whole run"),
            (Span("tail"), 8.0, 10.0, "last fifth"),
            (Span(after=2.0), 2.0, 10.0, "after 2 s"),
            (Span(before=4.0), 0.0, 4.0, "before 4 s"),
            (Span(None, 2.0, 4.0), 2.0, 4.0, "after 2 s before 4 s"),
        ],
    )
    def test_what_they_hold_and_what_they_are_called(self, make_trace, span, first, last, words):
        time = span.of(make_trace(np.arange(501) * 0.02))["time"].values
        assert (time[0], time[-1], span.words) == (pytest.approx(first), pytest.approx(last), words)

    def test_the_rate_of_samples_is_that_of_most(self, make_trace):
        assert rate_of(make_trace([0.0, 0.02, 0.04, 0.042, 0.06, 0.08])) == pytest.approx(50.0)
        assert rate_of(make_trace([0.0])) is None
