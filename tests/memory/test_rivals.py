"""What opponents are shown, found by machine code, against the same in NumPy."""

import numpy as np
import pytest

from escort_mj.api import load_scenario
from escort_mj.environments.rivals import RivalReward
from escort_mj.environments.simulation import Simulation
from escort_mj.policies.body import policy_view
from tests.oracle.policies import perceived


@pytest.mark.parametrize("name", ["pursuit/intruders", "pursuit/raid"])
def test_machine_code_and_numpy_perceive_the_same(name: str) -> None:
    """In missions with teams, the target of an opponent is the nearest of their targets."""
    soon = {"opponents[0].start": 0.1, "opponents[0].interval": 0.1}
    scenario = load_scenario(name, {"duration": 2.0, "expect": []} | soon)
    simulation = Simulation(scenario, side="opponents", rival_reward=RivalReward(command=0.0))
    simulation.reset(seed=2)
    rivals, state, setup = simulation.rivals, simulation.plant.state, simulation.world.setup
    assert rivals is not None
    view = policy_view(state)
    places = [j for places in setup.target_places for j in places]
    before, chosen = np.zeros(rivals.count), set()
    for _ in range(20):
        coming = rivals.comes
        simulation.step(None, rivals.observed[:, 2:4])
        for o, mover in enumerate(setup.movers[-rivals.count :]):
            body = len(setup.movers) - rivals.count + o
            here, target, motion = state.mover_position[body], state.target_position, state.target_velocity
            if places:
                nearest = int(np.linalg.norm(state.obstacle_position[places] - here, axis=1).argmin())
                target = state.obstacle_position[places[nearest]]
                motion = state.obstacle_velocity[places[nearest]]
                chosen.add(nearest)
            assert mover.policy is not None
            seen = view._replace(target_position=target, target_velocity=motion)
            expected = perceived(seen, body, mover.policy.speed)
            np.testing.assert_allclose(rivals.observed[o], expected, rtol=1e-6, atol=1e-7)
            distance = np.linalg.norm(target - here)
            if coming[o] and rivals.comes[o]:
                assert rivals.rewards[o] == pytest.approx((before[o] - distance) / setup.radius, abs=1e-12)
            before[o] = distance
    assert rivals.comes.any() and (len(chosen) == 2 or not places)
