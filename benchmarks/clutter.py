"""`python -m benchmarks.clutter`: teams of eight through random clutter, as the table of docs/clutter.md."""

from __future__ import annotations

from typing import Any

import numpy as np

import escort_mj
from benchmarks.document import measure_page, table_of
from escort_mj.scenario import parse_scenario

PAGE = "clutter.md"
SEEDS = range(1, 11)
CLEAR = "none"
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


COLUMNS = {
    "p": "{axes}",
    "seed": "{seed}",
    "touches": "{touches}",
    "to obstacles [m]": "{to_obstacles:.3f}",
    "to robots [m]": "{to_robots:.3f}",
    "avoiding": "{avoiding:.1f} %",
    "farthest off the ring [m]": "{left_behind:.2f}",
    "off the ring at the end [m]": "{error:.4f}",
}
SHARES = {
    "p": "{axes}",
    "no touch": "{clear} of {missions}",
    "least clearance to an obstacle [m]": "{to_obstacles:.3f}",
}


def judged(axes: int, seed: int, run: escort_mj.Run) -> dict[str, Any]:
    """What came of a mission: who touched whom, when and how hard; least clearances [m]; the robots' time
    under avoidance [%]; their distance from the ring [m], largest after the start and mean at the end."""
    trace = run.trace
    time, names = trace["time"].values, trace["body"].values
    distance = np.linalg.norm(trace["q"].values - trace["target_position"].values[:, None], axis=2)
    error = np.abs(distance - float(trace.attrs["mission_radius"]))
    touches = [
        f"{names[int(episode['episode_first'])]} and {names[int(episode['episode_second'])]} at "
        f"{float(episode['episode_start']):.1f} s, {float(episode['episode_peak_force']):.1f} N"
        for episode in (trace.isel(episode=k) for k in range(trace.sizes["episode"]))
    ]
    return {
        "axes": axes,
        "seed": seed,
        "touches": "; ".join(touches) or (CLEAR if time[-1] > 119.9 else "did not complete"),
        "to_obstacles": float(trace["clearance"].sel(group="obstacles").min()),
        "to_robots": float(trace["clearance"].sel(group="robots").min()),
        "avoiding": 100.0 * float(trace["avoidance_active"].values.mean()),
        "left_behind": float(error[time > 10.0].max()),
        "error": float(error[time >= 118.0].mean()),
    }


def share(axes: int, found: list[dict[str, Any]]) -> dict[str, Any]:
    """Missions without a touch, of those with so many axes."""
    some = [each for each in found if each["axes"] == axes]
    clear = sum(each["touches"] == CLEAR for each in some)
    least = min(each["to_obstacles"] for each in some)
    return {"axes": axes, "clear": clear, "missions": len(some), "to_obstacles": least}


def tables() -> dict[str, str]:
    """Flies all missions on all cores."""
    todo = [(axes, seed) for axes in MISSIONS for seed in SEEDS]
    texts = (MISSIONS[axes].format(seed=seed, shapes=SHAPES) for axes, seed in todo)
    runs = escort_mj.run_many((parse_scenario(text, "clutter") for text in texts), traces=True)
    found = [judged(*trial, run) for trial, run in zip(todo, runs, strict=True)]
    shares = [share(axes, found) for axes in MISSIONS]
    return {"shares": table_of(shares, SHARES), "clutter": table_of(found, COLUMNS)}


if __name__ == "__main__":
    measure_page(__doc__, PAGE, tables)
