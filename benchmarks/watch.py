"""What it costs to watch every physics step: the native loop with and without its sensor callback.

Both loops take turns, round by round, from the same state, so that a machine whose speed drifts treats them
alike, and what counts is the time of this thread alone. Without the callback nobody looks at contacts,
clearances, speeds, energy and effort. Scenarios take turns with and without their expectations.
"""

from __future__ import annotations

import time
from contextlib import ExitStack
from functools import partial
from typing import Any

import mujoco
import numpy as np

from benchmarks.bare import STATE
from benchmarks.document import table_of
from benchmarks.loop import WARM_UP
from benchmarks.paired import alternate, effort, paired
from escort_mj.api import load_scenario
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import build
from escort_mj.world.plant import Plant

QUIET = ["expect=[]"]
CASES: dict[str, tuple[str, list[str], int]] = {
    "n = 5, plane": ("paper/case1_2d", QUIET, 1000),
    "n = 5, plane, 4 obstacles": ("main", QUIET, 1000),
    "n = 6, space": ("paper/case1_3d", QUIET, 1000),
    "n = 6, space, 1 obstacle": ("paper/case3_3d_obstacle", QUIET, 1000),
    "n = 100 in a crowd, space": (
        "paper/case1_3d",
        [
            *QUIET,
            "robots={count: 100, radius: 0.25, placement: {within: 3, least_gap: 0.01}}",
            "mission={radius: 0.6, behaviors: [surface]}",
        ],
        50,
    ),
    "n = 100 balls on the floor": (
        "paper/case1_2d",
        [
            *QUIET,
            "robots={count: 100, kind: rolling_sphere, placement: {within: 30, least_gap: 0.1}}",
            "mission={radius: 30, behaviors: [surface]}",
        ],
        20,
    ),
}

EXPECTING = ("main", "main_3d", "patrol", "robots/slung", "robots/hexarotor")


def compare(scenario: str, overrides: list[str], steps: int, rounds: int = 31) -> dict[str, Any]:
    """Times the loop with and without the watch.

    Args:
        scenario: Name or path.
        overrides: As `--set` takes them.
        steps: In a round.
        rounds: Pairs of loops.

    Returns:
        Medians over rounds: time a step [us] with (`watched`) and without (`blind`), their paired difference
        as a `percent`age of the loop, contacts in the last step, and contacts that the log had no room for.
    """
    world = build(load_scenario(scenario, overrides))
    plant = Plant(world)
    state = np.empty(mujoco.mj_stateSize(world.model, STATE))
    times: dict[str, list[float]] = {"watched": [], "blind": []}
    with native_loop(world):
        plant.step(min(WARM_UP, 40 * steps))
        callback = mujoco.get_mjcb_sensor()
        for turn in range(rounds):
            mujoco.mj_getState(world.model, plant.data, state, STATE)
            memory = plant.data.userdata.copy()
            for name in ("watched", "blind") if turn % 2 else ("blind", "watched"):
                mujoco.mj_setState(world.model, plant.data, state, STATE)
                plant.data.userdata[:] = memory
                mujoco.set_mjcb_sensor(callback if name == "watched" else None)
                start = time.thread_time()
                plant.step(steps)
                times[name].append(1e6 * (time.thread_time() - start) / steps)
            mujoco.set_mjcb_sensor(callback)
            plant.step(1)
            plant.ended()
    watched, blind = (np.array(times[name]) for name in ("watched", "blind"))
    return {
        "watched": float(np.median(watched)),
        "blind": float(np.median(blind)),
        "percent": 100.0 * float(np.median(1.0 - blind / watched)),
        "contacts": int(plant.data.ncon),
        "untold": float(plant.state.contacts_untold[0]),
    }


def expecting(scenario: str, steps: int = 2000, rounds: int = 31) -> dict[str, Any]:
    """Times a scenario's loop, whose steps are looked at for its expectations, and the loop without them.

    Args:
        scenario: Name or path.
        steps: In a round.
        rounds: Pairs of loops.

    Returns:
        Number of `expectations`; medians over rounds: time a step [us] with (`expecting`) and without
        (`not_expecting`) them, and their paired `ratio`.
    """
    scenarios = {name: load_scenario(scenario, told) for name, told in (("with", ()), ("without", QUIET))}
    plants = {name: Plant(build(one)) for name, one in scenarios.items()}
    with ExitStack() as loops:
        for plant in plants.values():
            loops.enter_context(native_loop(plant.world))
            plant.step(WARM_UP)
        turns = {name: partial(effort, partial(plant.step, steps)) for name, plant in plants.items()}
        times = alternate(turns, rounds)
    return {
        "scenario": scenario,
        "expectations": len(scenarios["with"].expect),
        "not_expecting": 1e6 * float(np.median(times["without"])) / steps,
        "expecting": 1e6 * float(np.median(times["with"])) / steps,
        "ratio": paired(times, "with", "without"),
    }


def measure() -> list[dict[str, Any]]:
    """Measures every case."""
    watched = [{"case": name} | compare(*case) for name, case in CASES.items()]
    return [*watched, *(expecting(scenario) for scenario in EXPECTING)]


WATCHED = {
    "case": "{case}",
    "without [us]": "{blind:.2f}",
    "with [us]": "{watched:.2f}",
    "share of the loop": "**{percent:.1f} %**",
    "contacts at the end": "{contacts}",
}
EXPECTED = {
    "scenario": "`{scenario}`",
    "expectations": "{expectations}",
    "without [us]": "{not_expecting:.2f}",
    "with [us]": "{expecting:.2f}",
    "with / without": "**{ratio:.2f}**",
}


def tables(rows: list[dict[str, Any]]) -> dict[str, str]:
    """What was measured, as tables."""
    return {
        "watch": table_of((row for row in rows if "case" in row), WATCHED),
        "expecting": table_of((row for row in rows if "scenario" in row), EXPECTED),
    }
