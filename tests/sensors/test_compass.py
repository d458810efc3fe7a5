"""The compass: its noise, and a bias that walks at random."""

from typing import Any

import numpy as np
import pytest

from escort_mj import Run, Scenario, run

COUNT, DURATION = 12, 2.0


def sailed(**compass: float) -> Run:
    keys: dict[str, Any] = {
        "duration": DURATION,
        "recording": {"rate": 500},
        "robots": {"count": COUNT, "kind": "diff_drive", "placement": {"within": 15, "least_gap": 1}},
        "sensing": {"heading": {"sensor": "compass", **compass}},
    }
    return run(Scenario(**keys))


def heading(found: Run) -> np.ndarray:
    """True headings, from MuJoCo's own coordinates: the quaternion of each base [rad]."""
    coordinates = found.trace["qpos"].values.reshape(len(found.trace["time"]), COUNT, -1)
    w, x, y, z = (coordinates[:, :, 3 + k] for k in range(4))
    return np.asarray(np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))


def turned(angle: np.ndarray) -> np.ndarray:
    """The same angles between -pi and pi."""
    return np.asarray((angle + np.pi) % (2.0 * np.pi) - np.pi)


def test_without_errors_it_shows_the_heading(compiled: None) -> None:
    found = sailed(noise=0.0, drift=0.0)
    shown = found.trace["readings"].sel(reading="heading").values
    assert np.abs(turned(shown - heading(found))).max() < 1e-12
    assert not found.trace["readings"].sel(reading="heading.bias").values.any()


def test_the_bias_is_recorded_and_walks_at_random(compiled: None) -> None:
    found = sailed(noise=0.02, drift=0.05)
    readings = found.trace["readings"]
    bias = readings.sel(reading="heading.bias").values
    noise = turned(readings.sel(reading="heading").values - heading(found) - bias)
    assert noise.std() == pytest.approx(0.02, rel=0.03) and abs(noise.mean()) < 1e-3
    steps = np.diff(bias, axis=0)
    assert not bias[0].any() and steps.std() == pytest.approx(0.05 * np.sqrt(0.002), rel=0.03)
    assert abs(np.corrcoef(steps[1:].ravel(), steps[:-1].ravel())[0, 1]) < 0.05, "steps are independent"


def test_it_changes_nothing_but_what_is_recorded(compiled: None) -> None:
    one, other = sailed(noise=0.0, drift=0.0), sailed(noise=0.3, drift=0.5)
    assert one.trace["q"].values.tobytes() == other.trace["q"].values.tobytes()
