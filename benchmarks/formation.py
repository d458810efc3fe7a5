"""`python -m benchmarks.formation`: from random starts to even figures, as the table of docs/formation.md."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

import escort_mj
from benchmarks.document import measure_page, table
from escort_mj.metrics.energy_ratio import energy_ratios
from escort_mj.numerics.formation import chords_exist

PAGE = "formation.md"
TEAMS = [(2, n) for n in range(3, 17)] + [(3, n) for n in (4, 5, 6, 8, 12, 20, 32)] + [(4, 8)]
BEHAVIORS = ("vertices", "repulsion", "chords")
SEEDS = range(1, 21)
DURATION, LAST = 60.0, 2.0  # s
EVEN = 1.01  # energy over the least known: what counts as the figure


def mission(behavior: str, axes: int, count: int, seed: int) -> escort_mj.Scenario:
    """A mission from a random start within three radii."""
    avoiding = {"behavior": "avoid_obstacles", "safe_distance": 0.8}
    keys: dict[str, Any] = {
        "name": "formation",
        "duration": DURATION,
        "seed": seed,
        "axes": axes,
        "robots": {"count": count, "placement": {"within": 15, "least_gap": 0.3}},
        "mission": {"radius": 5, "behaviors": [avoiding, behavior, "surface"]},
        "sensing": {"position": {"noise": 0.02}, "velocity": {"noise": 0.01}},
    }
    return escort_mj.load_scenario(keys)


def worst(run: escort_mj.Run) -> float:
    """How far from even the figure is at the end; infinite where the mission did not complete."""
    if not run.outcome.good:
        return np.inf
    return float(run.summary("energy_ratio", after=DURATION - LAST).iloc[-1])


def formed(run: escort_mj.Run) -> float:
    """Time after which the figure stays even [s]; infinite for never."""
    if not run.outcome.good or (ratios := energy_ratios(run.trace)) is None:
        return np.inf
    uneven, times = np.flatnonzero(ratios > EVEN), [*run.trace["time"].values, np.inf]
    return float(times[uneven[-1] + 1]) if len(uneven) else 0.0


def cells(behavior: str, axes: int, count: int) -> list[str]:
    """How many missions end even, the worst ratio, and when half of them are even."""
    if behavior == "chords" and not chords_exist(count, axes):
        return ["-", "-", "-"]
    runs = list(escort_mj.run_many((mission(behavior, axes, count, seed) for seed in SEEDS), traces=True))
    ratios = [worst(run) for run in runs]
    times = [time for time in map(formed, runs) if np.isfinite(time)]
    touched = sum(not run.outcome.good or run.values["contacts"] > 0 for run in runs)
    return [
        f"{100.0 * np.mean(np.array(ratios) <= EVEN):.0f} %" + (f" ({touched} touched)" if touched else ""),
        f"{max(ratios):.5f}",
        f"{np.median(times):.1f}" if times else "-",
    ]


def rows() -> Iterator[list[str]]:
    """One row per team."""
    for axes, count in TEAMS:
        found = [cell for behavior in BEHAVIORS for cell in cells(behavior, axes, count)]
        yield [str(axes), str(count), *found]


def tables() -> dict[str, str]:
    """Flies all missions on all cores, prints the table, and writes it into the docs if asked."""
    heads = [head for behavior in BEHAVIORS for head in (behavior, "worst ratio", "median [s]")]
    return {"formation": table(["p", "n", *heads], rows())}


if __name__ == "__main__":
    measure_page(__doc__, PAGE, tables)
