"""The Gaussian sensor: its moments, and how the bias is correlated in time."""

from typing import Any

import numpy as np
import pytest
from scipy.stats import kstest

from escort_mj import Run, Scenario, run
from escort_mj.sensors.gaussian import Gaussian

COUNT, STEP = 40, 0.002


def measured(duration: float, **keys: float) -> tuple[Run, np.ndarray, np.ndarray]:
    """A run, the bias and the rest of the errors of positions, shape (sample, robot, axis) [m]."""
    scenario: dict[str, Any] = {
        "duration": duration,
        "target": None,
        "recording": {"rate": 1 / STEP},
        "robots": {"count": COUNT, "placement": {"within": 30, "least_gap": 1}},
        "mission": {"behaviors": ["avoid_obstacles"]},
        "sensing": {"position": {"sensor": "gaussian", **keys}},
    }
    found = run(Scenario(**scenario))
    trace = found.trace
    named = [trace["readings"].sel(reading=f"position.bias.{axis}").values for axis in "xy"]
    bias = np.stack(named, axis=-1)
    return found, bias, trace["q_measured"].values - trace["q"].values - bias


def test_noise_is_normal_and_white(compiled: None) -> None:
    _, bias, noise = measured(0.5, noise=0.03)
    assert not bias.any()
    assert kstest((noise / 0.03).ravel(), "norm").pvalue > 1e-3
    assert abs(noise).max() > 3.5 * 0.03, "it has no bounds"
    for lag in (1, 2, 7):
        assert abs(np.corrcoef(noise[lag:].ravel(), noise[:-lag].ravel())[0, 1]) < 0.02
    assert abs(np.corrcoef(noise[..., 0].ravel(), noise[..., 1].ravel())[0, 1]) < 0.02


def test_the_bias_is_a_gauss_markov_process(compiled: None) -> None:
    _, bias, noise = measured(4.0, noise=0.0, wander=0.2, correlation_time=0.25)
    assert abs(noise).max() < 1e-12 and not bias[0].any()
    late = bias[round(1.0 / STEP) :]
    assert late.std() == pytest.approx(0.2, rel=0.08)
    for lag in (25, 125, 250):  # 0.05, 0.25, 0.5 s
        found = np.corrcoef(late[lag:].ravel(), late[:-lag].ravel())[0, 1]
        assert found == pytest.approx(np.exp(-lag * STEP / 0.25), abs=0.06)
    kept = np.exp(-STEP / 0.25)
    driven = late[1:] - kept * late[:-1]
    assert driven.std() == pytest.approx(0.2 * np.sqrt(1 - kept**2), rel=0.02)


def test_gains_and_estimators_are_told() -> None:
    sensor = Gaussian(noise=0.03, wander=0.04)
    assert sensor.deviation(3) == 0.03 and sensor.variance(3) == pytest.approx(0.0025)
