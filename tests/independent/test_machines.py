"""Contacts, clearances and tunneling of robots from files against what stands beside the mission."""

import numpy as np
import pytest

from escort_mj.scenario import load_file
from tests.independent.bystander import compared, watch
from tests.independent.machines import Drawn

FEW = 4
MANY = 300


@pytest.mark.slow_cases("0")
@pytest.mark.parametrize("seed", range(FEW))
def test_a_drawn_mission_is_judged_as_it_is_seen(seed: int) -> None:
    assert not compared(seed)


@pytest.mark.slow
@pytest.mark.parametrize("first", range(FEW, MANY, 37))
def test_so_are_three_hundred(first: int) -> None:
    wrong = {seed: found for seed in range(first, min(first + 37, MANY)) if (found := compared(seed))}
    assert not wrong


def test_the_bystander_sees_what_can_be_said_without_it(tmp_path) -> None:
    """A cube of half a meter slides at a wall of the same height, and its margin of 0.1 m holds it off."""
    cube = (
        '<mujoco><worldbody><body name="cube" pos="0 0 0.25"><joint name="x" type="slide" axis="1 0 0"/>'
        '<joint name="y" type="slide" axis="0 1 0"/>'
        '<geom type="box" size="0.25 0.25 0.25" mass="1" margin="0.1"/></body></worldbody>'
        '<actuator><motor joint="x" ctrlrange="-5 5"/><motor joint="y" ctrlrange="-5 5"/></actuator></mujoco>'
    )
    keys = {
        "duration": 3,
        "target": None,
        "robots": {"positions": [[0, 0]], "kind": {"kind": "mjcf", "file": "cube.xml"}},
        "obstacles": [{"name": "wall", "shape": "box", "position": [2, 0], "size": [0.5, 1]}],
        "mission": {"max_speed": 1, "behaviors": [{"behavior": "goal", "goals": [[4, 0]], "gain": 1}]},
    }
    seen = watch(load_file(Drawn(keys, {"cube.xml": cube}).write(tmp_path)))
    pair = ("robot_1", "wall")
    assert seen.distances[pair][0] == pytest.approx(1.25, abs=1e-9)
    ((first, last),) = seen.episodes(pair)
    assert last == len(seen.times) - 1
    assert 0.0 < seen.distances[pair][first] < 0.1 < seen.distances[pair][first - 2]
    moved = np.diff(seen.places[:, 0, 0]).max() / seen.timestep
    assert seen.fastest == pytest.approx(moved, rel=1e-5)
