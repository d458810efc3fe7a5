"""A failing run made small as it is: what is left fails alike, by itself, and nothing of it can go."""

import json
from pathlib import Path

import pytest

from escort_mj.mission import fly
from escort_mj.scenario.reader.load import load_file
from tests.test_cli import command  # noqa: F401  a fixture: one command in a folder of its own

CROWD = """\
name: crowd
duration: 12
seed: 6
robots: {count: 5, placement: {within: 5, least_gap: 0.6}, actuators: {lag: 0.02}}
obstacles: [{position: [9, 9], radius: 0.3}, {position: [3, 0], radius: 0.3}]
sensing: {position: {noise: 0.01}}
mission: {radius: 3, behaviors: [{behavior: avoid_obstacles, safe_distance: 0.4}, surface]}
expect:
  - {contacts: none}
  - {metric: robot_distance_min, at_least: 0.9}
"""
BROKEN = "robot_distance_min at least 0.9 m"


@pytest.fixture
def crowd(tmp_path: Path) -> Path:
    (tmp_path / "crowd.yaml").write_text(CROWD)
    return tmp_path / "crowd.yaml"


@pytest.mark.slow
def test_a_run_folder_is_shrunk_as_it_is(command, crowd: Path, tmp_path: Path) -> None:  # noqa: F811
    assert command("check", "crowd.yaml", "--no-video", "--workers", "1")[0] == 1
    code, out, _ = command("shrink", "renders/check/crowd", "--json")
    found = json.loads(out)
    assert code == 0 and found["broken"] == BROKEN and found["finished"]
    assert found["robots"] == [5, 2] and found["obstacles"] == [2, 0]
    assert found["duration"][1] < 12 and found["keys"][1] < found["keys"][0]
    small = load_file(tmp_path / found["folder"] / "scenario.yaml")
    run = fly(small)
    (failed,) = [one for one in run.verdicts if not one.passed]
    assert failed.message == found["message"] and failed.message.startswith(f"{BROKEN}: ")
    assert len(small.robots.positions) == 2 and not small.obstacles and len(small.expect) == 1
    assert small.sensing.position.noise == 0.0 and small.robots.actuators.lag == 0.0
    for robot in range(2):  # neither robot can go
        fewer = small.replace({"robots.positions": [small.robots.positions[robot]]})
        assert next(one for one in fly(fewer).verdicts if one.metric == "robot_distance_min").value is None


def test_a_scenario_and_a_seed(command, crowd: Path) -> None:  # noqa: F811
    text = CROWD.replace("seed: 6\n", "")
    crowd.write_text(text)
    code, out, _ = command("shrink", "crowd.yaml", "--set", "seed=6", "--out", "small", "--runs", "8")
    assert code == 0 and f"FAIL: {BROKEN}: " in out and "after 8 runs; the runs are used up" in out
    assert "wrote small: scenario.yaml and its run" in out
    code, _, err = command("shrink", "crowd.yaml", "--set", "seed=0", "--set", "expect=[]")
    assert code == 2 and "crowd: passes with seed 0: there is nothing to shrink" in err
    code, _, err = command("shrink", "small", "--set", "seed=1")
    assert code == 2 and "--set and --plugin change a scenario, not a run folder" in err
    assert command("shrink", "nothing")[0] == 2


@pytest.mark.slow
def test_a_run_that_diverges(command, crowd: Path) -> None:  # noqa: F811
    crowd.write_text(CROWD.replace("sensing:", "uncertainty: {disturbance: [0, 1000]}\nsensing:"))
    code, out, _ = command("shrink", "crowd.yaml", "--json")
    found = json.loads(out)
    assert code == 0 and found["broken"] == "outcome completed" and found["robots"] == [5, 1]
