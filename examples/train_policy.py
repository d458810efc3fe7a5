"""Train a policy for the mission `main` with an evolution strategy: a minute or two on two cores.

python examples/train_policy.py [GENERATIONS]

Every robot has the same policy: a weighted sum of the vectors that it observes (the way to the target,
velocities, the ways to the nearest obstacle and to teammates), each once as it is and once with a length near
to 1. Each mission of the vector environment tries other weights, all from the same start.
"""

import sys

import numpy as np
from cmaes import CMA

import escort_mj
from escort_mj.environments.vector import EscortVectorEnv

CANDIDATES = 16
TEST_SEEDS = range(1000, 1000 + CANDIDATES)


def commands(weights, observed, axes):
    """Commands of all robots (candidates, robots, axes), given weights (candidates, vectors, 2)."""
    vectors = observed.reshape(*observed.shape[:2], -1, axes)
    length = np.linalg.norm(vectors, axis=3, keepdims=True)
    as_it_is, direction = weights[:, None, :, :1], weights[:, None, :, 1:]
    return ((as_it_is + direction / (length + 0.2)) * vectors).sum(axis=2)


def rewards(environment, weights, seeds):
    """Mean reward per robot and step of each candidate, over one mission each."""
    axes = environment.single_action_space.shape[1]
    observed, _ = environment.reset(seed=list(seeds))
    total, steps, over = 0.0, 0, np.zeros(CANDIDATES, dtype=bool)
    while not over.any():
        observed, reward, terminated, truncated, _ = environment.step(commands(weights, observed, axes))
        over = terminated | truncated
        total, steps = total + reward, steps + 1
    return np.where(terminated, -100.0, total / steps)


def main(generations: int = 40, duration: float = 12.0) -> list[float]:
    """Train, print the learning curve, and compare with the start on missions that were not trained on."""
    scenario = escort_mj.load_scenario("main", {"duration": duration, "expect": []})
    environment = EscortVectorEnv(CANDIDATES, scenario)
    robots, axes = environment.single_action_space.shape
    shape = CANDIDATES, environment.single_observation_space.shape[1] // axes, 2
    search = CMA(mean=np.zeros(shape[1] * 2), sigma=0.1, population_size=CANDIDATES, seed=1)
    curve = []
    for generation in range(generations):
        asked = [search.ask() for _ in range(CANDIDATES)]
        found = rewards(environment, np.reshape(asked, shape), [generation] * CANDIDATES)
        search.tell([(weights, -reward) for weights, reward in zip(asked, found, strict=True)])
        curve.append(float(np.median(found)))
        print(
            f"generation {generation + 1:3}: median reward {curve[-1]:8.3f}, best {found.max():8.3f}",
            flush=True,
        )
    for name, weights in (("rest", np.zeros(shape[1] * 2)), ("trained", search.mean)):
        tested = rewards(environment, np.broadcast_to(weights.reshape(shape[1:]), shape), TEST_SEEDS)
        print(f"{name}: {tested.mean():.3f} on {CANDIDATES} other missions")
    environment.close()
    return curve


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]))
