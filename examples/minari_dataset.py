"""Missions that a scenario's own controller flies, stored with Minari for imitation or offline learning.

Run it: pip install 'escort-mj[rl]' 'minari[hdf5]'; python examples/minari_dataset.py main my/main-v0 20
"""

import sys

import gymnasium
import minari
import numpy as np
from minari.data_collector import EpisodeBuffer

import escort_mj
import escort_mj.environments  # registers escort_mj/Escort-v0


def record(scenario: str, dataset: str, seeds: int) -> minari.MinariDataset:
    """Command the velocities that the controller chose, sample by sample, and store what was observed."""
    environment = gymnasium.make("escort_mj/Escort-v0", scenario=scenario)
    fastest, episodes = environment.unwrapped.simulation.scale, []
    for seed in range(seeds):
        mission = escort_mj.load_scenario(scenario, {"seed": seed})
        chosen = escort_mj.run(mission).trace["v_d"].values / fastest
        observations, steps = [environment.reset(seed=seed)[0]], []
        for action in np.clip(chosen, -1.0, 1.0).astype(np.float32):
            observed, *step, _ = environment.step(action)
            observations.append(observed)
            steps.append((action, *step))
            if any(step[1:]):
                break
        episodes.append(
            EpisodeBuffer(None, seed, None, observations, *map(list, zip(*steps, strict=True)), {})
        )
    return minari.create_dataset_from_buffers(
        dataset, episodes, env=environment.spec, algorithm_name=mission.law_names
    )


if __name__ == "__main__":
    stored = record(sys.argv[1], sys.argv[2], int(sys.argv[3]))
    print(f"{stored.total_episodes} missions, {stored.total_steps} commands")
