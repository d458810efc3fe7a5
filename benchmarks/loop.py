"""The controlled, recorded, watched loop against bare `mj_step` of the same model from the same state.

Three loops take turns, round by round, so that a machine whose speed drifts treats them alike:
`native` is what a run does; `bare` is MuJoCo alone along the same way, forces held for a few steps at a time;
`interpreted` runs the same kernels as plain Python.
"""

from __future__ import annotations

from typing import Any

from benchmarks.bare import Bare
from benchmarks.document import table_of
from benchmarks.paired import alternate, effort, medians
from escort_mj.api import load_scenario
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import build
from escort_mj.world.plant import Plant

WARM_UP = 2000  # steps: the mission is under way
NO_NOISE = "sensing={}"
UNTIL_FAR = ["expect=[]"]
CASES = {
    "n = 5, plane, no noise": ("paper/case1_2d", [NO_NOISE, *UNTIL_FAR]),
    "n = 5, plane, noise": ("paper/case1_2d", UNTIL_FAR),
    "n = 5, plane, 4 obstacles, no noise": ("main", [NO_NOISE, *UNTIL_FAR]),
    "n = 5, plane, 4 obstacles, noise": ("main", UNTIL_FAR),
    "n = 6, space, no noise": ("paper/case1_3d", [NO_NOISE, *UNTIL_FAR]),
    "n = 6, space, noise": ("paper/case1_3d", UNTIL_FAR),
}


def compare(scenario: str, overrides: list[str], rounds: int = 31, steps: int = 1000) -> dict[str, float]:
    """Times the three loops on one scenario.

    Returns:
        Medians over rounds: time a step [us] of each, and the paired ratios to bare.
    """
    world = build(load_scenario(scenario, overrides))
    plant, slow, bare = Plant(world), Plant(world), Bare(world)
    few = max(steps // 50, 1)

    def native() -> float:
        with native_loop(world):
            return effort(lambda: plant.step(steps)) / steps

    def interpreted() -> float:
        with native_loop(world, interpret=True):
            return effort(lambda: slow.step(few)) / few

    with native_loop(world):
        plant.step(WARM_UP)
        slow.step(WARM_UP)
    bare.skip(WARM_UP)
    loops = {"bare": lambda: bare.step(steps), "native": native, "interpreted": interpreted}
    return medians(alternate(loops, rounds), "bare")


def measure() -> list[dict[str, Any]]:
    """Measures every case."""
    return [{"case": name} | compare(*case) for name, case in CASES.items()]


COLUMNS = {
    "case": "{case}",
    "bare [us]": "{bare:.2f}",
    "native [us]": "{native:.2f}",
    "interpreted [us]": "{interpreted:.0f}",
    "native / bare": "**{native/bare:.2f}**",
    "interpreted / bare": "{interpreted/bare:.0f}",
}


def tables(rows: list[dict[str, Any]]) -> dict[str, str]:
    """What was measured, as a table."""
    return {"loop": table_of(rows, COLUMNS)}
