"""`python -m benchmarks.formation`: from random starts to even figures, as the table of docs/formation.md."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from typing import Any, NamedTuple

os.environ.setdefault("MUJOCO_GL", "disable")

import numpy as np  # noqa: E402

from benchmarks.document import publish, table, wants_docs  # noqa: E402
from escort_mj.mission import fly  # noqa: E402
from escort_mj.numerics.formation import chords_exist  # noqa: E402
from escort_mj.scenario import parse_scenario  # noqa: E402
from escort_mj.study.engine.parallel import cores, side_by_side  # noqa: E402

PAGE = "formation.md"
TEAMS = [(2, n) for n in range(3, 17)] + [(3, n) for n in (4, 5, 6, 8, 12, 20, 32)] + [(4, 8)]
SEEDS = 20
RADIUS, DURATION = 5.0, 60.0
EVEN = 1.01  # energy over the least known: what counts as the figure
MISSION = """
duration: {duration}
seed: {seed}
axes: {axes}
robots: {{count: {count}, placement: {{within: {within}, least_gap: 0.3}}}}
mission:
  radius: {radius}
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


def attempt(trial: Trial) -> Result:
    """Flies one mission from a random start within three radii."""
    text = MISSION.format(
        duration=DURATION, radius=RADIUS, within=3.0 * RADIUS, axes=trial.axes, count=trial.count,
        seed=trial.seed, behavior=trial.behavior,
    )  # fmt: skip
    run = fly(parse_scenario(text, "formation"))
    if not run.outcome.good:
        return Result(np.inf, np.inf, -1)
    ratios, time = ratio_over_time(run.trace), run.trace["time"].values
    outside = np.flatnonzero(ratios > EVEN)
    formed = (
        0.0 if not len(outside) else float(time[outside[-1] + 1]) if outside[-1] + 1 < len(time) else np.inf
    )
    return Result(float(ratios[time >= DURATION - 2.0].max()), formed, int(run.metrics["contacts"]["value"]))


def ratio_over_time(trace: Any) -> np.ndarray:
    """Coulomb energy of the directions over the least known, sample by sample."""
    offset = trace["q"].values - trace["target_position"].values[:, None]
    directions = offset / np.linalg.norm(offset, axis=2, keepdims=True)
    i, j = np.triu_indices(trace.sizes["robot"], 1)
    energies = (1.0 / np.linalg.norm(directions[:, i] - directions[:, j], axis=2)).sum(axis=1)
    return np.asarray(energies / np.atleast_1d(trace.attrs["least_energy"])[0])


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


def main(arguments: Any = None) -> None:
    """Flies all missions on all cores, prints the table, and writes it into the docs if asked."""
    write = wants_docs(__doc__, PAGE, arguments)

    def progress(done: float, total: float) -> None:
        if sys.stderr.isatty():
            print(f"\r{done:.0f}/{total:.0f} missions", end="", file=sys.stderr, flush=True)

    todo = trials()
    found = dict(zip(todo, side_by_side(attempt, todo, cores(), progress), strict=True))
    head = ["p", "n"]
    for behavior in ("vertices", "repulsion", "chords"):
        head += [behavior, "worst ratio", "median [s]"]
    publish(PAGE, {"formation": table(head, rows(found))}, write)


if __name__ == "__main__":
    main()
