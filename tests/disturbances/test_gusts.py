"""Turbulence: its filters against the spectra of MIL-F-8785C, its scales against published tables."""

from typing import Any

import numpy as np
import pytest

from escort_mj.conformance.stand import Stand
from escort_mj.disturbances.gusts import FOOT, Gusts
from escort_mj.mission.batch import fly_many
from escort_mj.scenario.schema.scenario import Scenario

Array = np.ndarray[Any, np.dtype[np.float64]]
RADIUS = Scenario().robots.radius


def scales(height: float, speed: float) -> tuple[float, float, float, float]:
    """L_u = L_v, L_w [m], sigma_u = sigma_v and sigma_w [m/s], as the standard states them in feet."""
    feet = height / FOOT
    share = 0.177 + 0.000823 * feet
    return FOOT * feet / share**1.2, height, 0.1 * speed / share**0.4, 0.1 * speed


class Filter:
    """The discrete filter of each axis, read off what the component does.

    Attributes:
        step: What a step makes of the two numbers of each axis, shape (axes, 2, 2).
        drive: What it makes of two random numbers, likewise.
        shown: What the wind is of the two numbers, shape (axes, 2) [m/s].
    """

    def __init__(self, axes: int, height: float, time: float = 1.0, **keys: Any) -> None:
        self.stand = Stand(Gusts(**{"ground": -height, "common": False} | keys), Scenario, 1, axes)
        state = self.stand.state
        state.time[0], state.q[:], state.v[:] = time, 0.0, 0.0
        self.memory = state.component_memory[:, 0]
        self.noise = state.noise[0], state.second_noise[0]
        sources = [*self.memory, *self.noise]
        found = np.array([self._response(source) for source in sources])  # source, number, axis
        self.step = found[:2].transpose(2, 1, 0)
        self.drive = found[2:].transpose(2, 1, 0)
        self.shown = np.array([self._wind(source) for source in sources[:2]]).T

    def _silent(self) -> None:
        for values in (*self.memory, *self.noise):
            values[:] = 0.0

    def _response(self, source: Array) -> Array:
        self._silent()
        source[:] = 1.0
        self.stand.call()
        return self.memory + self.stand.timestep * self.stand.state.component_rate[:, 0]

    def _wind(self, source: Array) -> Array:
        """Gust of a unit source, from the drag: no other wind blows along the other axes."""
        found = []
        for axis in range(len(source)):
            self._silent()
            source[axis] = 1.0
            self.stand.call()
            found.append(wind_of(self.stand.state.disturbance_force[0])[axis])
        found[0] -= self.stand.own.speed
        return np.array(found)


def wind_of(force: Array) -> Array:
    """Relative wind of a drag [m/s]."""
    size = np.linalg.norm(force, axis=-1, keepdims=True)
    return force / np.sqrt(size * 0.5 * 1.2 * 0.47 * np.pi * RADIUS**2)


@pytest.mark.parametrize(("speed", "strong"), [(7.0, 1.06), (14.0, 2.12)])
def test_scales_are_those_of_the_textbook(speed: float, strong: float) -> None:
    """Beard and McLain, Small Unmanned Aircraft, 2012, table 4.1: light and moderate turbulence at 50 m."""
    found = Filter(3, 50.0, speed=speed)
    lengths = -speed * found.stand.timestep / np.log(found.step[:, 0, 0])
    np.testing.assert_allclose(lengths, [200.0, 200.0, 50.0], rtol=0.02)
    sizes = [shown @ [[1.0, 0.5], [0.5, 0.5]] @ shown for shown in found.shown]
    np.testing.assert_allclose(np.sqrt(sizes), [strong, strong, 0.1 * speed], rtol=0.06)


def test_turbulence_is_isotropic_at_1000_ft() -> None:
    found = Filter(3, 1000.0 * FOOT, speed=10.0)
    np.testing.assert_allclose(found.step, np.broadcast_to(found.step[0], (3, 2, 2)), rtol=1e-12)
    assert found.shown[0, 0] == pytest.approx(1.0)


@pytest.mark.parametrize(("axes", "height", "speed"), [(3, 50.0, 7.0), (3, 4.0, 12.0), (2, 20.0, 3.0)])
def test_at_any_lag_the_filter_has_the_covariance_of_the_spectrum(
    axes: int, height: float, speed: float
) -> None:
    """The spectra's cosine transforms: s^2 exp(-x), and s^2 exp(-x) (1 - x / 2) across, x = V t / L."""
    found, (level, upright, strong, weak) = Filter(axes, height, speed=speed), scales(height, speed)
    lengths, sizes = [level, level, upright][:axes], [strong, strong, weak][:axes]
    for axis, (length, size) in enumerate(zip(lengths, sizes, strict=True)):
        step, drive, shown = found.step[axis], found.drive[axis], found.shown[axis]
        covariance = np.array([[1.0, 0.5], [0.5, 0.5]])
        np.testing.assert_allclose(step @ covariance @ step.T + drive @ drive.T, covariance, atol=1e-13)
        for steps in (0, 1, 100, 5000):
            way = steps * found.stand.timestep * speed / length
            expected = size**2 * np.exp(-way) * (1.0 - 0.5 * way * (axis > 0))
            lagged = shown @ np.linalg.matrix_power(step, steps) @ covariance @ shown
            assert lagged == pytest.approx(expected, rel=1e-9, abs=1e-10)


