import json

import numpy as np
import pytest
import xarray
from hypothesis import given, settings
from hypothesis import strategies as st

from escort_mj.record.files import write_json
from escort_mj.record.means import mean
from escort_mj.record.metrics import measure, measures_of, summarize, window
from escort_mj.record.outcome import Outcome
from escort_mj.record.recording import Recording, Variable
from escort_mj.signals import METRIC_NAMES, METRICS, SIGNALS, Metric
from tests.record.motions import RADIUS, TIME, ring, steps


class TestWindows:
    def test_both_ends_are_included(self, make_trace):
        part = window(make_trace(TIME), 2.0, 4.0)
        assert (part.time.values[0], part.time.values[-1], part.sizes["time"]) == (TIME[100], TIME[200], 101)

    @pytest.mark.parametrize("rate, step", [(50.0, 0.02), (30.0, 1 / 30), (1000.0, 0.001)])
    def test_rounding_of_time_costs_no_sample(self, make_trace, rate, step):
        trace = make_trace(np.cumsum(np.full(int(10 * rate), step)))  # as a simulator adds up its clock
        part = window(trace, 2.0, 4.0)
        assert part.sizes["time"] == round(2.0 * rate) + 1

    @settings(max_examples=40, deadline=None)
    @given(after=st.floats(0.0, 12.0), length=st.floats(0.0, 12.0))
    def test_a_window_holds_what_lies_in_it(self, after, length):
        trace = xarray.Dataset(coords={"time": TIME}, attrs={"timestep": 1e-5})
        inside = window(trace, after, after + length).time.values
        expected = TIME[(TIME >= after - 1e-8) & (TIME <= after + length + 1e-8)]
        np.testing.assert_array_equal(inside, expected)

    @pytest.mark.parametrize("name", METRIC_NAMES)
    def test_a_window_beyond_the_run_holds_nothing(self, make_trace, name):
        found = measure(name, make_trace(TIME, robots=2, obstacles=1), after=11.0)
        assert (found.value, found.reason) == (None, "the run has no sample in the window")


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
        assert changed | {"speed_max", "kinetic_energy", "target_speed_max"} == looks_back | {
            "clearance_body",
            "target_clearance_body",
        }

    @settings(max_examples=30, deadline=None)
    @given(extra=st.lists(st.integers(1, 4999), max_size=6, unique=True))
    def test_further_samples_change_no_mean(self, extra):
        """A ramp and its mean, with more samples at some places."""
        time = np.unique(np.append(np.arange(0, 5001, 10), extra)) * 0.002
        trace = xarray.Dataset(coords={"time": time}, attrs={"timestep": 0.002})
        assert mean(trace, 3.0 * time[:, None]) == pytest.approx(15.0, rel=2e-3)
        assert mean(trace, np.ones((len(time), 2))) == 1.0

    def test_a_mean_of_even_samples_is_that_of_their_values(self):
        values = np.random.default_rng(1).standard_normal((501, 3))
        values[300:, 1] = np.nan
        trace = xarray.Dataset(coords={"time": TIME}, attrs={"timestep": 0.002})
        assert mean(trace, values) == np.nanmean(values)


class TestPlugins:
    @pytest.mark.parametrize("read", ["recording", "xarray"])
    @pytest.mark.parametrize("name", ["q", "time", "robot_mass"])
    def test_a_metric_cannot_write_into_the_trace(self, make_trace, read, name):
        def writes(trace):
            """Writes."""
            trace[name].values[:] = 77.0

        trace = make_trace(TIME, robots=2)
        if read == "recording":
            trace = as_recording(trace)
        for after in (0.0, 5.0):
            found = measure(Metric("writes", "m", "writes", function=writes), trace, after)
            assert found.broken and __file__ in found.reason and "read-only" in found.reason
        assert not (trace[name].values == 77.0).any()


def as_recording(trace):
    """A trace as plain arrays."""
    coords, variables = (
        {name: Variable(tuple(one.dims), one.values.copy(), {}) for name, one in group.items()}
        for group in (trace.coords, trace.data_vars)
    )
    return Recording(dict(trace.attrs), coords, variables)


class TestSummary:
    def test_every_metric_with_unit_and_window(self, make_trace):
        trace = make_trace(TIME, robots=3, obstacles=1, q=ring(3), about={"least_energy": [3**0.5]})
        summary = summarize(measures_of(trace), trace, Outcome.COMPLETED, steps=5000, wall_time=0.5)
        assert list(summary) == ["run", *METRIC_NAMES]
        assert summary["run"] == {
            "outcome": "completed",
            "simulated_time": 10.0,
            "steps": 5000,
            "wall_time": 0.5,
            "real_time_factor": 20.0,
        }
        for metric in METRICS:
            entry = summary[metric.name]
            assert entry["unit"] == metric.unit
            assert entry["window"] == [8.0 if metric.tail else 0.0, 10.0]
            assert entry["value"] is not None, metric.name

    def test_steady_state_is_the_last_fifth(self, make_trace):
        error = steps(TIME, 7.99, -1.0) + 1.1
        trace = make_trace(TIME, q=ring(1, RADIUS + error[:, None]))
        summary = summarize(measures_of(trace), trace, Outcome.COMPLETED, 1, 1.0)
        assert summary["radius_error_max"]["value"] == pytest.approx(0.1)
        assert summary["radius_error_mean"]["value"] == pytest.approx(0.1)

    @pytest.mark.parametrize("time", [[], [0.0], [0.0, 0.02]])
    def test_a_run_that_hardly_began(self, make_trace, time, tmp_path):
        summary = summarize(measures_of(make_trace(time)), make_trace(time), Outcome.DIVERGED, 0, 0.0)
        assert summary["run"]["real_time_factor"] is None
        for name in METRIC_NAMES:
            assert summary[name]["value"] is not None or summary[name]["reason"]

    @pytest.mark.parametrize("wild", [np.inf, 1e300])
    def test_json_holds_no_nan_whatever_the_run(self, make_trace, tmp_path, wild):
        with np.errstate(all="ignore"):
            trace = make_trace(TIME, robots=2, q=wild, e=wild, effort=wild, work=TIME[:, None] * 1e307)
            summary = summarize(measures_of(trace), trace, Outcome.DIVERGED, 1, 1.0)
        for name in METRIC_NAMES:
            assert summary[name]["value"] is not None or summary[name]["reason"]
        write_json(tmp_path / "metrics.json", summary)
        assert json.loads((tmp_path / "metrics.json").read_text(), parse_constant=pytest.fail) == summary
