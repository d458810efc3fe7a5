"""Train an intruder and a defender in turns by the cross-entropy method.

The mission is the perimeter defense of scenarios/pursuit/perimeter.yaml, from random directions. Each side is
linear: it answers the sum of the vectors that it observes, each stretched and turned, as a share of its
speed. Both begin with what a person would write: the intruder runs to the target, the defender to the
intruder.

It writes the curve, who wins against whom, and intruder.npz: the trained intruder for `policy: learned`.
It trains for less than ten minutes of one core. Run: python examples/train_both_sides.py
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
from escort_mj.study.sweeps.statistics import proportion_of

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
GUARD = {"behavior": "guard", "gain": 10}
INTERCEPT = {"behavior": "intercept", "quarry": "opponents", "within": 0.1}
LAWS: dict[str, list[object]] = {  # behaviors of a defender that is not trained
    "surface, guard": ["surface", GUARD],
    "guard": [GUARD],
    "guard, alert 8": [GUARD | {"alert": 8}, "surface"],
    "intercept": [INTERCEPT],
    "intercept, alert 8": [INTERCEPT | {"alert": 8}, "surface"],
}
GENERATIONS, POPULATION, ELITES, TRIALS = 56, 16, 4, 48
ROBOT, OPPONENT = 6, 11  # vectors that each observes
CHASE, RUN = {4: 3.0}, {0: 3.0}  # to the intruder that comes; to the target
TURN = np.array([[0.0, -1.0], [1.0, 0.0]])


def matrix(weights: Array) -> Array:
    """Return the layer that stretches and turns each vector, shape (2, 2 * vectors)."""
    return np.hstack([stretch * np.eye(2) + turn * TURN for stretch, turn in weights.reshape(-1, 2)])


def prepare(law: str | None) -> Simulation:
    """Return the mission with a defender that is commanded, or has behaviors."""
    side: Side = "both" if law is None else "opponents"
    behaviors = {} if law is None else {"mission.behaviors": LAWS[law]}
    return Simulation(load_scenario("pursuit/perimeter", MISSION | behaviors), side=side)


def play(simulation: Simulation, robot: Array, opponent: Array, seed: int) -> tuple[float, bool]:
    """Return the intruder's reward, and whether it got in; a defender with behaviors does not use `robot`."""
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


def train(
    simulation: Simulation,
    both: list[Trainee],
    sides: list[Trainee],
    missions: int,
    dice: np.random.Generator,
) -> None:
    """Improve each of the sides, one after the other, against what the other one does now."""
    for side in sides:
        tried = side.mean + side.spread * dice.normal(size=(POPULATION, len(side.mean)))
        tried[0] = side.mean
        seeds = dice.integers(2**31, size=missions)
        earned = []
        for each in tried:
            robot, opponent = (each if one is side else one.mean for one in both)
            tries = [play(simulation, robot, opponent, int(seed))[0] for seed in seeds]
            earned.append(float(np.mean(tries)))
        side.improve(earned, tried)


def share(simulation: Simulation, robot: Array, opponent: Array, tests: int) -> str:
    """Return how often the intruder gets in, in missions that were not used before, with its interval."""
    found = proportion_of([play(simulation, robot, opponent, 2000 + k)[1] for k in range(tests)], "wilson")
    low, high = (100 * bound for bound in found.interval)
    return f"{100 * found.share:.0f} ({low:.0f} to {high:.0f})"


def main(arguments: list[str] | None = None) -> None:
    """Train, and say how often the intruder gets in."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--generations", type=int, default=GENERATIONS, help="of each side")
    parser.add_argument("--missions", type=int, default=6, help="that each attempt is played in")
    parser.add_argument("--seed", type=int, default=0)
    words = f"behaviors of the defender, which is then not trained: {' or '.join(map(repr, LAWS))}"
    parser.add_argument("--law", choices=LAWS, metavar="BEHAVIORS", help=words)
    parser.add_argument("--tests", type=int, default=300, help="missions of each pair at the end")
    parser.add_argument("--folder", type=Path, default=Path("renders/both_sides"))
    asked = parser.parse_args(arguments)
    dice, simulation = np.random.default_rng(asked.seed), prepare(asked.law)
    robots, opponents = Trainee(ROBOT, CHASE, -1.0), Trainee(OPPONENT, RUN, 1.0)
    first, curve, spent = (robots.mean, opponents.mean), [], 0.0
    for generation in range(asked.generations + 1):
        if generation:
            began = time.process_time()
            sides = [opponents, *[robots] * (not asked.law)]
            train(simulation, [robots, opponents], sides, asked.missions, dice)
            spent += time.process_time() - began
        won = [play(simulation, robots.mean, opponents.mean, 1000 + k)[1] for k in range(TRIALS)]
        curve.append({"won": float(np.mean(won)), "spent": spent})
        print(f"{generation:3d}: {100 * curve[-1]['won']:3.0f} % get in after {spent:.0f} s", flush=True)
    intruders = {"first": first[1], "trained": opponents.mean}
    defenders: dict[str, tuple[Simulation, Array]] = {}
    if not asked.law:
        defenders = {"first": (simulation, first[0]), "trained": (simulation, robots.mean)}
    defenders |= {law: (prepare(law), first[0]) for law in LAWS}
    table = {
        name: {which: share(place, robot, intruder, asked.tests) for which, intruder in intruders.items()}
        for name, (place, robot) in defenders.items()
    }
    for name, row in table.items():
        print(f"{name}: " + "; ".join(f"{which} intruder {won} %" for which, won in row.items()), flush=True)
    asked.folder.mkdir(parents=True, exist_ok=True)
    np.savez(asked.folder / "intruder.npz", weights_1=matrix(opponents.mean), bias_1=np.zeros(2))
    found = {
        "curve": curve,
        "table": table,
        "robots": robots.mean.tolist(),
        "opponents": opponents.mean.tolist(),
    }
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
