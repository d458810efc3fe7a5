"""Kernels that are compiled when a mission first reaches them: once for all processes, on any thread."""

import json
import os
import subprocess
import sys

import pytest

from escort_mj.native import cache

MISSION = {
    "robots": {"positions": [[5, 3], [-1, 5], [-5, 0], [-2, -5], [4, -4]]},
    "target": {"position": ["0.3*t", 0]},
    "mission": {
        "trigger": {"distance": 0.05},
        "supervisor": [{"name": "alone", "after": 1, "behaviors": ["surface"]}],
    },
}
REACHED = {"follow_time", "measure", "supervise", "_refresh_some", "weigh_tasks", "force_of_apd_smc"}
PROGRAM = """
import json, sys
from mujoco import batch
from escort_mj.native import artifacts, shipped
shipped.FOLDER = shipped.FOLDER / 'nowhere'
from escort_mj.native import on_demand
elsewhere, compiled = artifacts._elsewhere, []
artifacts._elsewhere = lambda pieces: compiled.extend(pieces) or elsewhere(pieces)
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.world.model.build import build
from escort_mj.world.callback import native_loop
from escort_mj.world.plant import Plant
world = build(Scenario.model_validate(json.loads(sys.argv[1])))
with native_loop(world):
    if sys.argv[2] == "batch":
        many = batch.Batch(world.model, nsim=4, nthread=2)
        memory = many.bind("userdata")
        many.step(nstep=1500)
        bits = {memory[i].tobytes().hex() for i in range(4)}
    else:
        plant = Plant(world)
        plant.step(1500)
        bits = {plant.data.userdata.tobytes().hex()}
(bits,) = bits
filled = sorted(entry.piece.function for entry in on_demand.entries.values() if entry.slot.value)
assert "numba" not in sys.modules
print(json.dumps([bits, filled, len(compiled)]))
"""


def stepped(how: str, folder: str | None = None) -> tuple[str, set[str], int]:
    """A fresh process: its state after 1500 steps, which kernels on demand it has, how many it compiled."""
    command = [sys.executable, "-c", PROGRAM, json.dumps(MISSION), how]
    environment = {**os.environ, **({cache.FOLDER: folder} if folder else {})}
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, env=environment)
    bits, filled, count = json.loads(done.stdout)
    return bits, set(filled), count


def test_what_is_reached_is_there_in_every_process_with_the_same_bits() -> None:
    """Its addresses differ from process to process: machine code from the cache must hold none."""
    first = stepped("alone")
    second = stepped("alone")
    assert first[1] == second[1] == REACHED
    assert first[0] == second[0]
    assert second[2] == 0, "the first process left something uncompiled"


def test_threads_without_python_reach_it_first() -> None:
    """A batch's threads ask for it side by side, each in the midst of a step."""
    many = stepped("batch")
    assert many[1] == REACHED
    assert many[0] == stepped("alone")[0]


@pytest.mark.slow
def test_two_processes_fill_an_empty_cache(tmp_path) -> None:
    """Threads of a batch compile in the midst of a step; then nobody does, and all get the same bits."""
    cold = stepped("batch", str(tmp_path))
    warm = stepped("alone", str(tmp_path))
    assert cold[2] > 0 and warm[2] == 0
    assert cold[:2] == warm[:2] == stepped("alone")[:2]
