"""`python -m benchmarks.clutter`: teams of eight through random clutter, as the table of docs/clutter.md."""

from __future__ import annotations

from typing import Any

import escort_mj
from benchmarks.document import measure_page, table_of

PAGE = "clutter.md"
SEEDS = range(1, 11)
CLEAR = "none"
START, END = 10.0, 118.0  # s: the ring has formed, and the clutter is passed
MISSION: dict[str, Any] = {
    "name": "clutter",
    "duration": 120,
    "robots": {"count": 8, "placement": {"within": 6}},
    "clutter": {"passage": 1.8, "shapes": ["sphere", "box", "cylinder", "capsule", "ellipsoid"]},
    "mission": {
        "radius": 4,
        "max_speed": 2,
        "behaviors": [{"behavior": "avoid_obstacles", "safe_distance": 0.5}, "vertices", "surface"],
    },
    "sensing": {"position": {"noise": 0.02}, "velocity": {"noise": 0.01}},
}
PATH, PUSH = ["0.4*t", "2*sin(0.1*t)", "cos(0.1*t)"], [f"0.5*{way}" for way in (
    "sin(0.5*t)", "sin(0.7*t)", "cos(0.5*t)"
)]  # fmt: skip
CLUTTER: dict[int, dict[str, Any]] = {
    2: {"count": 16, "low": [8, -9], "high": [44, 9]},
    3: {"count": 24, "low": [8, -7, -7], "high": [42, 7, 7]},
}
COLUMNS = {
    "p": "{axes}",
    "seed": "{seed}",
    "touches": "{touches}",
    "to obstacles [m]": "{obstacle_clearance_min:.3f}",
    "to robots [m]": "{robot_clearance_min:.3f}",
    "avoiding": "{avoiding:.1f} %",
    "farthest off the ring [m]": "{left_behind:.2f}",
    "off the ring at the end [m]": "{error:.4f}",
}
SHARES = {
    "p": "{axes}",
    "no touch": "{clear} of {missions}",
    "least clearance to an obstacle [m]": "{least:.3f}",
}


def mission(axes: int, seed: int) -> escort_mj.Scenario:
    """A random world."""
    target, push = {"position": PATH[:axes]}, {"disturbance": PUSH[:axes]}
    world = {"seed": seed, "axes": axes, "target": target, "uncertainty": push}
    keys = MISSION | world | {"clutter": MISSION["clutter"] | CLUTTER[axes]}
    return escort_mj.load_scenario(keys)


def judged(run: escort_mj.Run) -> dict[str, Any]:
    """What came of a mission: touches, least clearances [m]; the robots' time under avoidance [%]; their
    distance from the ring [m], largest after the start and mean at the end."""
    touches = f"{run.values['contacts']:.0f}" if run.values["contacts"] else CLEAR
    return run.values | {
        "axes": run.scenario.axes,
        "seed": run.scenario.seed,
        "touches": touches if run.outcome.good else "did not complete",
        "avoiding": 100.0 * float(run.trace["avoidance_active"].values.mean()),
        "left_behind": run.summary("radius_error_max", after=START).iloc[-1],
        "error": run.summary("radius_error_mean", after=END).iloc[-1],
    }


def share(axes: int, found: list[dict[str, Any]]) -> dict[str, Any]:
    """Missions without a touch, of those with so many axes."""
    some = [each for each in found if each["axes"] == axes]
    clear = sum(each["touches"] == CLEAR for each in some)
    least = min(each["obstacle_clearance_min"] for each in some)
    return {"axes": axes, "clear": clear, "missions": len(some), "least": least}


def tables() -> dict[str, str]:
    """Flies all missions on all cores."""
    missions = (mission(axes, seed) for axes in CLUTTER for seed in SEEDS)
    found = [judged(run) for run in escort_mj.run_many(missions, traces=True)]
    shares = [share(axes, found) for axes in CLUTTER]
    return {"shares": table_of(shares, SHARES), "clutter": table_of(found, COLUMNS)}


if __name__ == "__main__":
    measure_page(__doc__, PAGE, tables)
