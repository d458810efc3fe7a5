"""What `rerun` and `diff` say of why two runs differ: interventions, edits, versions, keys."""

import json
import shutil

import numpy as np
import pytest

from escort_mj import api
from escort_mj.environments.simulation import Simulation
from escort_mj.scenario import parse_scenario
from escort_mj.study.sweeps.rerun import agreement_lines, diff_folders, rerun_folder
from tests.test_cli import command  # noqa: F401  a fixture: one command in a folder of its own

TEXT = """
name: three
seed: 7
duration: 1.5
robots: {positions: [[3, 0], [-1.5, 2.6], [-1.5, -2.6]]}
obstacles: [{position: [9, 9], radius: 0.3}]
mission: {radius: 3, behaviors: [surface]}
expect: [{contacts: none}, {metric: radius_error_max, at_most: 0.5}]
"""


@pytest.fixture(scope="module")
def kept(compiled, tmp_path_factory):
    path = tmp_path_factory.mktemp("kept") / "run"
    api.run(parse_scenario(TEXT), path, figures=False, video=False)
    return path


@pytest.fixture
def stored(kept, tmp_path):
    def make(name: str, **overrides):
        changes = {key.replace("__", "."): value for key, value in overrides.items()}
        if changes:
            api.run(parse_scenario(TEXT).replace(changes), tmp_path / name, figures=False, video=False)
        else:
            shutil.copytree(kept, tmp_path / name)
        return tmp_path / name

    return make


def test_rerun_says_what_it_reran(stored, command):  # noqa: F811
    code, out, _ = command("rerun", stored("a").name)
    assert code == 0 and out.splitlines()[-1].startswith("same bits: ")
    assert "  reran  a/resolved.yaml: three, seed 7, 1.5 s\n" in out and "edited" not in out


def test_rerun_names_interventions(tmp_path, compiled, command):  # noqa: F811
    mission = api.start(parse_scenario(TEXT))
    mission.step(0.5)
    mission.push(1, [5, 0], 0.3)
    mission.change({"mission.radius": 3.2})
    mission.step(1.0)
    mission.run().save(tmp_path / "pushed")
    code, out, _ = command("rerun", "pushed")
    assert code == 1 and "other bits in" in out
    assert "2 interventions from outside, which a rerun does not repeat: 0.5 s: robot 1 is pushed by" in out
    assert "change of mission.radius" in out


def test_rerun_names_commands(tmp_path, compiled):
    simulation = Simulation(parse_scenario(TEXT))
    simulation.reset()
    for _ in range(20):
        simulation.step(np.array([[1.0, 0.0]] * 3))
    simulation.run().save(tmp_path / "led")
    found = rerun_folder(tmp_path / "led")
    assert not found.same_bits
    assert any("each robot's velocity was commanded from outside" in line for line in agreement_lines(found))


def test_rerun_names_edits_of_files(stored):
    folder = stored("a")
    short, whole = folder / "scenario.yaml", folder / "resolved.yaml"
    short.write_text(short.read_text().replace("seed: 7", "seed: 8"))
    found = rerun_folder(folder)
    assert found.same_bits
    edit = "edited  scenario.yaml does not take part, and differs from resolved.yaml, which does: seed: 7 | 8"
    assert edit in found.notes
    whole.write_text(whole.read_text().replace("  radius: 3.0\n", "  radius: 3.1\n"))
    found = rerun_folder(folder)
    assert (
        not found.same_bits
        and "edited  resolved.yaml is not what ran: it was changed after the run" in found.notes
    )
    short.write_text("{")
    assert any("cannot be read any more" in note for note in rerun_folder(folder).notes)


def test_two_folders_are_compared(stored, command):  # noqa: F811
    first, second = stored("a"), stored("b", controller__derivative_gain=2.0, obstacles__0__radius=0.4)
    code, out, _ = command("diff", "a", "a")
    assert code == 0 and out.startswith("same bits: ")
    code, out, _ = command("diff", "a", "b")
    assert code == 1
    assert "  scenario  obstacles[0].radius: 0.3 | 0.4\n" in out
    assert "  scenario  controller.derivative_gain: " in out and " | 2.0\n" in out
    found = diff_folders(first, second)
    assert f"first in {found.first} at {found.differing[found.first]:g} s" in out
    assert found.differing[found.first] == min(found.differing.values())
    value = {
        name: json.loads((at / "metrics.json").read_text())["energy"]["value"]
        for name, at in (("a", first), ("b", second))
    }
    assert f"energy: {value['a']:.6g} J first, {value['b']:.6g} J second" in out
    strict = stored("c", expect=[{"metric": "radius_error_max", "at_most": 0.5}], mission__radius=2.0)
    found = diff_folders(first, strict)
    ((before, after),) = found.verdicts
    assert before.startswith("radius_error_max at most 0.5 m: ") and before != after
    document = json.loads(command("diff", "a", "c", "--json")[1])
    assert document["first"] == found.first and document["verdicts"] == [[before, after]]


def test_runs_of_other_sizes_are_compared(stored):
    more = stored("b", robots__positions=[[3, 0], [-3, 0]], recording__rate=20)
    found = diff_folders(stored("a"), more)
    assert not found.good and found.differing and found.apart
