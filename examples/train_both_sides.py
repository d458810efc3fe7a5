"""Train an intruder and a defender in turns by the cross-entropy method.

The mission is the perimeter defense of scenarios/pursuit/perimeter.yaml, from random directions. Each side is
linear: it answers the sum of the vectors that it observes, each stretched and turned, as a share of its
speed. Both begin with what a person would write: the intruder runs to the target, the defender to the
intruder.

It writes the curve, and intruder.npz: the trained intruder for `policy: learned`. This takes a few minutes of
one core. Run: python examples/train_both_sides.py
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from escort_mj import load_scenario
from escort_mj.environments.simulation import Side, Simulation
from escort_mj.policies.learned import within_speed
from escort_mj.record.outcome import Outcome

Array = NDArray[np.float64]
MISSION = {
    "duration": 40,
    "expect": [],
    "recording.rate": 10,
    "physics.timestep": 0.005,
    "opponents[0].positions": None,
    "opponents[0].distance": 10,
    "opponents[0].policy": {"policy": "straight", "speed": 0.7},
}
POPULATION, ELITES, MISSIONS, TRIALS = 16, 4, 6, 24
TESTS = 40  # missions that were not used before
ROBOT, OPPONENT = 6, 11  # vectors that each observes
CHASE, RUN = {4: 3.0}, {0: 3.0}  # to the intruder that comes; to the target
TURN = np.array([[0.0, -1.0], [1.0, 0.0]])


def matrix(weights: Array) -> Array:
    """Return the layer that stretches and turns each vector, shape (2, 2 * vectors)."""
    return np.hstack([stretch * np.eye(2) + turn * TURN for stretch, turn in weights.reshape(-1, 2)])


def play(simulation: Simulation, robot: Array, opponent: Array, seed: int) -> tuple[float, bool]:
    """Return the intruder's reward, and whether it reached the perimeter; `robot` is not used by the law."""
    chase, run, earned = matrix(robot), matrix(opponent), 0.0
    simulation.reset(seed)
    rivals = simulation.rivals
    assert rivals is not None
    while simulation.outcome is Outcome.RUNNING and not rivals.over.any():
        simulation.step(within_speed(simulation.observe() @ chase.T), rivals.observed @ run.T)
        earned += float(rivals.rewards[0])
    return earned, bool(rivals.over.any() and rivals.rewards[0] > 0.0)


class Trainee:
    """One side: the mean and the spread of what it tries."""

    def __init__(self, vectors: int, start: dict[int, float], sign: float) -> None:
        self.mean, self.spread, self.sign = np.zeros(2 * vectors), np.full(2 * vectors, 0.5), sign
        for place, value in start.items():
            self.mean[2 * place] = value

    def improve(self, earn: list[float], tried: Array) -> None:
        """Move to the best of what was tried."""
        best = tried[np.argsort(-self.sign * np.array(earn), kind="stable")[:ELITES]]
        self.mean, self.spread = best.mean(axis=0), 0.7 * self.spread + 0.3 * best.std(axis=0)


def main() -> None:
    """Train, and say how often the intruder gets in."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--generations", type=int, default=16, help="of each side")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--law", action="store_true", help="the defender guards by the scenario's law")
    parser.add_argument("--folder", type=Path, default=Path("renders/both_sides"))
    asked = parser.parse_args()
    dice, began = np.random.default_rng(asked.seed), time.process_time()
    side_of: Side = "opponents" if asked.law else "both"
    simulation = Simulation(load_scenario("pursuit/perimeter", MISSION), side=side_of)
    robots, opponents = Trainee(ROBOT, CHASE, -1.0), Trainee(OPPONENT, RUN, 1.0)
    curve = []
    for generation in range(asked.generations + 1):
        won = [play(simulation, robots.mean, opponents.mean, 1000 + k)[1] for k in range(TRIALS)]
        curve.append({"won": float(np.mean(won)), "spent": time.process_time() - began})
        share, spent = 100 * curve[-1]["won"], curve[-1]["spent"]
        print(f"{generation:3d}: {share:3.0f} % get in after {spent:.0f} s", flush=True)
        if generation == asked.generations:
            break
        for side in [opponents, *[robots] * (not asked.law)]:
            tried = side.mean + side.spread * dice.normal(size=(POPULATION, len(side.mean)))
            tried[0] = side.mean
            seeds = dice.integers(2**31, size=MISSIONS)
            earned = []
            for each in tried:
                robot, opponent = (each, opponents.mean) if side is robots else (robots.mean, each)
                tries = [play(simulation, robot, opponent, int(seed))[0] for seed in seeds]
                earned.append(float(np.mean(tries)))
            side.improve(earned, tried)
    first = Trainee(ROBOT, CHASE, -1.0).mean, Trainee(OPPONENT, RUN, 1.0).mean
    for robot, defender in zip((first[0], robots.mean), ("first", "trained"), strict=True):
        for opponent, intruder in zip((first[1], opponents.mean), ("first", "trained"), strict=True):
            won = [play(simulation, robot, opponent, 2000 + k)[1] for k in range(TESTS)]
            print(f"{defender} defender, {intruder} intruder: {100 * np.mean(won):.0f} % get in")
    asked.folder.mkdir(parents=True, exist_ok=True)
    np.savez(asked.folder / "intruder.npz", weights_1=matrix(opponents.mean), bias_1=np.zeros(2))
    found = {"curve": curve, "robots": robots.mean.tolist(), "opponents": opponents.mean.tolist()}
    (asked.folder / "curve.json").write_text(json.dumps(found, indent=1))
    draw([each["won"] for each in curve], asked.folder / "curve.png")
    print(f"wrote {asked.folder}")


def draw(won: list[float], file: Path) -> None:
    """Draw in what share of missions the intruder gets in, generation by generation."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5.0, 2.8), layout="constrained")
    axes = figure.subplots()
    axes.plot(100 * np.array(won), ".-", color="tab:purple")
    axes.set(xlabel="generation of each side", ylabel="intruder gets in [%]", ylim=(0, 100))
    figure.savefig(file, dpi=120)


if __name__ == "__main__":
    main()
