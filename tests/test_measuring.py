import json

import numpy as np
import pytest

from escort_mj.files import write_json
from escort_mj.measuring import measure, measures_of, summarize
from escort_mj.metrics import METRIC_NAMES, METRICS
from escort_mj.metrics.metric import Metric
from escort_mj.record.outcome import Outcome
from tests.metrics.motions import RADIUS, TIME, ring, steps


class TestSummary:
    def test_every_metric_with_unit_and_window(self, make_trace):
        there = {"q": ring(3), "goal": ring(3), "target_covariance": np.eye(2), "opponent_status": 1}
        about = {"least_energy": [3**0.5], "max_speed": 1.0, "tethers": [1, 2], "tether_length": [1.0]}
        trace = make_trace(TIME, robots=3, obstacles=1, about=about, v=1.0, **there)
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
            assert entry["meaning"] == metric.meaning
            assert (entry["over"], entry["window"]) == (
                metric.over,
                [8.0 if metric.over == "tail" else 0.0, 10.0],
            )
            assert entry["rate"] == pytest.approx(500.0 if metric.every_step else 50.0)
            assert entry["value"] is not None or entry["infinite"], metric.name

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

    @pytest.mark.parametrize("name", METRIC_NAMES)
    def test_a_window_beyond_the_run_holds_nothing(self, make_trace, name):
        found = measure(name, make_trace(TIME, robots=2, obstacles=1), after=11.0)
        assert (found.value, found.reason) == (None, "the run has no sample in the window")


class TestDearOnes:
    """What takes long is measured where it is wanted."""

    dear = Metric("dear", "1", "dear", lambda trace: 3.0, dear=lambda trace: trace.sizes["time"] > 100)

    def test_it_has_a_reason_in_place_of_a_value(self, make_trace):
        (found,) = measures_of(make_trace(TIME), [self.dear]).values()
        assert found.value is None and "takes long" in found.reason and not found.broken

    def test_it_is_measured_where_it_is_wanted_or_quick(self, make_trace):
        assert measures_of(make_trace(TIME), [self.dear], {"dear"})["dear"].value == 3.0
        assert measures_of(make_trace(TIME[:100]), [self.dear])["dear"].value == 3.0
        assert measure(self.dear, make_trace(TIME)).value == 3.0
