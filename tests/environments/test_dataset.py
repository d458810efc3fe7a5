"""The law's missions as a data set."""

from pathlib import Path

import numpy as np
import pytest

from escort_mj.api import load_scenario
from escort_mj.environments import Simulation

pytest.importorskip("gymnasium")

from escort_mj.environments.dataset import law_episode, minari_dataset  # noqa: E402
from escort_mj.record.outcome import Outcome  # noqa: E402

EVERY_STEP = {"duration": 0.2, "expect": [], "recording.rate": 500.0, "mission.max_speed": 8.0}


@pytest.mark.parametrize("name", ["main", "paper/case1_3d", "knowledge/blind", "pursuit/handover"])
def test_where_commands_are_given_at_every_step_they_lead_the_same_way(name: str) -> None:
    scenario = load_scenario(name, EVERY_STEP)
    flown = law_episode(scenario)
    assert flown.outcome is Outcome.COMPLETED and len(flown.observations) == len(flown.actions) + 1
    simulation = Simulation(scenario)
    simulation.reset(command=flown.actions[0])
    for k, action in enumerate(flown.actions[1:]):
        np.testing.assert_allclose(simulation.observe_within(), flown.observations[k], atol=1e-5)
        reward = simulation.step(action).mean()
        assert reward == pytest.approx(flown.rewards[k], abs=1e-4)


def test_minari_stores_and_loads_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    minari = pytest.importorskip("minari")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    scenario = load_scenario("main", {"duration": 0.2, "expect": []})
    minari_dataset(
        "escort_mj/main/law-v0", scenario, range(3), author="test", author_email="test", eval_env=None
    )
    found = minari.load_dataset("escort_mj/main/law-v0")
    assert found.total_episodes == 3 and found.total_steps == 30
    for seed, episode in enumerate(found.iterate_episodes()):
        flown = law_episode(scenario.replace(seed=seed))
        np.testing.assert_array_equal(episode.observations, flown.observations)
        np.testing.assert_array_equal(episode.actions, flown.actions)
        np.testing.assert_array_equal(episode.rewards, flown.rewards)
        assert episode.truncations.tolist() == [False] * 9 + [True] and not episode.terminations.any()
        assert all(one in found.observation_space for one in episode.observations)


def test_minari_makes_the_environment_of_a_scenario_that_has_a_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    minari = pytest.importorskip("minari")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    file = tmp_path / "short.yaml"
    file.write_text("name: short\nduration: 0.1\ntarget: {position: [0, 0]}\n")
    minari_dataset("escort_mj/short/law-v0", str(file), range(1))
    environment = minari.load_dataset("escort_mj/short/law-v0").recover_environment()
    assert environment.reset(seed=1)[0] in environment.observation_space
