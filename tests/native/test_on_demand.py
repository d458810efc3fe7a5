"""Kernels that are compiled when a mission first reaches them: once for all processes, on any thread."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from escort_mj.native import artifacts, cache, shipped
from escort_mj.native.compiler.ship import every_piece

MISSION = {
    "robots": {"positions": [[5, 3], [-1, 5], [-5, 0], [-2, -5], [4, -4]]},
    "target": {"position": ["0.3*t", 0]},
    "mission": {
        "trigger": {"distance": 0.05},
        "supervisor": [{"name": "alone", "after": 1, "behaviors": ["surface"]}],
    },
}
REACHED = {
    "finish_by_set_based",
    "evaluate",
    "follow_time",
    "supervise",
    "_refresh_some",
    "weigh_tasks",
}
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


@pytest.fixture(scope="module")
def full(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cache in which an earlier process has left what such missions need: the machine code that ships."""
    home = tmp_path_factory.mktemp("cache")
    with pytest.MonkeyPatch.context() as patch:
        place = home / cache.cache_key()
        place.mkdir(mode=0o700)
        patch.setattr(cache.kernels, "folder", place)
        for piece in every_piece():
            code = shipped.shipped_file(piece.file)
            assert code is not None, "make machine-code"
            artifacts.keep_artifact(piece, code)
    return home


def stepped(how: str, folder: Path) -> tuple[str, set[str], int]:
    """A fresh process: its state after 1500 steps, which kernels on demand it has, how many it compiled."""
    command = [sys.executable, "-c", PROGRAM, json.dumps(MISSION), how]
    environment = {**os.environ, cache.FOLDER: str(folder)}
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, env=environment)
    bits, filled, count = json.loads(done.stdout)
    return bits, set(filled), count


@pytest.fixture(scope="module")
def first(full: Path) -> tuple[str, set[str], int]:
    return stepped("alone", full)


def test_what_is_reached_is_there_in_every_process_with_the_same_bits(
    full: Path, first: tuple[str, set[str], int]
) -> None:
    """Its addresses differ from process to process: machine code from the cache must hold none."""
    second = stepped("alone", full)
    assert first[1] == second[1] == REACHED
    assert first[0] == second[0]
    assert first[2] == second[2] == 0, "it is in the cache, and was compiled"


def test_threads_without_python_reach_it_first(full: Path, first: tuple[str, set[str], int]) -> None:
    """A batch's threads ask for it side by side, each in the midst of a step."""
    many = stepped("batch", full)
    assert many[1] == REACHED
    assert many[0] == first[0]


@pytest.mark.slow
def test_two_processes_fill_an_empty_cache(full: Path, tmp_path: Path) -> None:
    """Threads of a batch compile in the midst of a step; then nobody does, and all get the same bits."""
    cold = stepped("batch", tmp_path)
    warm = stepped("alone", tmp_path)
    assert cold[2] > 0 and warm[2] == 0
    assert cold[:2] == warm[:2] == stepped("alone", full)[:2]
