"""Where the time of a step goes: parts of the controlled loop taken away one by one, and MuJoCo's own stages.

The law is compiled into one function, so its parts are told apart by ablation: the same mission with less and
less in it, all in turns. What is left at the end is measuring, the last behavior, the inner loop and motors.
MuJoCo times its own stages.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from benchmarks.bare import AT_ONCE, Bare, copy_state
from benchmarks.document import table
from benchmarks.paired import Times, alternate, effort
from benchmarks.peers.ours import BEHAVIORS, advance, mission
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import build
from escort_mj.world.plant import Plant

TEAMS = {
    "n = 5, plane": (5, 2),
    "n = 6, space": (6, 3),
    "n = 100, space": (100, 3),
    "n = 1000, space": (1000, 3),
}
PARTS: dict[str, dict[str, Any]] = {
    "measurement noise": {"sensing": {}},
    "disturbance": {"uncertainty.disturbance": None},
    "formation": {"mission.behaviors": [BEHAVIORS[0], BEHAVIORS[2]]},
    "avoidance of obstacles and teammates": {"mission.behaviors": BEHAVIORS[2:]},
}
WATCH, REST, BARE = "monitoring and sampling", "rest of the law", "MuJoCo"
STAGES = {
    "collisions": "POS_COLLISION",
    "kinematics": "POS_KINEMATICS",
    "inertia": "POS_INERTIA",
    "velocities": "VELOCITY",
    "actuation": "ACTUATION",
    "constraints": "CONSTRAINT",
    "integration": "ADVANCE",
}
WORK, ROUNDS = 50_000, 15  # robot-steps in a round, and rounds


class Variant:
    """The mission of a team, with some of its parts away."""

    def __init__(self, n: int, axes: int, changes: dict[str, Any], watched: bool = True) -> None:
        self.world = build(mission("point_mass", n, axes, changes=changes))
        self.plant = Plant(self.world)
        stride = self.world.schedule.stride
        self.steps, self.watched = max(2, WORK // n // stride) * stride, watched
        self.fly()

    def fly(self) -> float:
        """Processor time a step [s] of the native loop."""
        with native_loop(self.world):
            if self.watched:
                return effort(lambda: advance(self.plant, self.steps)) / self.steps
            mujoco.set_mjcb_sensor(None)  # which takes the samples as well
            return effort(lambda: self.plant.step(self.steps)) / self.steps

    def bare(self) -> Callable[[], float]:
        """The same of MuJoCo alone, along the same way."""
        bare = Bare(self.world)
        bare.skip(self.steps)
        return lambda: bare.step(self.steps)

    def stages(self) -> dict[str, float]:
        """Shares of MuJoCo's stages in its own step, medians over rounds."""
        timers, rounds = mujoco.mjtTimer.__members__, []
        for _ in range(ROUNDS):
            held = mujoco.MjData(self.world.model)
            copy_state(self.world, self.plant.data, held)
            mujoco.mj_step(self.world.model, held, nstep=min(self.steps, AT_ONCE))
            spent = held.timer.duration
            stages = [spent[int(timers[f"mjTIMER_{stage}"])] for stage in STAGES.values()]
            rounds.append(np.array(stages) / spent[int(timers["mjTIMER_STEP"])])
        shares = dict(zip(STAGES, map(float, np.median(rounds, axis=0)), strict=True))
        return shares | {"the rest": 1.0 - sum(shares.values())}


def compare(n: int, axes: int) -> dict[str, Any]:
    """Takes a team's mission apart.

    Returns:
        `whole`, a step of all of it [us]; `parts`, what each adds, as a share of it; `stages`, shares
        of MuJoCo's own.
    """
    variants = {"whole": Variant(n, axes, {}), WATCH: Variant(n, axes, {}, watched=False)}
    changes: dict[str, Any] = {}
    for part, change in PARTS.items():
        changes |= change
        variants[part] = Variant(n, axes, dict(changes), watched=False)
    whole, last = variants["whole"], list(variants)[-1]
    loops = {name: variant.fly for name, variant in variants.items()}
    times = alternate(loops | {BARE: whole.bare()}, ROUNDS)
    parts = {after: _share(times[before] - times[after], times) for before, after in pairwise(variants)}
    parts[REST] = _share(times[last] - times[BARE], times)
    parts[BARE] = 1.0 - sum(parts.values())
    return {"whole": 1e6 * float(np.median(times["whole"])), "parts": parts, "stages": whole.stages()}


def _share(spent: NDArray[np.float64], times: Times) -> float:
    """Of the whole, median over rounds."""
    return float(np.median(spent / times["whole"]))


def measure() -> list[dict[str, Any]]:
    """Takes every team's mission apart."""
    return [{"team": name} | compare(*team) for name, team in TEAMS.items()]


def tables(rows: list[dict[str, Any]]) -> dict[str, str]:
    """Shares of a step, and of MuJoCo's part of it."""
    head = [f"{row['team']}: {row['whole']:.3g} us" for row in rows]
    parts = [[name, *(f"{100 * row['parts'][name]:.1f} %" for row in rows)] for name in rows[0]["parts"]]
    stages = [[name, *(f"{100 * row['stages'][name]:.0f} %" for row in rows)] for name in rows[0]["stages"]]
    return {
        "profile": table(["share of a step", *head], parts),
        "stages": table(["share of MuJoCo's step", *(row["team"] for row in rows)], stages),
    }
