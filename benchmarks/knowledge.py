"""`python -m benchmarks.knowledge`: teams that know only what they see and hear, as docs/knowledge.md."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

import escort_mj
from benchmarks.bare import against_bare
from benchmarks.crowds import crowd
from benchmarks.document import grid, measure_page, swept, table
from escort_mj.study.sweeps.statistics import Summary

if TYPE_CHECKING:
    import pandas

PAGE = "knowledge.md"
MISSIONS = (
    "blind", "relay", "lossy", "split_and_rejoin", "two_convoys", "auction", "crossing", "lines_of_sight",
    "lidar",
)  # fmt: skip
SEEDS = range(1, 21)
FEWER = range(1, 11)
ERRORS = ("radius_error_mean", "spacing_error_max")
SETTLED = 45.0  # s: when a mission of 60 s has settled
TEAMS = {  # axes, range of the radio [m] and those that see the target, by the number of robots
    5: (2, 5.0, [1]),
    8: (2, 4.0, [1]),
    6: (3, 6.0, [1]),
    12: (3, 4.4, [1, 2]),
}
NOISES = (0.0, 0.005, 0.02)  # m and m/s
RADIO = {"rate": 10.0, "delay": 0.1, "loss": 0.2}
APART: dict[str, Any] = {
    "knowledge": {
        "target": {"rate": 50.0, "noise": {"position": 0.005, "velocity": 0.005}},
        "estimator": {"estimator": "kalman", "model": "acceleration", "noise": 0.02},
    }
}
COSTS = {50: (2000, 200), 500: (400, 20)}  # robots of a crowd: steps before, and of a round
ROUNDS = 15


def missions() -> Iterator[list[str]]:
    """How many seeds of each scenario pass, and the worst value of each verdict."""
    for name in MISSIONS:
        base = escort_mj.load_scenario(f"knowledge/{name}")
        runs = list(escort_mj.run_many([base.replace({"seed": seed}) for seed in SEEDS]))
        passed = sum(all(verdict.passed for verdict in run.verdicts) for run in runs)
        worst = [min((run.verdicts[k] for run in runs), key=nearest) for k in range(1, len(runs[0].verdicts))]
        told = "; ".join(f"{each.metric} {each.value:.3g} ({each.demanded})" for each in worst)
        yield [name, f"{passed} of {len(runs)}", told]


def nearest(verdict: Any) -> float:
    """How far a verdict is from failing, negative if it has failed."""
    return float(verdict.margin)


def team(count: int, noise: float) -> Any:
    """A ring or a sphere of robots of which few see the target, with errors of this size."""
    axes, reach, seers = TEAMS[count]
    path = ["0.5*t", "2*sin(0.15*t)", "sin(0.1*t)"][:axes]
    noises = {"position": noise, "velocity": noise}
    return escort_mj.load_scenario("knowledge/blind").replace(
        {
            "axes": axes, "robots.count": count, "robots.placement.within": 6.0, "target.position": path,
            "knowledge.target.robots": seers, "knowledge.target.noise": noises,
            "communication.range": reach,
            "expect": [{"metric": name, "at_most": 1e3, "after": SETTLED} for name in ERRORS],
        }
    )  # fmt: skip


def errors(scenarios: Iterable[Any]) -> tuple[np.ndarray, np.ndarray]:
    """Tail errors of radius (mean) and spacing (largest) of each run [m]."""
    found = [
        [verdict.value for verdict in run.verdicts[-len(ERRORS) :]]
        for run in escort_mj.run_many(list(scenarios))
    ]
    radius, spacing = np.array(found, dtype=float).T
    return radius, spacing


def precision() -> Iterator[list[str]]:
    """Teams of few that see, against those in which all know the target, or all see it for themselves."""
    for count, (axes, reach, seers) in TEAMS.items():
        known: np.ndarray | None = None
        for noise in NOISES:
            few = [team(count, noise).replace({"seed": seed}) for seed in FEWER]
            if known is None:
                everything = {"knowledge": None, "communication": None}
                known, evenly = errors([each.replace(everything) for each in few])
                ends = f"{1e3 * known.mean():.1f}", f"{1e3 * evenly.max():.0f}"
            radius, spacing = errors(few)
            seeing, _ = errors(
                [each.replace({"knowledge.target.robots": None, "communication": None}) for each in few]
            )
            yield [
                f"{count}, {axes} axes, {reach:g} m", f"{len(seers)}", f"{1e3 * noise:g}", ends[0],
                f"{1e3 * seeing.mean():.1f}", f"{1e3 * radius.mean():.1f}",
                f"**{(radius / known).mean():.2f}** ({(radius / known).max():.2f})",
                f"**{(radius / seeing).mean():.2f}** ({(radius / seeing).max():.2f})",
                f"{ends[1]} / {1e3 * spacing.max():.0f}",
            ]  # fmt: skip


def radio() -> Iterator[list[str]]:
    """Tail errors of the radius by range, delay and loss: median and interval [mm], and what fails."""

    def cell(runs: pandas.DataFrame) -> str:
        found = Summary(1e3 * runs["radius_error_mean_after_45"])
        low, high = found.median_interval
        told = f"{found.median:.2g} ({low:.2g} to {high:.2g})"
        passed = int(runs["passed"].sum())
        return told if passed == len(runs) else f"{told}; {passed} of {len(runs)} pass"

    for case, runs in swept("studies/robustness_radio").groupby("case", sort=False):
        delays = grid(runs, "communication.delay", "communication.loss", cell, lambda delay: f"{delay:g}")
        yield from ([str(case), *row] for row in delays)


def costs() -> Iterator[list[str]]:
    """The loop against bare `mj_step`, with all known, and with all of sight, radio and estimators."""
    repel = [{"behavior": "avoid_obstacles", "safe_distance": 0.8, "teammate_distance": 0.25},
             "repulsion", "surface"]  # fmt: skip
    cases: dict[int, Any] = {5: ("knowledge/blind", {}, 2000, 1000)}
    for count, turns in COSTS.items():
        shared = APART | {"communication": RADIO | {"range": 3.0, "neighbors": 8}}
        cases[count] = ("crowd", crowd(count) | {"mission.behaviors": repel} | shared, *turns)
    alone = {"knowledge": None, "communication": None}
    for count, (mission, keys, before, steps) in cases.items():
        base = {"expect": [], "duration": 1000.0, **keys}
        both = {
            name: escort_mj.load_scenario(mission, base | more)
            for name, more in (("known", alone), ("told", {}))
        }
        times, ratios = against_bare(both, before, steps, ROUNDS)
        bare = times["told"]
        spent = {name: f"{1e9 * bare * (ratio - 1.0) / count:.0f}" for name, ratio in ratios.items()}
        shown = [f"**{ratio:.2f}**" for ratio in ratios.values()]
        yield [f"{count}", f"{1e6 * bare:.3g}", *shown, *spent.values()]


HEADS = {
    "knowledge missions": ["scenario", "seeds that pass", "worst of all seeds (demanded)"],
    "knowledge precision": [
        "robots, radio", "see it", "noise [mm, mm/s]", "all know it [mm]", "all see it [mm]",
        "few see it [mm]",
        "few / all know", "few / all see", "spacing, all know / few see [mm]",
    ],
    "knowledge radio": ["", "delay [s]", "no loss", "20 %", "50 %", "80 %"],
    "knowledge costs": [
        "robots", "bare [us]", "all know / bare", "looks and radio / bare", "all know, per robot [ns]",
        "looks and radio, per robot [ns]",
    ],
}  # fmt: skip


def tables() -> dict[str, str]:
    """Measures everything."""
    rows = {
        "knowledge missions": missions(),
        "knowledge precision": precision(),
        "knowledge radio": radio(),
        "knowledge costs": costs(),
    }
    return {name: table(HEADS[name], rows[name]) for name in HEADS}


if __name__ == "__main__":
    measure_page(__doc__, PAGE, tables)
