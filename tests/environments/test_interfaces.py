"""The interfaces of others, by their own tests."""

import numpy as np
import pytest

from escort_mj.api import load_scenario

gymnasium = pytest.importorskip("gymnasium")
pytest.importorskip("pettingzoo")

SHORT = {"duration": 0.6, "expect": []}


@pytest.mark.parametrize("command", ["velocity", "force"])
@pytest.mark.parametrize("name", ["main", "paper/case1_3d"])
def test_pettingzoo(name: str, command: str) -> None:
    from pettingzoo.test import parallel_api_test, parallel_seed_test

    from escort_mj.environments.parallel import EscortParallelEnv

    def make() -> EscortParallelEnv:
        return EscortParallelEnv(load_scenario(name, SHORT), command)  # type: ignore[arg-type]

    parallel_api_test(make(), num_cycles=100)
    parallel_seed_test(make, num_cycles=20)


def test_gymnasium() -> None:
    from gymnasium.utils.env_checker import check_env

    from escort_mj.environments.single import EscortEnv

    check_env(EscortEnv(load_scenario("main", SHORT)), skip_render_check=True)


def test_dm_env() -> None:
    from dm_env import StepType

    from escort_mj.environments.dm import EscortEnvironment

    environment = EscortEnvironment(load_scenario("main", SHORT))
    action, observation = environment.action_spec(), environment.observation_spec()
    step = environment.step(action.generate_value())
    assert step.step_type is StepType.FIRST
    kinds = []
    while not step.last():
        step = environment.step(np.ones(action.shape))
        observation.validate(step.observation)
        kinds.append(step.step_type)
    assert len(kinds) == 30 and step.discount == 1.0
    assert environment.step(action.generate_value()).first()


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
