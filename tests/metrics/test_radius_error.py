import math

import numpy as np
import pytest

from escort_mj.measuring import measure, measures_of, summarize
from escort_mj.record.outcome import Outcome
from tests.metrics.motions import RADIUS, TIME, ring, steps


class TestRadius:
    def test_inside_counts_as_much_as_outside(self, make_trace):
        radii = RADIUS + np.array([-0.3, 0.1])
        trace = make_trace(TIME, robots=2, q=ring(2, radii))
        assert measure("radius_error_mean", trace).value == pytest.approx(0.2)
        found = measure("radius_error_max", trace)
        assert (found.value, found.who) == (pytest.approx(0.3), "robot 1")

    def test_the_largest_has_a_moment_and_a_robot(self, make_trace):
        radii = np.full((501, 3), RADIUS)
        radii[123, 2] += 0.7
        found = measure("radius_error_max", make_trace(TIME, robots=3, q=ring(3, radii)))
        assert found.value == pytest.approx(0.7)
        assert (found.time, found.who) == (TIME[123], "robot 3")


class TestSettling:
    def test_a_decaying_sine(self, make_trace):
        time = np.linspace(0.0, 20.0, 20001)
        error = 2.0 * np.exp(-time) * np.sin(7.0 * time)
        trace = make_trace(time, q=ring(1, RADIUS + error[:, None], time=time))
        found = measure("settling_time", trace)
        outside = np.abs(error) > 0.05 * RADIUS
        assert found.value == pytest.approx(time[outside][-1] + 1e-3, abs=1e-9)
        assert found.value <= math.log(2.0 / 0.25) + 2e-3  # the sine's envelope
        assert found.who == "robot 1"

    def test_the_last_robot_decides(self, make_trace):
        error = np.stack([steps(TIME, 2.0, -1.0) + 1.0, steps(TIME, 6.0, -1.0) + 1.0], axis=1)
        found = measure("settling_time", make_trace(TIME, robots=2, q=ring(2, RADIUS + error)))
        assert (found.value, found.who) == (pytest.approx(6.0), "robot 2")

    def test_a_late_excursion_counts(self, make_trace):
        error = np.where(np.abs(TIME - 8.0) < 0.09, 0.3, 0.0)
        found = measure("settling_time", make_trace(TIME, q=ring(1, RADIUS + error[:, None])))
        assert found.value == pytest.approx(8.1)

    def test_settled_from_the_start(self, make_trace):
        assert measure("settling_time", make_trace(TIME, q=ring(1, 1.049 * RADIUS))).value == 0.0

    def test_never(self, make_trace):
        trace = make_trace(TIME, q=ring(1, 1.051 * RADIUS))
        found = measure("settling_time", trace)
        assert found.value == math.inf
        assert found.reason == "never settles"
        summary = summarize(measures_of(trace), trace, Outcome.COMPLETED, 1, 1.0)["settling_time"]
        assert summary["value"] is None
        assert summary["reason"] == "never settles"
