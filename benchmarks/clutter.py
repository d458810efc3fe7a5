"""`python -m benchmarks.clutter`: teams of eight through random clutter, as the table of docs/clutter.md."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

import escort_mj
from benchmarks.document import measure_page, table
from escort_mj.scenario import parse_scenario

PAGE = "clutter.md"
SEEDS = range(1, 11)
SHAPES = "[sphere, box, cylinder, capsule, ellipsoid]"
MISSIONS = {
    2: """
duration: 120
seed: {seed}
target: {{position: ["0.4*t", "2*sin(0.1*t)"]}}
robots: {{count: 8, placement: {{within: 6}}}}
clutter: {{count: 16, low: [8, -9], high: [44, 9], passage: 1.8, shapes: {shapes}}}
mission:
  radius: 4
  max_speed: 2
  behaviors: [{{behavior: avoid_obstacles, safe_distance: 0.5}}, vertices, surface]
sensing: {{position: {{noise: 0.02}}, velocity: {{noise: 0.01}}}}
uncertainty: {{disturbance: ["0.5*sin(0.5*t)", "0.5*sin(0.7*t)"]}}
""",
    3: """
duration: 120
seed: {seed}
axes: 3
target: {{position: ["0.4*t", "2*sin(0.1*t)", "cos(0.1*t)"]}}
robots: {{count: 8, placement: {{within: 6}}}}
clutter: {{count: 24, low: [8, -7, -7], high: [42, 7, 7], passage: 1.8, shapes: {shapes}}}
mission:
  radius: 4
  max_speed: 2
  behaviors: [{{behavior: avoid_obstacles, safe_distance: 0.5}}, vertices, surface]
sensing: {{position: {{noise: 0.02}}, velocity: {{noise: 0.01}}}}
uncertainty: {{disturbance: ["0.5*sin(0.5*t)", "0.5*sin(0.7*t)", "0.5*cos(0.5*t)"]}}
""",
}


class Trial(NamedTuple):
    """One mission to fly."""

    axes: int
    seed: int


class Result(NamedTuple):
    """What came of it."""

    completed: bool
    touches: tuple[str, ...]  # who, when, how hard
    to_obstacles: float  # least clearance of a robot to an obstacle [m]
    to_robots: float  # and to another robot [m]
    avoided: float  # share of robots' time under avoidance
    left_behind: float  # largest distance of a robot from the ring [m], after the start
    error: float  # mean distance of robots from the ring in the last 2 s [m]


def judged(run: escort_mj.Run) -> Result:
    """What came of a mission."""
    trace = run.trace
    time, names = trace["time"].values, trace["body"].values
    distance = np.linalg.norm(trace["q"].values - trace["target_position"].values[:, None], axis=2)
    error = np.abs(distance - float(trace.attrs["mission_radius"]))
    touches = [
        f"{names[int(episode['episode_first'])]} and {names[int(episode['episode_second'])]} at "
        f"{float(episode['episode_start']):.1f} s, {float(episode['episode_peak_force']):.1f} N"
        for episode in (trace.isel(episode=k) for k in range(trace.sizes["episode"]))
    ]
    return Result(
        bool(time[-1] > 119.9),
        tuple(touches),
        float(trace["clearance"].sel(group="obstacles").min()),
        float(trace["clearance"].sel(group="robots").min()),
        float(trace["avoidance_active"].values.mean()),
        float(error[time > 10.0].max()),
        float(error[time >= 118.0].mean()),
    )


def rows(found: dict[Trial, Result]) -> Iterator[list[str]]:
    """One row per mission."""
    for trial, result in found.items():
        yield [
            str(trial.axes),
            str(trial.seed),
            "; ".join(result.touches) or ("none" if result.completed else "did not complete"),
            f"{result.to_obstacles:.3f}",
            f"{result.to_robots:.3f}",
            f"{100.0 * result.avoided:.1f} %",
            f"{result.left_behind:.2f}",
            f"{result.error:.4f}",
        ]


def shares(found: dict[Trial, Result]) -> Iterator[list[str]]:
    """Missions without a touch, of each number of axes."""
    for axes in MISSIONS:
        results = [result for trial, result in found.items() if trial.axes == axes]
        clear = sum(result.completed and not result.touches for result in results)
        yield [str(axes), f"{clear} of {len(results)}", f"{min(r.to_obstacles for r in results):.3f}"]


def tables() -> dict[str, str]:
    """Flies all missions on all cores, prints the tables, and writes them into the docs if asked."""
    todo = [Trial(axes, seed) for axes in MISSIONS for seed in SEEDS]
    texts = (MISSIONS[trial.axes].format(seed=trial.seed, shapes=SHAPES) for trial in todo)
    runs = escort_mj.run_many((parse_scenario(text, "clutter") for text in texts), traces=True)
    found = {trial: judged(run) for trial, run in zip(todo, runs, strict=True)}
    head = ["p", "seed", "touches", "to obstacles [m]", "to robots [m]", "avoiding"]
    head += ["farthest off the ring [m]", "off the ring at the end [m]"]
    return {
        "shares": table(["p", "no touch", "least clearance to an obstacle [m]"], shares(found)),
        "clutter": table(head, rows(found)),
    }


if __name__ == "__main__":
    measure_page(__doc__, PAGE, tables)
