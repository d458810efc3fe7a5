"""The side of the opponents: agents of their own, and the same network in an environment and in a run."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from escort_mj import Scenario, load_scenario, run
from escort_mj.environments.rivals import RivalReward
from escort_mj.environments.simulation import Simulation
from escort_mj.errors import UsageError
from escort_mj.policies.learned import LARGEST, inputs, within_speed

SOON = {
    "duration": 0.6,
    "expect": [],
    "opponents[0].start": 0.1,
    "opponents[0].interval": 0.1,
    "opponents[0].distance": 4.6,
    "opponents[1].start": 0.3,
}


RAID = {"opponents[0].start": 0.1, "opponents[0].interval": 0.1}


@pytest.fixture(scope="module")
def soon() -> Scenario:
    return load_scenario("pursuit/intruders", SOON)


@pytest.mark.parametrize("name", ["soon", "pursuit/raid"])
def test_both_sides_are_agents_without_a_warning(soon: Scenario, name: str) -> None:
    soon = soon if name == "soon" else load_scenario(name, {"duration": 0.6, "expect": []} | RAID)
    testing = pytest.importorskip("pettingzoo.test")
    from escort_mj.environments.parallel import EscortParallelEnv

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        testing.parallel_api_test(EscortParallelEnv(soon, side="both"), num_cycles=40)
        testing.parallel_api_test(EscortParallelEnv(soon, side="opponents"), num_cycles=40)
        testing.parallel_seed_test(lambda: EscortParallelEnv(soon, side="both"), num_cycles=40)


def test_an_intercepted_opponent_leaves_and_robots_stay(soon: Scenario) -> None:
    pytest.importorskip("pettingzoo")
    from escort_mj.environments.parallel import EscortParallelEnv

    scenario = soon.replace({"duration": 6.0, "opponents[0].capture_distance": 1.5})
    environment = EscortParallelEnv(scenario, side="both")
    seen, _ = environment.reset(seed=4)
    assert set(environment.agents) == {f"{kind}_{k + 1}" for kind in ("robot", "opponent") for k in range(5)}
    left: dict[str, float] = {}
    while environment.agents:
        ways = {agent: seen[agent][:2] for agent in environment.agents}
        actions = {
            agent: way / max(np.linalg.norm(way), 1e-9) for agent, way in ways.items() if "op" in agent
        }
        seen, rewards, over, _, infos = environment.step(actions)
        left |= {agent: rewards[agent] for agent in over if over[agent]}
        assert all(
            rewards[agent] == 0.0 for agent in over if infos[agent].get("comes") is False and not over[agent]
        )
    assert left and all(agent.startswith("opponent") for agent in left)
    assert set(map(round, left.values())) <= {-10, 10}
    assert environment.simulation.time == pytest.approx(6.0)


def test_robots_see_the_nearest_opponent_and_share_its_breach(soon: Scenario) -> None:
    scenario = soon.replace({"duration": 20.0, "opponents[0].reach_distance": 2.6})
    simulation = Simulation(scenario, side="both", rival_reward=RivalReward(approach=2.0, command=0.0))
    simulation.reset(seed=1)
    assert simulation.rivals is not None
    assert not simulation.observe()[:, -4:].any()  # nobody comes yet
    seen, earned = False, np.zeros(5)
    state = simulation.plant.state
    for _ in range(150):
        before = np.linalg.norm(state.target_position - state.mover_position, axis=1)
        coming = simulation.rivals.comes.copy()
        rewards = simulation.step(None, within_speed(simulation.rivals.observed[:, :2] * 1e3))
        after = np.linalg.norm(state.target_position - state.mover_position, axis=1)
        status = state.opponent_status
        going_on = coming & (status == 1.0)
        expected = 2.0 * (before - after)[going_on] / 3.0
        np.testing.assert_allclose(simulation.rivals.rewards[going_on], expected, atol=1e-12)
        seen |= bool(simulation.observe()[:, -4:].any())
        earned = np.minimum(earned, rewards)
        if (status == 3.0).any():
            break
    assert seen and (earned < -90.0).all()  # an opponent has reached the target


@pytest.mark.parametrize("teams", [False, True])
def test_a_network_does_in_a_run_what_it_does_in_an_environment(tmp_path: Path, teams: bool) -> None:
    dice = np.random.default_rng(7)
    shapes = [(8, inputs(2)), (2, 8)]
    arrays: dict[str, Any] = {f"weights_{k}": dice.normal(size=shape) for k, shape in enumerate(shapes, 1)}
    arrays |= {f"bias_{k}": dice.normal(size=shape[0]) for k, shape in enumerate(shapes, 1)}
    np.savez(tmp_path / "net.npz", **arrays)
    text = (
        "duration: 3\ntarget: {position: [0, 0]}\nrobots: {count: 3}\n"
        "opponents: [{positions: [[6, 1]], policy: {policy: learned, network: net.npz, speed: 1.2}}]\n"
    )
    if teams:
        targets = "{name: near, position: [0, 0]}, {name: far, position: [0, -6]}"
        one = f"teams: [{{name: one, robots: [1, 2, 3], radius: 6, targets: [{targets}]}}]\n"
        text = text.replace("target: {position: [0, 0]}\n", "target: null\n" + one)
    (tmp_path / "mission.yaml").write_text(text)
    scenario = load_scenario(tmp_path / "mission.yaml")
    flown = run(scenario)
    simulation = Simulation(scenario, side="opponents")
    simulation.reset()
    assert simulation.rivals is not None
    path = [simulation.plant.state.mover_position[-1].copy()]
    for _ in range(len(flown.trace.time) - 1):
        values = simulation.rivals.observed[0].astype(float)
        assert (np.abs(values) <= LARGEST).all()
        hidden = np.tanh(arrays["weights_1"] @ values + arrays["bias_1"])
        simulation.step(None, (arrays["weights_2"] @ hidden + arrays["bias_2"])[None])
        path.append(simulation.plant.state.mover_position[-1].copy())
    there = flown.trace.obstacle_position.values[:, -1]
    assert np.linalg.norm(there[-1] - there[0]) > 0.5
    np.testing.assert_allclose(path, there, atol=0.02)  # a command from outside comes one step later


def test_what_cannot_be(soon: Scenario) -> None:
    with pytest.raises(UsageError, match="expected robots, opponents or both"):
        Simulation(soon, side="none")  # type: ignore[arg-type]
    with pytest.raises(UsageError, match="found none"):
        Simulation("main", side="both")
    pytest.importorskip("gymnasium")
    from escort_mj.environments.single import EscortEnv
    from escort_mj.environments.vector import EscortVectorEnv

    for make in (EscortEnv, lambda *given, **more: EscortVectorEnv(2, *given, **more)):
        with pytest.raises(UsageError, match="expected robots or opponents"):
            make(soon, side="both")
        with pytest.raises(UsageError, match="found none"):
            make("main", side="opponents")
