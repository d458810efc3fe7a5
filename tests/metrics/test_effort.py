import math

import numpy as np
import pytest

from escort_mj.measuring import measure
from tests.metrics.motions import TIME


class TestTotals:
    """Running totals, written at every physics step, are differenced over the window."""

    def test_a_sine_force_between_samples(self, make_trace):
        # 2 sin(w t) N at 1000 steps a second, sampled once a second: the samples alone would miss it all.
        dt, w = 1e-3, 2.0 * math.pi
        fine = np.arange(0.0, 10.0 + dt / 2.0, dt)
        force = 2.0 * np.sin(w * fine)
        keep = slice(None, None, 1000)
        effort = (dt * np.cumsum(force**2))[keep, None]
        variation = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(force)))])[keep, None]
        trace = make_trace(fine[keep], effort=effort, force_variation=variation)
        assert measure("force_rms", trace).value == pytest.approx(math.sqrt(2.0), rel=1e-9)
        assert measure("chattering", trace).value == pytest.approx(8.0, rel=1e-4)  # 4 amplitudes a period
        assert measure("force_rms", trace, after=3.0, before=5.0).value == pytest.approx(math.sqrt(2.0))

    def test_a_window_counts_what_was_gained_in_it(self, make_trace):
        ramp = np.stack([TIME, 3.0 * TIME], axis=1)
        trace = make_trace(TIME, robots=2, work=ramp, saturated_time=ramp / 4.0, effort=ramp)
        assert measure("energy", trace).value == pytest.approx(40.0)
        assert measure("energy", trace, after=4.0, before=6.0).value == pytest.approx(8.0)
        assert measure("saturated_share", trace, after=4.0).value == pytest.approx(0.5)
        assert measure("force_rms", trace, before=5.0).value == pytest.approx(math.sqrt(2.0))

    @pytest.mark.parametrize("name", ["force_rms", "chattering", "energy", "saturated_share"])
    def test_one_sample_spans_no_time(self, make_trace, name):
        found = measure(name, make_trace([0.0]))
        assert (found.value, found.reason) == (None, "the window holds a single sample")

    def test_windows_add_up(self, make_trace):
        total = np.cumsum(np.random.default_rng(1).random((501, 2)), axis=0)
        trace = make_trace(TIME, robots=2, work=total)
        parts = [measure("energy", trace, a, b).value for a, b in ((0.0, 3.0), (3.0, 7.5), (7.5, None))]
        assert sum(parts) == pytest.approx(measure("energy", trace).value, rel=1e-12)
