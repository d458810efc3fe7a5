"""The controlled, recorded, watched loop against bare `mj_step` of the same model from the same state.

Three loops take turns, round by round, so that a machine whose speed drifts treats them alike:
`native` is what a run does; `bare` is MuJoCo alone along the same way, forces held for a few steps at a time;
`twin` calls the law in plain NumPy from a Python callback.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from benchmarks.bare import Bare, copy_state, no_timer
from benchmarks.document import table
from benchmarks.paired import alternate, effort, paired
from escort_mj.api import load_scenario
from escort_mj.control.reference import ReferenceController
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
        Medians over rounds: time a step [us] of `bare`, `native`, `twin`, and the paired ratios to bare.
    """
    world = build(load_scenario(scenario, overrides))
    plant = Plant(world)
    bare, slow = Bare(world), mujoco.MjData(world.model)
    law = ReferenceController(world.setup, world.schedule.stride)
    n, p = world.sizes["robot"], world.sizes["axis"]
    few = max(steps // 50, 1)

    def control(model: mujoco.MjModel, data: mujoco.MjData) -> None:
        signals = law.evaluate(data.time, data.qpos.reshape(n, p), data.qvel.reshape(n, p))
        data.ctrl[:] = signals.tau.ravel()
        data.qfrc_applied[:] = signals.disturbance.ravel()

    def native() -> float:
        with native_loop(world):
            return effort(lambda: plant.step(steps)) / steps

    def twin() -> float:
        copy_state(world, plant.data, slow)
        slow.qfrc_applied[:] = 0.0
        law.reset(slow.qpos.reshape(n, p))
        mujoco.set_mjcb_control(control)
        with no_timer():
            taken = effort(lambda: mujoco.mj_step(world.model, slow, nstep=few)) / few
        mujoco.set_mjcb_control(None)
        return taken

    with native_loop(world):
        plant.step(WARM_UP)
    bare.skip(WARM_UP)
    times = alternate({"bare": lambda: bare.step(steps), "native": native, "twin": twin}, rounds)
    found = {name: 1e6 * float(np.median(values)) for name, values in times.items()}
    return found | {f"{name}/bare": paired(times, name, "bare") for name in ("native", "twin")}


def measure() -> list[dict[str, Any]]:
    """Measures every case."""
    return [{"case": name} | compare(*case) for name, case in CASES.items()]


def tables(rows: list[dict[str, Any]]) -> dict[str, str]:
    """What was measured, as a table."""
    cells = [
        [
            row["case"],
            *(f"{row[name]:.2f}" for name in ("bare", "native")),
            f"{row['twin']:.0f}",
            f"**{row['native/bare']:.2f}**",
            f"{row['twin/bare']:.0f}",
        ]
        for row in rows
    ]
    head = ["case", "bare [us]", "native [us]", "NumPy twin [us]", "native / bare", "twin / bare"]
    return {"loop": table(head, cells)}
