"""The terminal sliding mode: its surface reaches zero in finite time, and it settles a mission."""

import numpy as np
import pytest

from escort_mj import api
from escort_mj.laws.terminal_smc import TerminalSmc


def test_on_its_surface_the_error_vanishes_in_finite_time() -> None:
    """Integrated on z = 0: from 1 m the exact time is the integral of (b / (e + a e^2))^(2/3) de."""
    law, e, t, step = TerminalSmc(), 1.0, 0.0, 1e-4
    while e > 1e-9:
        rate = ((e + law.far_gain * e * e) / law.near_gain) ** (2.0 / 3.0)
        e, t = e - step * rate, t + step
    grid = np.linspace(0.0, 1.0, 200_001)[1:] ** 3  # finer where the integrand has its pole
    exact = np.trapezoid((law.near_gain / (grid + law.far_gain * grid**2)) ** (2.0 / 3.0), grid)
    assert t == pytest.approx(exact, rel=1e-2)


def test_it_escorts_against_a_disturbance() -> None:
    changes = ["controller=terminal_smc", "duration=30", "expect=[]", "obstacles=[]"]
    run = api.run(api.load_scenario("main", [*changes, "uncertainty.disturbance=[2*sin(t), 1]"]))
    assert run.message == "completed 30 s"
    assert run.values["radius_error_max"] < 0.02
