"""The wind: its profile against closed forms, its gusts against the statistics of filtered noise."""

from typing import Any

import numpy as np
import pytest

import escort_mj
from escort_mj.conformance.stand import Stand
from escort_mj.disturbances.wind_shear import WindShear
from escort_mj.errors import ScenarioError
from escort_mj.mission.batch import fly_many
from escort_mj.scenario.schema.scenario import Scenario

HEIGHTS = np.array([-1.0, 0.0, 0.02, 0.5, 3.0, 10.0, 40.0, 200.0])
TAU, SIGMA = 0.2, 1.5


def forces(axes: int, heights: np.ndarray, motion: float = 0.0, **parameters: Any) -> np.ndarray:
    """Forces on robots at heights that move along the first axis."""
    stand = Stand(WindShear(gusts=0.0, **parameters), Scenario, len(heights), axes)
    stand.state.q[:] = 7.0
    stand.state.q[:, -1] = heights
    stand.state.v[:] = 0.0
    stand.state.v[:, 0] = motion
    stand.call()
    return stand.state.disturbance_force.copy()


def drag(wind: np.ndarray, radius: float, density: float = 1.2, coefficient: float = 0.47) -> np.ndarray:
    """Drag of balls in a wind along one axis."""
    return 0.5 * density * coefficient * np.pi * radius**2 * np.abs(wind) * wind


RADIUS = Scenario().robots.radius


@pytest.mark.parametrize("axes", [2, 3, 5])
def test_the_logarithmic_profile_is_the_closed_form(axes: int) -> None:
    found = forces(axes, HEIGHTS + 2.0, motion=1.0, ground=2.0, reference=20.0, roughness=0.1)
    wind = np.where(HEIGHTS > 0.1, 5.0 * np.log(np.maximum(HEIGHTS, 0.1) / 0.1) / np.log(200.0), 0.0)
    np.testing.assert_allclose(found[:, 0], drag(wind - 1.0, RADIUS), rtol=1e-12)
    assert np.abs(found[:, 1:]).max() == 0.0


@pytest.mark.parametrize("heading", [0.0, 2.0, -0.7])
def test_the_power_law_is_the_closed_form_along_its_heading(heading: float) -> None:
    found = forces(3, HEIGHTS, profile="power", exponent=0.25, speed=8.0, heading=heading)
    force = drag(8.0 * (np.maximum(HEIGHTS, 0.0) / 10.0) ** 0.25, RADIUS)
    expected = force[:, None] * [np.cos(heading), np.sin(heading), 0.0]
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-15)


def gusts(duration: float, count: int, **parameters: Any) -> np.ndarray:
    """Gusts at each step of a mission, shape (steps, robots, axes)."""
    wind = {"disturbance": "wind_shear", "gusts": SIGMA, "correlation_time": TAU, "density": 0.0} | parameters
    keys = {
        "duration": duration, "physics.timestep": 0.01, "recording.rate": 100, "robots.count": count,
        "uncertainty": {"disturbances": [wind]}, "expect": [],
    }  # fmt: skip
    (flight,) = fly_many([Scenario.model_validate({}).replace(keys)], 1, traces=True)
    assert flight.outcome.good, flight.message
    return np.asarray(flight.trace["component_memory"].sel(memory="wind_shear.gust").values)


def test_gusts_have_the_variance_and_the_correlation_time_of_the_filter(compiled: None) -> None:
    found = gusts(60.0, 12, common=False)[1:]
    independent = found[0].size * 60.0 / (2.0 * TAU)  # so many numbers say as much
    assert np.mean(found**2) == pytest.approx(SIGMA**2, rel=4.0 * np.sqrt(2.0 / independent))
    assert abs(found.mean()) < 4.0 * SIGMA / np.sqrt(independent)
    for lag in (1, 10, 20, 40):
        correlation = np.mean(found[:-lag] * found[lag:]) / np.mean(found**2)
        assert correlation == pytest.approx(np.exp(-0.01 * lag / TAU), abs=4.0 / np.sqrt(independent))
    across = np.corrcoef(found.reshape(len(found), -1).T) - np.eye(found[0].size)
    assert np.abs(across).max() < 6.0 / np.sqrt(60.0 / (2.0 * TAU))


def test_gusts_have_their_variance_from_the_first_step_on(compiled: None) -> None:
    first = np.concatenate([gusts(0.02, 60, common=False, gusts=1.0)[1].ravel()])
    assert np.mean(first**2) == pytest.approx(1.0, rel=4.0 * np.sqrt(2.0 / first.size))


def test_common_gusts_meet_all_robots_at_once(compiled: None) -> None:
    found = gusts(1.0, 4)
    assert np.ptp(found, axis=1).max() == 0.0
    assert np.abs(found[1:]).min() > 0.0


def test_a_roughness_beyond_the_reference_is_refused() -> None:
    wind = {"disturbance": "wind_shear", "roughness": 12.0}
    with pytest.raises(ScenarioError, match="roughness: found 12 m; expected less than reference, 10 m"):
        escort_mj.load_scenario("main", {"uncertainty.disturbances": [wind]})
