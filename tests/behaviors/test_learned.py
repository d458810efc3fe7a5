"""The behavior `learned`: a network moves robots in a mission as it does in an environment."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import escort_mj
from escort_mj.environments import Simulation
from escort_mj.errors import ScenarioError

Layers = list[dict[str, Any]]
SHORT: dict[str, Any] = {"duration": 1.0, "expect": [], "mission.outer": "nsb", "mission.max_speed": 2.0}


def network(inputs: int, axes: int) -> Layers:
    """Return a network that asks for moderate speeds."""
    dice = np.random.default_rng(3)
    sizes = ((8, inputs, 0.3), (axes, 8, 0.1))
    return [
        {"weights": (s * dice.normal(size=(m, n))).tolist(), "bias": (0.1 * dice.normal(size=m)).tolist()}
        for m, n, s in sizes
    ]


def answer(layers: Layers, observed: np.ndarray) -> np.ndarray:
    """Return what a network makes of observations, shape (robots, inputs)."""
    first, last = layers
    hidden = np.tanh(observed @ np.transpose(first["weights"]) + first["bias"])
    return np.asarray(hidden @ np.transpose(last["weights"]) + last["bias"])


@pytest.mark.parametrize("name", ["main", "main_3d", "pursuit/intruders", "knowledge/blind"])
def test_it_flies_as_in_the_environment(name: str) -> None:
    scenario = escort_mj.load_scenario(name, SHORT)
    simulation = Simulation(scenario)
    layers = network(simulation.width, simulation.axes)
    simulation.reset(seed=4)
    while simulation.under_way:
        simulation.step(answer(layers, simulation.observe()))
    expected = simulation.run().trace
    followed = {"seed": 4, "mission.behaviors": [{"behavior": "learned", "network": layers}]}
    found = escort_mj.run(scenario.replace(followed)).trace
    for signal in ("q", "v", "v_d", "tau"):
        np.testing.assert_allclose(found[signal], expected[signal], rtol=0, atol=1e-11)
    assert np.linalg.norm(found["v_d"][-1], axis=1).min() > 0.01


def test_it_rules_in_its_phase_from_rest() -> None:
    layers = [{"weights": np.zeros((2, 16)).tolist(), "bias": [0.4, 3.0]}]
    phase = {"after": 0.5, "behaviors": [{"behavior": "learned", "network": layers, "interval": 0.2}]}
    scenario = escort_mj.load_scenario("main", SHORT | {"mission.supervisor": [phase]})
    late = escort_mj.run(scenario).trace["v_d"].sel(time=slice(0.6, None)).values
    wanted = np.array([0.4, 1.0])
    np.testing.assert_allclose(late - 2.0 * wanted / np.linalg.norm(wanted), 0.0, atol=1e-12)
    assert len(late) > 10


def test_of_a_file_and_refused_with_other_sizes(tmp_path: Path) -> None:
    np.savez(tmp_path / "net.npz", weights_1=np.zeros((2, 16)), bias_1=np.zeros(2))
    file = tmp_path / "mission.yaml"
    file.write_text("mission: {behaviors: [{behavior: learned, network: net.npz}]}\n")
    (behavior,) = escort_mj.load_scenario(file).mission.behaviors
    assert len(behavior.network[0].weights[0]) == 16
    for changes, words in (
        ({"robots.count": 4}, "found 16 inputs and 2 outputs; expected 14 and 2 in 2 axes with 4 robots"),
        ({"opponents": [{}]}, "expected 20 and 2 in 2 axes with 5 robots and opponents"),
        ({"target": None}, "learned, which needs a target"),
        ({"mission.behaviors[0].network": "other.npz"}, "other.npz: there is no such file"),
        ({"mission.behaviors[0].network": []}, "network: found none; give the name of a .npz file"),
    ):
        with pytest.raises(ScenarioError, match=words):
            escort_mj.load_scenario(file, changes)