def spectrum(frequency: Array, length: float, size: float, speed: float, order: int) -> Array:
    """Spectra of MIL-F-8785C over angular frequencies from 0 up; their integral is size^2."""
    way = (length * frequency / speed) ** 2
    if order == 1:
        return size**2 * 2.0 * length / (np.pi * speed) / (1.0 + way)
    return size**2 * length / (np.pi * speed) * (1.0 + 3.0 * way) / (1.0 + way) ** 2


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_filter_has_the_published_spectrum(axis: int) -> None:
    height, speed = 30.0, 9.0
    found, (level, upright, strong, weak) = Filter(3, height, speed=speed), scales(height, speed)
    timestep = found.stand.timestep
    for frequency in (0.01, 0.1, 1.0, 5.0):  # far below the rate of steps
        turn = np.exp(1j * frequency * timestep) * np.eye(2) - found.step[axis]
        gain = found.shown[axis] @ np.linalg.solve(turn, found.drive[axis])
        size = float(np.sum(np.abs(gain) ** 2)) * timestep / np.pi
        length, deviation = (upright, weak) if axis == 2 else (level, strong)
        expected = spectrum(np.array(frequency), length, deviation, speed, 1 if axis == 0 else 2)
        assert size == pytest.approx(float(expected), rel=1e-4)


def test_the_first_step_draws_from_the_stationary_distribution() -> None:
    found = Filter(3, 10.0, time=0.0)
    for step, drive in zip(found.step, found.drive, strict=True):
        assert np.abs(step).max() == 0.0
        np.testing.assert_allclose(drive @ drive.T, [[1.0, 0.5], [0.5, 0.5]], atol=1e-14)


def test_turbulence_turns_with_the_wind_and_has_the_drag_of_a_ball() -> None:
    heading = 0.7
    turn = np.array(
        [[np.cos(heading), -np.sin(heading), 0], [np.sin(heading), np.cos(heading), 0], [0, 0, 1]]
    )
    forces = []
    for angle in (0.0, heading):
        stand = Stand(Gusts(heading=angle), Scenario, 4, 3)
        stand.fill(np.random.default_rng(5))
        stand.state.v[:] = 0.0
        stand.call()
        forces.append(stand.state.disturbance_force.copy())
    np.testing.assert_allclose(forces[1], forces[0] @ turn.T, rtol=1e-12)


def flown(duration: float, count: int, **keys: Any) -> Any:
    wind = {"disturbance": "gusts", "speed": 40.0, "density": 0.0, "ground": -4.0} | keys
    table = {
        "duration": duration, "physics.timestep": 0.01, "recording.rate": 100, "robots.count": count,
        "uncertainty": {"disturbances": [wind]}, "expect": [], "mission.max_speed": 0.1,
    }  # fmt: skip
    (flight,) = fly_many([Scenario.model_validate({}).replace(table)], 1, traces=True)
    assert flight.outcome.good, flight.message
    return flight.trace["component_memory"]


def test_a_long_series_has_the_covariance(compiled: None) -> None:
    """Across the wind; robots hardly move, so that their airspeed is the wind's."""
    memory = flown(100.0, 12, common=False)
    quick, slow = (memory.sel(memory=f"gusts.{name}").values[1:, :, 1] for name in ("quick", "slow"))
    found = (np.sqrt(3.0) * quick + (1.0 - np.sqrt(3.0)) * slow) / np.sqrt(2.0)
    time = scales(4.0, 40.0)[0] / 40.0
    independent = found[0].size * 100.0 / (2.0 * time)
    for lag in (0, 5, 20, 60):
        way = 0.01 * lag / time
        measured = np.mean(found[: len(found) - lag] * found[lag:])
        expected = np.exp(-way) * (1.0 - 0.5 * way)
        assert measured == pytest.approx(expected, abs=4.0 * np.sqrt(2.0 / independent))


@pytest.mark.parametrize("common", [True, False])
def test_common_turbulence_meets_all_robots_at_once(common: bool) -> None:
    stand = Stand(Gusts(common=common), Scenario, 4, 3)
    stand.fill(np.random.default_rng(3))
    for values in (stand.state.q, stand.state.v, stand.state.component_memory):
        values[:] = 0.5
    stand.call()
    apart = np.ptp(stand.state.component_rate, axis=1)
    assert apart.max() == 0.0 if common else apart.min() > 0.0
