"""The disturbance observer: its estimate against the closed form, its memory in teams of several laws."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import escort_mj
from escort_mj.mission.batch import fly_many
from escort_mj.report.figures.figures import figure_of, plots_of
from escort_mj.report.figures.memory import truth_of

STEP = 0.002
FORCE = (2.0, -1.0, 0.5)


def flown(axes: int = 2, **changes: Any) -> Any:
    """Fly a short mission without noise under a constant force, recorded at each step."""
    keys = {
        "axes": axes, "duration": 1.0, "recording.rate": 500, "robots.count": 3,
        "uncertainty.disturbance": FORCE[:axes], "controller": {"law": "disturbance_observer"},
    }  # fmt: skip
    (flight,) = fly_many([escort_mj.Scenario().replace(keys | changes)], 1, traces=True)
    assert flight.outcome.good, flight.message
    return flight.trace


def memory(trace: Any, name: str = "disturbance_observer.d_hat") -> np.ndarray:
    return np.asarray(trace["component_memory"].sel(memory=name).values)


def closed_form(bandwidth: float, steps: int, axes: int = 2) -> np.ndarray:
    """What follows a constant at a rate, by steps, and one step late."""
    left = (1.0 - bandwidth * STEP) ** np.maximum(np.arange(steps) - 1.0, 0.0)
    return np.asarray((1.0 - left)[:, None, None] * FORCE[:axes])


@settings(max_examples=8)
@given(st.floats(0.5, 40.0), st.floats(0.3, 4.0), st.sampled_from([2.0, 1e3]), st.integers(2, 3))
def test_the_estimate_of_a_constant_converges_exponentially(
    bandwidth: float, mass: float, limit: float, axes: int
) -> None:
    """Whatever the control does: some of these motors are at their limits all the time."""
    law = {"law": "disturbance_observer", "bandwidth": bandwidth, "mass": mass}
    trace = flown(axes, controller=law, **{"robots.mass": mass, "robots.force_limit": limit})
    found = memory(trace)
    expected = np.broadcast_to(closed_form(bandwidth, len(found), axes), found.shape)
    np.testing.assert_allclose(found, expected, atol=1e-9)
    t = trace["time"].values[:, None, None]
    assert np.abs(found - (1.0 - np.exp(-bandwidth * t)) * FORCE[:axes]).max() < 2.0 * bandwidth * STEP * 2.0


def test_it_leaves_no_error_where_pd_does() -> None:
    """What is left of the beginning decays at k_p / k_d, 0.6 / s."""
    error = {}
    for law in ("pd", "disturbance_observer"):
        trace = flown(duration=20.0, controller={"law": law})
        error[law] = float(np.abs(trace["e"].values[-1]).max())
    assert error["pd"] == pytest.approx(FORCE[0] / 30.0, rel=0.05)
    assert error["disturbance_observer"] < 1e-4


def test_each_law_of_several_teams_has_memory_of_its_own() -> None:
    laws = [
        {"law": "disturbance_observer", "bandwidth": 4.0},
        "pd",
        {"law": "disturbance_observer", "bandwidth": 20.0},
    ]
    teams = [
        {
            "name": f"team_{number}", "robots": [2 * number + 1, 2 * number + 2], "radius": 3,
            "targets": [{"name": f"target_{number}", "position": [12.0 * number, 0]}], "controller": law,
        }
        for number, law in enumerate(laws)
    ]  # fmt: skip
    changes: dict[str, Any] = {"target": None, "teams": teams, "robots.count": 6}
    trace = flown(**changes)
    names = ("disturbance_observer", "disturbance_observer_2")
    assert trace["memory"].values.tolist() == [f"{name}.{key}" for name in names for key in ("d_hat", "z")]
    slow, fast = memory(trace), memory(trace, "disturbance_observer_2.d_hat")
    steps = len(trace["time"])
    np.testing.assert_allclose(slow[:, :2], np.repeat(closed_form(4.0, steps), 2, axis=1), atol=1e-9)
    np.testing.assert_allclose(fast[:, 4:], np.repeat(closed_form(20.0, steps), 2, axis=1), atol=1e-9)
    assert not slow[:, 2:].any() and not fast[:, :4].any()


def test_the_figure_draws_memory_beside_the_truth_where_units_and_shape_agree() -> None:
    trace = flown()
    assert [truth_of(trace, row) for row in range(2)] == ["disturbance", None]
    assert "memory" in plots_of(trace)
    panels = figure_of(trace, "memory").axes
    assert [panel.get_title(loc="left") for panel in panels] == [
        f"disturbance_observer.{name}, {axis}" for name in ("d_hat", "z") for axis in "xy"
    ]
    drawn = [line.get_ydata() for line in panels[0].get_lines()]
    assert sum(np.allclose(line, 2.0) for line in drawn) == 3, "the true force, beside each robot's estimate"
    other = trace.copy()
    other["memory_truth"] = ("memory", ["q", "nothing"])  # metres beside newtons; a signal that is not there
    assert [truth_of(other, row) for row in range(2)] == [None, None]
    assert "memory" not in plots_of(flown(controller={"law": "pd"}))
