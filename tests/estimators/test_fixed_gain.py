"""The filter with fixed gains: its poles, its error at rest, and what it makes of noise."""

import numpy as np
import pytest

import escort_mj
from escort_mj import load_scenario

RATE = 50.0  # looks per second


def errors(alpha: float, beta: float, noise: float, duration: float, target: list[str]) -> np.ndarray:
    """Return the errors of robot 1's estimate along the first axis at its looks [m]."""
    table = {
        "target": {"robots": [1], "rate": RATE, "measures": ["position"], "noise": {"position": noise}},
        "estimator": {"estimator": "fixed_gain", "alpha": alpha, "beta": beta},
        "initial": {"position": 0.5},
    }
    scenario = load_scenario("main", [f"duration={duration}", "expect=[]", "recording.rate=50"])
    scenario = scenario.replace({"target.position": target, "obstacles": [], "knowledge": table})
    trace = escort_mj.run(scenario).trace
    return (trace["target_estimate"].values - trace["target_position"].values[:, None])[:, 0, 0]


@pytest.mark.parametrize(("alpha", "beta"), [(0.1, 0.005), (0.4, 0.05)])
def test_it_decays_as_its_poles_say_without_noise(compiled: None, alpha: float, beta: float) -> None:
    """z^2 + (alpha + beta - 2) z + 1 - alpha = 0, for a target of constant velocity."""
    found = errors(alpha, beta, 0.0, 12.0, ["0.4*t", "0"])
    radius = np.abs(np.roots([1.0, alpha + beta - 2.0, 1.0 - alpha])).max()
    steps = np.arange(len(found))
    assert np.abs(found[-1]) < 1e-3 * np.abs(found).max()
    assert (np.abs(found) <= 20.0 * np.abs(found[1]) * radius ** (0.8 * steps) + 1e-9).all()


def test_the_variance_of_its_position_is_the_closed_form(compiled: None) -> None:
    """(2 alpha^2 + beta (2 - 3 alpha)) / (alpha (4 - 2 alpha - beta)) of that of a look, in steady state."""
    alpha, beta, noise = 0.3, 0.05, 0.05
    found = errors(alpha, beta, noise, 200.0, ["0.1*t", "0"])[1000:]
    share = (2.0 * alpha**2 + beta * (2.0 - 3.0 * alpha)) / (alpha * (4.0 - 2.0 * alpha - beta))
    assert np.var(found) == pytest.approx(share * noise**2, rel=0.15)
