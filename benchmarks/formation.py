"""`python -m benchmarks.formation`: from random starts to even figures, as the table of docs/formation.md."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

import escort_mj
from benchmarks.document import measure_page, table
from escort_mj.metrics.energy_ratio import energy_ratios
from escort_mj.numerics.formation import chords_exist
from escort_mj.scenario import parse_scenario

PAGE = "formation.md"
TEAMS = [(2, n) for n in range(3, 17)] + [(3, n) for n in (4, 5, 6, 8, 12, 20, 32)] + [(4, 8)]
SEEDS = 20
DURATION = 60.0
EVEN = 1.01  # energy over the least known: what counts as the figure
MISSION = """
duration: 60
seed: {seed}
axes: {axes}
robots: {{count: {count}, placement: {{within: 15, least_gap: 0.3}}}}
mission:
  radius: 5
  behaviors: [{{behavior: avoid_obstacles, safe_distance: 0.8}}, {behavior}, surface]
sensing: {{position: {{noise: 0.02}}, velocity: {{noise: 0.01}}}}
"""


class Trial(NamedTuple):
    """One mission to fly."""

    behavior: str
    axes: int
    count: int
    seed: int


class Result(NamedTuple):
    """What came of it."""

    ratio: float  # worst of the last two seconds; infinite where the mission did not complete
    formed: float  # time after which the ratio stays within bounds [s]; infinite for never
    contacts: int


def mission(trial: Trial) -> escort_mj.Scenario:
    """A mission from a random start within three radii."""
    return parse_scenario(MISSION.format(**trial._asdict()), "formation")


def judged(run: escort_mj.Run) -> Result:
    """How even the figure is at the end, and since when."""
    if not run.outcome.good:
        return Result(np.inf, np.inf, -1)
    ratios, time = energy_ratios(run.trace), run.trace["time"].values
    outside = np.flatnonzero(ratios > EVEN)
    later = [0.0, *time[1:], np.inf]
    formed = float(later[outside[-1] + 1]) if len(outside) else 0.0
    return Result(float(ratios[time >= DURATION - 2.0].max()), formed, int(run.values["contacts"] or 0))


def trials() -> list[Trial]:
    """All of them."""
    return [
        Trial(behavior, axes, count, seed)
        for axes, count in TEAMS
        for behavior in ("vertices", "repulsion", "chords")
        if behavior != "chords" or chords_exist(count, axes)
        for seed in range(1, SEEDS + 1)
    ]


def rows(found: dict[Trial, Result]) -> Iterator[list[str]]:
    """One row per team."""
    for axes, count in TEAMS:
        cells = []
        for behavior in ("vertices", "repulsion", "chords"):
            results = [
                r for t, r in found.items() if (t.behavior, t.axes, t.count) == (behavior, axes, count)
            ]
            if not results:
                cells += ["-", "-", "-"]
                continue
            share = np.mean([r.ratio <= EVEN for r in results])
            times = [r.formed for r in results if np.isfinite(r.formed)]
            touched = sum(r.contacts != 0 for r in results)
            cells += [
                f"{100.0 * share:.0f} %" + (f" ({touched} touched)" if touched else ""),
                f"{max(r.ratio for r in results):.5f}",
                f"{np.median(times):.1f}" if times else "-",
            ]
        yield [str(axes), str(count), *cells]


def tables() -> dict[str, str]:
    """Flies all missions on all cores, prints the table, and writes it into the docs if asked."""
    todo = trials()
    runs = escort_mj.run_many(map(mission, todo), traces=True)
    found = {trial: judged(run) for trial, run in zip(todo, runs, strict=True)}
    head = ["p", "n"]
    for behavior in ("vertices", "repulsion", "chords"):
        head += [behavior, "worst ratio", "median [s]"]
    return {"formation": table(head, rows(found))}


if __name__ == "__main__":
    measure_page(__doc__, PAGE, tables)
