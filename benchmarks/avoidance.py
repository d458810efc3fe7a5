"""`python -m benchmarks.avoidance`: ways to avoid compared, as docs/avoidance.md.

Whole missions with and without noise, straight approaches at several speeds, and worlds that block the way.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

import escort_mj
from benchmarks.bare import against_bare
from benchmarks.crowds import crowd
from benchmarks.document import measure_page, table

PAGE = "avoidance.md"
MISSIONS = ("main", "main_3d", "head_on", "paper/case2_2d_obstacles", "paper/case3_3d_obstacle")
WAYS: dict[str, Any] = {
    "nsb": "nsb",
    "tangent cone": {"loop": "set_based", "activation": "tangent_cone"},
    "set-based": "set_based",
    "barrier filter": "barrier_filter",
}
QUIET = {"sensing.position.noise": 0, "sensing.velocity.noise": 0}
SEEDS = range(1, 21)
SPEEDS = (1.0, 2.0, 4.0)
CIRCLING = 0.3  # m: robots that start nearer to each other are drawn again
COSTS = {  # a mission, its changes, and the steps before and in a round
    "main, n = 5": ("main", {}, 2000, 1000),
    "crowd, n = 100": ("crowd", crowd(100), 5000, 200),
    "crowd, n = 1000": ("crowd", crowd(1000), 5000, 40),
    "crowd, n = 1000, first second": ("crowd", crowd(1000), 40, 20),
}
ROUNDS = 21
Blocked = dict[str, Any]
BLOCKED: dict[str, Blocked] = {
    "flat wall": {"walls": [{"points": [[0, -4], [0, 4]]}]},
    "corner": {"walls": [{"points": [[-2, 4], [1, 1], [1, -1], [-2, -4]]}]},
    "door": {"walls": [{"points": [[0, -8], [0, 8]], "doors": [{"at": 11, "width": 1.2}]}]},
    "dead end": {"walls": [{"points": [[-3, 2.5], [2, 2.5], [2, -2.5], [-3, -2.5]]}]},
    "moving wall": {
        "obstacles": [
            {
                "shape": "box",
                "size": [0.1, 2.0],
                "motion": {"position": ["1.2*sin(0.3*t)", "2.5*sin(0.2*t)"]},
            }
        ]
    },
}


def activity(run: Any) -> tuple[float, float]:
    """Mean |v_d - v| while robots avoid [m/s], and the total variation of their forces per second [N/s]."""
    trace = run.trace
    slip = np.linalg.norm(trace["v_d"].values - trace["v"].values, axis=-1)
    active = trace["avoidance_active"].values > 0
    variation = run.summary("chattering", after=2.0, before=0.8 * trace["time"].values[-1])
    return float(slip[active].mean()) if active.any() else 0.0, float(variation.iloc[-1])


def missions() -> Iterator[list[str]]:
    """Each mission in each way, without and with its noise."""
    for name in MISSIONS:
        base = escort_mj.load_scenario(name).replace({"expect": []})
        sensors = (base.sensing.position, base.sensing.velocity)
        noisy = any(getattr(sensor, "noise", 0.0) > 0.0 for sensor in sensors)
        for noise in (False, True) if noisy else (False,):
            for way, outer in WAYS.items():
                run = escort_mj.run(base.replace({"mission.outer": outer, **({} if noise else QUIET)}))
                (slip, variation), settled = activity(run), run.values["settling_time"]
                yield [
                    name, "yes" if noise else "no", way,
                    f"{run.values['obstacle_clearance_min']:.3f}", f"{run.values['robot_clearance_min']:.3f}",
                    f"{slip:.3f}", f"{variation:.1f}", f"{run.values['energy']:.0f}",
                    "never" if settled == np.inf else f"{settled:.1f}",
                ]  # fmt: skip


def approach(speed: float, outer: Any) -> Any:
    """A robot of 1 kg with at most 20 N flies straight at a rock, at a speed, to a goal right behind it."""
    return escort_mj.Scenario(
        duration=12.0, target=None,
        robots={"radius": 0.15, "mass": 1.0, "force_limit": 20.0, "positions": [[-6.0, 0.05]]},
        obstacles=[{"position": [0, 0], "radius": 0.5}],
        mission={
            "max_speed": speed, "outer": outer,
            "behaviors": [
                {"behavior": "avoid_obstacles", "safe_distance": 0.3},
                {"behavior": "goal", "gain": 4, "goals": [[6.0, 0.0]]},
            ],
        },
    )  # fmt: skip


def approaches() -> Iterator[list[str]]:
    """How deep a robot gets into the safe distance [mm]."""
    for way, outer in WAYS.items():
        runs = [escort_mj.run(approach(speed, outer)) for speed in SPEEDS]
        yield [way, *(f"{1e3 * max(0.3 - run.values['obstacle_clearance_min'], 0.0):.1f}" for run in runs)]


def blocked(world: Blocked, seed: int, outer: Any) -> Any:
    """Four robots on one side of a world, their goals on the other; they see 3 m far."""
    rng = np.random.default_rng([seed, 7])
    starts: list[Any] = []
    while len(starts) < 4:
        start = [-4.0, 0.0] + rng.uniform(-1.5, 1.5, 2)
        if all(np.linalg.norm(start - other) > 0.4 + CIRCLING for other in starts):
            starts.append(start)
    goals = [[9.0 + x, y + rng.uniform(-0.2, 0.2)] for x, y in starts]
    noise = {"noise": 0.005}
    return escort_mj.Scenario(
        seed=seed, duration=90.0, target=None, **world,
        robots={"radius": 0.15, "force_limit": 10.0, "positions": starts},
        mission={
            "max_speed": 1.0, "outer": outer,
            "behaviors": [
                {"behavior": "avoid_obstacles", "safe_distance": 0.15},
                {"behavior": "goal", "goals": goals},
            ],
        },
        controller={"law": "apd_smc", "gains": "auto"},
        sensing={"position": noise, "velocity": noise, "radius": {"robots": 3.0, "obstacles": 3.0}},
    )  # fmt: skip


def worlds_that_block() -> Iterator[list[str]]:
    """Teams that arrive, of 20, and when the last robot does."""
    for name, world in BLOCKED.items():
        cells = [name]
        for outer in ("nsb", "barrier_filter", {"loop": "set_based", "patience": 1.0}):
            runs = list(escort_mj.run_many(blocked(world, seed, outer) for seed in SEEDS))
            times = [run.values["arrival_time"] for run in runs]
            touched = sum(run.values["contacts"] > 0 for run in runs)
            there = [time for time in times if time == time and time < 90.0]
            when = f", {np.median(there):.0f} s, at most {max(there):.0f} s" if there else ""
            cells.append(f"{len(there)}{when}" + (f"; {touched} touched" if touched else ""))
        yield cells


def costs() -> Iterator[list[str]]:
    """The loop against bare `mj_step` along its own way, as in docs/performance.md."""
    for name, (mission, changes, before, steps) in COSTS.items():
        keys = {"expect": [], "duration": 1000.0, **changes}
        both = {
            outer: escort_mj.load_scenario(mission, keys | {"mission.outer": outer})
            for outer in ("nsb", "set_based")
        }
        times, ratios = against_bare(both, before, steps, ROUNDS)
        yield [name, f"{1e6 * times['nsb']:.3g}", *(f"**{ratio:.2f}**" for ratio in ratios.values())]


def tables() -> dict[str, str]:
    """Flies all."""
    head = ["mission", "noise", "method", "to obstacles [m]", "between robots [m]", "slip [m/s]"]
    head += ["chattering [N/s]", "energy [J]", "settles [s]"]
    return {
        "avoidance missions": table(head, missions()),
        "avoidance costs": table(["mission", "bare [us]", "nsb / bare", "set-based / bare"], costs()),
        "avoidance approaches": table(
            ["method", *(f"{speed:g} m/s" for speed in SPEEDS)], approaches()
        ),
        "avoidance blocked": table(["world", "nsb", "barrier filter", "set-based"], worlds_that_block()),
    }  # fmt: skip


if __name__ == "__main__":
    measure_page(__doc__, PAGE, tables)
