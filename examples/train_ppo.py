"""Train a policy by PPO, fly it as the behavior `learned`, and judge it beside the paper's behaviors.

    pip install 'escort-mj[rl]' stable-baselines3
    python examples/train_ppo.py [STEPS]

All robots share the policy: each robot of each mission is an environment of Stable-Baselines3, with its own
observation and reward. The trained network goes into policy.npz. In the end, missions of 20 seeds that were
not used in training are flown and judged: with the behaviors of `main`, and with the network in place of all
but the avoidance of obstacles. A million steps take four minutes on two free cores.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import torch
from gymnasium.spaces import Box
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecEnv, VecMonitor, VecNormalize

import escort_mj
from escort_mj.environments import Reward
from escort_mj.environments.vector import EscortVectorEnv
from escort_mj.scenario.reader.dump import short_dump

MISSIONS, SEEDS = 16, range(1000, 1020)
RATE = 10  # commands per second
TRAINING = {"recording.rate": RATE, "expect": []}
REWARD = Reward(touch=10)
AVOID = {"behavior": "avoid_obstacles", "safe_distance": 0.8}


class Robots(VecEnv):
    """The robots of many missions, each as an environment of its own."""

    def __init__(self, missions: int, scenario: escort_mj.Scenario) -> None:
        self.missions = EscortVectorEnv(missions, scenario, reward=REWARD, autoreset_mode="Disabled")
        self.team, axes = self.missions.single_action_space.shape
        width = self.missions.single_observation_space.shape[1]
        super().__init__(missions * self.team, Box(-10.0, 10.0, (width,)), Box(-1.0, 1.0, (axes,)))

    def reset(self) -> np.ndarray:
        """Start all missions."""
        return self._by_robot(self.missions.reset()[0])

    def step_async(self, actions: np.ndarray) -> None:
        """Take the actions of the next step."""
        self._actions = actions.reshape(self.missions.action_space.shape)

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """Step all missions; those that end begin again."""
        observed, _, terminated, truncated, infos = self.missions.step(self._actions)
        over = terminated | truncated
        told: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for k in np.flatnonzero(over):
            for i, last in enumerate(observed[k], k * self.team):
                told[i] = {"terminal_observation": last, "TimeLimit.truncated": truncated[k]}
        if over.any():
            observed, _ = self.missions.reset(options={"reset_mask": over})
        return self._by_robot(observed), infos["rewards"].ravel(), np.repeat(over, self.team), told

    def _by_robot(self, values: np.ndarray) -> np.ndarray:
        return values.reshape(self.num_envs, -1)

    def close(self) -> None:
        """End the threads."""
        self.missions.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Return an attribute, which all robots share."""
        return [getattr(self.missions, attr_name, None) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Refuse: nothing can be set."""
        raise NotImplementedError

    def env_method(self, method_name: str, *method_args: Any, indices: Any = None, **more: Any) -> list[Any]:
        """Refuse: robots have no methods."""
        raise NotImplementedError

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        """Return that none is."""
        return [False for _ in self._get_indices(indices)]


def save(policy: Any, path: Path) -> None:
    """Write a policy's network as the behavior `learned` reads it."""
    layers = [layer for layer in policy.mlp_extractor.policy_net if isinstance(layer, torch.nn.Linear)]
    arrays = {}
    for number, layer in enumerate([*layers, policy.action_net], 1):
        arrays[f"weights_{number}"] = layer.weight.detach().numpy().astype(float)
        arrays[f"bias_{number}"] = layer.bias.detach().numpy().astype(float)
    np.savez(path, **arrays)


def judge(name: str, missions: Iterable[escort_mj.Scenario]) -> None:
    """Fly missions, and print how many meet their expectations, and medians of what these look at."""
    runs = list(escort_mj.run_many(missions))
    print(f"{name}: {sum(run.passed for run in runs)} of {len(runs)} missions passed")
    for number, verdict in enumerate(runs[0].verdicts):
        held = [run.verdicts[number] for run in runs]
        values = [one.value for one in held if one.value is not None]
        median = f", median {np.median(values):.3g} {verdict.unit}" if values else ""
        print(f"  {verdict.title}: {sum(one.passed for one in held)}{median}")


def main(steps: int = 1_000_000, folder: Path = Path()) -> None:
    """Train, save the network, and judge it."""
    robots = Robots(MISSIONS, escort_mj.load_scenario("main", TRAINING))
    scaled = VecNormalize(VecMonitor(robots), norm_obs=False)
    model = PPO("MlpPolicy", scaled, n_steps=32, batch_size=512, gamma=0.95, seed=1, verbose=1, device="cpu")
    model.learn(steps)
    scaled.close()
    save(model.policy, folder / "policy.npz")
    mission = folder / "mission.yaml"  # a scenario finds files beside it
    mission.write_text(short_dump(escort_mj.load_scenario("main")))
    learned = {"behavior": "learned", "network": "policy.npz", "interval": 1 / RATE}
    for name, behaviors in (("paper's behaviors", {}), ("policy", {"mission.behaviors": [AVOID, learned]})):
        judge(name, (escort_mj.load_scenario(mission, behaviors | {"seed": seed}) for seed in SEEDS))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]))
