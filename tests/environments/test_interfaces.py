"""The interfaces of others, by their own tests."""

import pickle
import subprocess
import sys
from typing import Any

import numpy as np
import pytest

from escort_mj.api import load_scenario

gymnasium = pytest.importorskip("gymnasium")
pytest.importorskip("pettingzoo")

SHORT = {"duration": 0.6, "expect": []}
NAMES = ["main", "paper/case1_3d", "knowledge/lines_of_sight", "pursuit/handover"]


pytestmark = pytest.mark.filterwarnings("error:.*:UserWarning")  # of what the checkers find fault with


@pytest.mark.crossed
@pytest.mark.parametrize("command", ["velocity", "force"])
@pytest.mark.parametrize("name", NAMES)
def test_pettingzoo(name: str, command: str) -> None:
    from pettingzoo.test import parallel_api_test, parallel_seed_test

    from escort_mj.environments.parallel import EscortParallelEnv

    def make() -> EscortParallelEnv:
        return EscortParallelEnv(load_scenario(name, SHORT), command)  # type: ignore[arg-type]

    parallel_api_test(make(), num_cycles=100)
    parallel_seed_test(make, num_cycles=20)
    environment = make()
    environment.reset(seed=1)
    assert environment.state_space.contains(environment.state())


@pytest.mark.crossed
@pytest.mark.parametrize("command", ["velocity", "force"])
@pytest.mark.parametrize("name", NAMES)
def test_gymnasium(name: str, command: str) -> None:
    from gymnasium.utils.env_checker import check_env

    scenario = load_scenario(name, SHORT)
    environment = gymnasium.make("escort_mj/Escort-v0", scenario=scenario, command=command)
    check_env(environment.unwrapped, skip_render_check=True)


def test_a_pickled_environment_is_made_of_the_same_arguments() -> None:
    from escort_mj.environments.parallel import EscortParallelEnv
    from escort_mj.environments.single import EscortEnv
    from escort_mj.environments.vector import EscortVectorEnv

    scenario = load_scenario("patrol", {"robots.count": 4, **SHORT})
    for made in (EscortEnv(scenario), EscortParallelEnv(scenario), EscortVectorEnv(2, scenario)):
        copy = pickle.loads(pickle.dumps(made))
        one, other = (each.reset(seed=3)[0] for each in (made, copy))
        if isinstance(one, dict):
            one, other = (np.stack([*each.values()]) for each in (one, other))
        assert one.size and np.array_equal(one, other)


def test_gymnasium_takes_the_side_of_the_opponents() -> None:
    from gymnasium.utils.env_checker import check_env

    scenario = load_scenario("pursuit/intruders", SHORT | {"opponents[0].start": 0.1})
    environment = gymnasium.make("escort_mj/Escort-v0", scenario=scenario, side="opponents")
    check_env(environment.unwrapped, skip_render_check=True)


def test_gymnasium_finds_the_environment_by_its_module() -> None:
    code = "import gymnasium; print(gymnasium.make('escort_mj.environments:escort_mj/Escort-v0').spec.id)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "escort_mj/Escort-v0\n" and done.stderr == ""


def test_without_a_seed_the_next_mission_is_another() -> None:
    from escort_mj.environments.parallel import EscortParallelEnv
    from escort_mj.environments.single import EscortEnv

    scenario = load_scenario("main", SHORT)
    single, parallel = EscortEnv(scenario), EscortParallelEnv(scenario)
    starts = [single.reset()[0] for _ in range(3)]
    assert not np.array_equal(starts[0], starts[1]) and not np.array_equal(starts[1], starts[2])
    for start in starts:
        np.testing.assert_array_equal(np.stack(list(parallel.reset()[0].values())), start)
    np.testing.assert_array_equal(single.reset(seed=scenario.seed)[0], starts[0])
    np.testing.assert_array_equal(single.reset()[0], starts[1])


def test_observations_stay_in_their_space_where_a_mission_breaks() -> None:
    from escort_mj.environments.simulation import Simulation

    simulation = Simulation(load_scenario("main", SHORT))
    simulation.reset()
    simulation.plant.data.userdata[:] = np.nan
    simulation.fleet.senses.perceive(0)
    assert not simulation.observe_within().any() and not simulation.fleet.senses.sound.any()
    simulation.plant.data.userdata[::2] = np.inf
    simulation.fleet.senses.perceive(0)
    assert (np.abs(simulation.observe_within()) <= simulation.limits).all()


@pytest.mark.parametrize(("scenario", "side"), [("patrol", "robots"), ("pursuit/intruders", "both")])
def test_the_infos_of_a_parallel_reset_have_the_keys_of_those_of_a_step(scenario: str, side: Any) -> None:
    from escort_mj.environments.parallel import EscortParallelEnv

    environment = EscortParallelEnv(scenario, side=side)
    _, begun = environment.reset()
    *_, infos = environment.step({})
    for agent, info in infos.items():
        assert begun[agent].keys() == info.keys()
        assert begun[agent].get("reward_terms", {}).keys() == info.get("reward_terms", {}).keys()
        assert not any(begun[agent].get("reward_terms", {}).values())
    assert any(any(info.get("reward_terms", {}).values()) for info in infos.values())


def test_the_end_of_a_mission_that_breaks_is_a_termination() -> None:
    from escort_mj.environments.parallel import EscortParallelEnv

    scenario = load_scenario("paper/case1_2d", {"duration": 600.0, "mission.max_speed": 40.0, "expect": []})
    environment = EscortParallelEnv(scenario)
    environment.reset()
    away = {agent: np.ones(2, dtype=np.float32) for agent in environment.agents}
    ended: dict[str, bool] = {}
    while environment.agents:
        _, _, ended, cut, _ = environment.step(away)
        assert not any(cut.values())
    assert all(ended.values())
    assert "from the target" in environment.simulation.message
