"""What it costs to keep what happens: the native loop left alone, sampled into memory, written to a journal.

All three step the same mission, in turns. Left alone, it keeps nothing, for nobody takes samples; sampled, as
in a run, Python takes hundreds at once; written, each block also goes into a journal as in a run folder.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.document import table_of
from benchmarks.loop import UNTIL_FAR, WARM_UP
from benchmarks.paired import alternate, effort, medians
from escort_mj.api import load_scenario
from escort_mj.mission import BLOCK
from escort_mj.record.journal import Journal
from escort_mj.record.recording import NONE
from escort_mj.signals import record_size
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import build
from escort_mj.world.plant import Plant

CASES = {
    "n = 5, plane, 4 obstacles": ("main", UNTIL_FAR),
    "n = 6, space, 4 obstacles": ("main_3d", UNTIL_FAR),
    "n = 5, plane, 4 obstacles, every step": ("main", [*UNTIL_FAR, "recording.rate=500"]),
}


def compare(scenario: str, overrides: list[str], rounds: int = 31) -> dict[str, Any]:
    """Times the three loops on one scenario, a block of samples a round.

    Returns:
        Medians over rounds: time a step [us] of `alone`, `sampled`, `written`, the paired ratios to `alone`,
        and how many `numbers` a sample has, and how many steps apart samples are, in words.
    """
    world = build(load_scenario(scenario, overrides))
    plant = Plant(world)
    samples = np.empty((BLOCK, record_size(world.sizes)))
    steps = BLOCK * world.schedule.stride

    def alone() -> None:
        plant.step(steps)

    def sampled() -> None:
        row = 0
        while row < BLOCK:
            taken = plant.samples(BLOCK - row)
            samples[row : row + len(taken)] = taken
            row += len(taken)
            if plant.has_ended:
                plant.ended()

    with tempfile.TemporaryDirectory() as folder, native_loop(world):
        journal = Journal(Path(folder), {"record_size": record_size(world.sizes)})

        def written() -> None:
            sampled()
            journal.append(samples, NONE, plant.under_way())

        def per_step(loop: Callable[[], object]) -> float:
            return effort(loop) / steps

        plant.step(WARM_UP)
        loops = {loop.__name__: loop for loop in (alone, sampled, written)}
        times = alternate({name: partial(per_step, loop) for name, loop in loops.items()}, rounds)
        journal.close()
    every = "step" if world.schedule.stride == 1 else f"{world.schedule.stride} steps"
    return medians(times, "alone") | {"numbers": f"{len(samples[0])} every {every}"}


def measure() -> list[dict[str, Any]]:
    """Measures every case."""
    return [{"case": name} | compare(*case) for name, case in CASES.items()]


def tables(rows: list[dict[str, Any]]) -> dict[str, str]:
    """What was measured, as a table."""
    columns = {
        "case": "{case}",
        "numbers recorded": "{numbers}",
        "without [us]": "{alone:.2f}",
        "in memory / without": "**{sampled/alone:.2f}**",
        "in a run folder / without": "**{written/alone:.2f}**",
    }
    return {"recording": table_of(rows, columns)}
