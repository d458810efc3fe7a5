"""`python -m benchmarks.policies`: policies against the behaviors, as the tables of docs/environments.md."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
from cmaes import CMA
from numpy.typing import NDArray

from benchmarks.document import measure_page, table
from escort_mj import Run
from escort_mj.api import fly, load_scenario
from escort_mj.environments import Simulation
from escort_mj.measuring import measure_over
from escort_mj.record.outcome import Outcome
from escort_mj.record.window import Span
from escort_mj.scenario import Scenario

Array = NDArray[np.float64]
Policy = Callable[[Array], Array]

PAGE = "environments.md"
TRAINING, HELD_OUT = range(100, 104), range(10)  # seeds
GENERATIONS, SPREAD = 25, 0.3
CHORDS = {"mission.behaviors[1]": "chords"}  # the behavior of the measured missions
# Shares of the largest speed, and reaches in mission radii: by hand, and where the training starts.
BY_HAND = {
    "follow": 1.0,
    "radial": 1.5,
    "apart": 0.6,
    "apart_reach": 0.5,
    "clear": 1.0,
    "clear_reach": 0.2,
    "damp": 0.0,
}
METRICS = {
    "radius_error_mean": Span("tail"),
    "spacing_error_mean": Span("tail"),
    "robot_clearance_min": Span("whole"),
    "obstacle_clearance_min": Span("whole"),
    "force_rms": Span("tail"),
}


def policy(gains: Array, axes: int) -> Policy:
    """One policy for every robot: follow the target, keep the radius, keep away from others and obstacles.

    Args:
        gains: In the order of `BY_HAND`.
        axes: p.
    """
    follow, radial, apart, apart_reach, clear, clear_reach, damp = gains

    def command(seen: Array) -> Array:
        ways = seen.reshape(len(seen), -1, axes)
        target, moves, own, obstacle, mates = ways[:, 0], ways[:, 1], ways[:, 2], ways[:, 3], ways[:, 4:]
        told = follow * moves - damp * own
        distance = np.linalg.norm(target, axis=1, keepdims=True)
        told = told + radial * (distance - 1.0) * target / np.maximum(distance, 1e-9)
        told = told - clear * _push(obstacle, clear_reach)
        return np.asarray(told - apart * _push(mates, apart_reach).sum(axis=1))

    return command


def _push(ways: Array, reach: float) -> Array:
    """Toward each, the more the nearer; nothing where there is nobody."""
    length = np.linalg.norm(ways, axis=-1, keepdims=True)
    share = np.exp(-length / max(abs(reach), 1e-3)) / np.maximum(length, 1e-9)
    return np.asarray(np.where(length > 0.0, share * ways, 0.0))


def flown(scenario: Scenario, chosen: Policy) -> tuple[Run, float]:
    """A mission by a policy, and its mean reward per robot and sample."""
    simulation = Simulation(scenario)
    simulation.reset()
    total, count = 0.0, 0
    while simulation.outcome is Outcome.RUNNING:
        total += float(simulation.step(chosen(simulation.observe())).mean())
        count += 1
    broken = simulation.outcome is not Outcome.COMPLETED
    return simulation.run(), -100.0 if broken else total / count


def score(job: tuple[Array, int]) -> float:
    """Mean reward of gains on a training seed."""
    gains, seed = job
    scenario = load_scenario("main", CHORDS | {"seed": seed, "duration": 30.0, "expect": []})
    return flown(scenario, policy(gains, scenario.axes))[1]


def trained() -> Array:
    """Gains that CMA-ES finds on the training seeds."""
    search = CMA(mean=np.array(list(BY_HAND.values())), sigma=SPREAD, seed=1)
    best, found = -np.inf, np.array(list(BY_HAND.values()))
    with ProcessPoolExecutor(mp_context=get_context("forkserver")) as pool:
        for generation in range(GENERATIONS):
            asked = [search.ask() for _ in range(search.population_size)]
            jobs = [(gains, seed) for gains in asked for seed in TRAINING]
            rewards = np.array([*pool.map(score, jobs)]).reshape(len(asked), -1).mean(axis=1)
            search.tell([(gains, -reward) for gains, reward in zip(asked, rewards, strict=True)])
            if rewards.max() > best:
                best, found = float(rewards.max()), asked[int(rewards.argmax())]
            print(f"generation {generation + 1}: best reward so far {best:.4f}", flush=True)
    return found


def _row(name: str, runs: list[Run]) -> list[str]:
    values = [
        [measure_over(metric, run.trace, span).value for run in runs] for metric, span in METRICS.items()
    ]
    touched = sum((run.values["contacts"] or 0.0) > 0.0 for run in runs)
    passed = sum(run.passed for run in runs)
    return [
        name,
        f"{passed} of {len(runs)}",
        f"{touched}",
        *(f"{np.median(np.array(v, float)):.3g}" for v in values),
    ]


def _rows(gains: Array) -> Iterator[list[str]]:
    missions = [load_scenario("main", CHORDS | {"seed": seed}) for seed in HELD_OUT]
    yield _row("set-based and APD-SMC", [Run(fly(mission)) for mission in missions])
    by_hand = np.array(list(BY_HAND.values()))
    for name, chosen in (("policy, gains by hand", by_hand), ("policy, trained", gains)):
        yield _row(name, [flown(mission, policy(chosen, mission.axes))[0] for mission in missions])


def tables() -> dict[str, str]:
    """Trains, compares on held-out seeds, and writes the tables into the docs if asked."""
    gains = trained()
    units = ("radius error [m]", "spacing error [m]", "to robots [m]", "to obstacles [m]", "force [N]")
    head = ["controller", "verdicts passed", "missions with a touch", *units]
    found = [
        [f"`{name}`", f"{hand:g}", f"{value:.3g}"]
        for (name, hand), value in zip(BY_HAND.items(), gains, strict=True)
    ]
    return {
        "policies": table(head, _rows(gains)),
        "gains": table(["gain", "by hand", "trained"], found),
    }


if __name__ == "__main__":
    measure_page(__doc__, PAGE, tables)
