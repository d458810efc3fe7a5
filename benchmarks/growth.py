"""Time of control per robot in teams of 5 to 2000: the native loop less bare `mj_step`.

The mission is that of `peers/stage.py`: everyone keeps a place on a circle or sphere around a moving target.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.bare import Bare
from benchmarks.document import table
from benchmarks.paired import alternate, effort, medians
from benchmarks.peers.ours import advance, mission
from escort_mj.report.figures.drawing.style import figure
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import build
from escort_mj.world.plant import Plant

SIZES = (5, 6, 20, 50, 100, 500, 1000, 2000)
TICKS = (5, 20, 100, 500, 2000)
REFERENCE = 100  # robots: what the cost at other sizes is compared with
CLOSE = 0.45  # of the usual spacing: surfaces half a meter apart
NO_NOISE: dict[str, Any] = {"sensing": {}}
CASES: dict[str, dict[str, Any]] = {
    "plane": {"axes": 2, "changes": NO_NOISE},
    "plane, noise": {"axes": 2},
    "plane, close": {"axes": 2, "changes": NO_NOISE, "spacing": CLOSE},
    "space": {"axes": 3, "changes": NO_NOISE},
    "space, noise": {"axes": 3},
    "space, close": {"axes": 3, "changes": NO_NOISE, "spacing": CLOSE},
}
WORK = 100_000  # robot-steps in a round
ROUNDS = 15


def compare(n: int, **what: Any) -> dict[str, float]:
    """Times the native loop and MuJoCo alone along the same way, in turns.

    Args:
        n: Number of robots.
        what: Arguments of `mission`.

    Returns:
        Medians over rounds: time a step [us] of `bare` and `native`, their paired ratio, and `control`, what
        the native loop costs a robot beyond [ns].
    """
    world = build(mission("point_mass", n, **what))
    plant, bare = Plant(world), Bare(world)
    steps = max(2, WORK // n // world.schedule.stride) * world.schedule.stride

    def native() -> float:
        with native_loop(world):
            return effort(lambda: advance(plant, steps)) / steps

    native(), bare.step(steps)
    times = alternate({"bare": lambda: bare.step(steps), "native": native}, ROUNDS)
    control = 1e9 / n * float(np.median(times["native"] - times["bare"]))
    return medians(times, "bare") | {"control": control}


def measure() -> list[dict[str, Any]]:
    """Measures every case at every size."""
    rows = []
    for case, what in CASES.items():
        for n in SIZES:
            row = {"case": case, "n": n} | compare(n, **what)
            said = f"{row['native/bare']:.2f} of bare, {row['control']:.0f} ns a robot"
            print(f"{case}, n = {n}: {said}", flush=True)
            rows.append(row)
    return rows


def tables(rows: list[dict[str, Any]]) -> dict[str, str]:
    """Ratios to bare, and costs of control, by size."""
    found = {(row["case"], row["n"]): row for row in rows}
    ratios, costs = [], []
    for case in CASES:
        ratios.append([case, *(f"{found[case, n]['native/bare']:.2f}" for n in SIZES)])
        own = [found[case, n]["control"] for n in SIZES]
        grown = found[case, SIZES[-1]]["control"] / found[case, REFERENCE]["control"]
        costs.append([case, *(f"{cost:.0f}" for cost in own), f"**{grown:.2f}**"])
    head = ["native / bare", *map(str, SIZES)]
    last = f"{SIZES[-1]} / {REFERENCE}"
    return {"growth": table(head, ratios), "costs": table(["control [ns per robot]", *head[1:], last], costs)}


def draw(rows: list[dict[str, Any]], folder: Path) -> None:
    """Draw the time per robot, of control and of MuJoCo, against the number of robots."""
    with figure(folder / "growth.png", 3.2, "Time of a step per robot, on one core") as canvas:
        for axes, place in zip(canvas.subplots(1, 2, sharey=True), ("plane", "space"), strict=True):
            for case in (name for name in CASES if name.startswith(place)):
                mine = [row for row in rows if row["case"] == case]
                sizes = [row["n"] for row in mine]
                axes.plot(
                    sizes, [row["control"] for row in mine], "o-", markersize=3.0, label=f"control, {case}"
                )
                if case == place:
                    bare = [1e3 * row["bare"] / row["n"] for row in mine]
                    axes.plot(sizes, bare, "--", color="#777777", label="MuJoCo alone")
            axes.set_xscale("log")
            axes.set_xticks(TICKS, map(str, TICKS))
            axes.minorticks_off()
            axes.set_xlabel("robots")
            axes.legend()
        canvas.axes[0].set_ylim(bottom=0.0)  # of both, once all is there
        canvas.axes[0].set_ylabel("time per step and robot [ns]")
