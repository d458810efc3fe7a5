import numpy as np
import pytest

from escort_mj.measuring import measure
from escort_mj.monitor.signals import CAUSES
from tests.metrics.motions import TIME


class TestTruth:
    def test_a_rise_of_the_lyapunov_function_counts_from_its_least(self, make_trace):
        """V1 falls to 2, rises to 2.8 for no known reason and by 5 more with the reference, and falls."""
        value = np.full((501, 1), 10.0)
        value[100:] = 2.0
        value[200:] = 2.8
        change = np.zeros((501, 1, 7))
        change[300:, 0, CAUSES.index("reference")] = 5.0
        value[300:] += 5.0
        found = measure("lyapunov_rise", make_trace(TIME, lyapunov=value, lyapunov_change=change))
        assert (found.value, found.who) == (pytest.approx(0.8), "robot 1")
        assert found.time == pytest.approx(4.0)
        unbooked = measure("lyapunov_rise", make_trace(TIME, lyapunov=value))
        assert unbooked.value == pytest.approx(5.8)

    def test_what_is_unexplained_does_not_cancel(self, make_trace):
        change = np.zeros((501, 2, 7))
        change[:, 0, CAUSES.index("unexplained")] = 0.3 * np.sin(np.pi * TIME / 5.0)  # up, down, back: 1.2
        change[:, 1, CAUSES.index("dissipation")] = -TIME
        trace = make_trace(TIME, robots=2, lyapunov_change=change)
        assert measure("lyapunov_unexplained", trace).value == pytest.approx(1.2, abs=1e-3)
        assert measure("lyapunov_unexplained", trace, 2.5, 7.5).value == pytest.approx(0.6, abs=1e-3)

    def test_what_was_not_recorded_is_said(self, make_trace):
        names = ("mass_eigenvalue_min", "mass_eigenvalue_max", "skew_residual", "coriolis_residual")
        blind = make_trace(TIME, truth=False)
        for name in (*names, "lyapunov_rise", "lyapunov_unexplained"):
            found = measure(name, blind)
            assert found.value is None and "recording.truth" in found.reason
        other_law = make_trace(TIME).drop_vars(["lyapunov", "lyapunov_change"])
        for name in ("lyapunov_rise", "lyapunov_unexplained"):
            assert "sliding-mode" in measure(name, other_law).reason
