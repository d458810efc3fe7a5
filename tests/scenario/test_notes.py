"""What is said of a mission before it is run."""

import pytest

from escort_mj.api import load_scenario
from escort_mj.errors import ScenarioError
from escort_mj.scenario import Scenario
from escort_mj.scenario.mission import Mission
from escort_mj.scenario.notes import notes, trace_note

ROUND = {"behavior": "surface"}


def squeezed(surface: dict, width: float = 3.0) -> Scenario:
    """The mission through a door, with another circle and another door."""
    return load_scenario("worlds/squeeze").replace(
        {
            "mission.behaviors": [{"behavior": "avoid_obstacles", "safe_distance": 0.3}, "vertices", surface],
            "walls": [{"name": "wall", "points": [[6, -14], [6, 14]], "doors": [{"at": 14, "width": width}]}],
        }
    )


def test_a_large_trace_is_told_beforehand():
    assert trace_note(Mission(Scenario.model_validate({}))) == ""
    robots = {"count": 200, "placement": {"within": 60.0}}
    keys = {"duration": 100.0, "robots": robots, "mission": {"behaviors": ("surface",)}}
    crowd = Scenario.model_validate(keys)
    size = Mission(crowd).trace_size
    assert 1e8 < size < 2e9
    assert notes(crowd) == [
        f"the trace will take up to {size / 1e6:.0f} MB; a lower recording.rate makes it smaller"
    ]


def test_a_circle_that_is_wider_than_a_door_is_told_beforehand():
    (wide,) = notes(squeezed(ROUND))
    assert wide.startswith("the circle of 2.5 m needs 5.9 m")
    assert "wall_1 and wall_2 leave 3 m at 29.8 s" in wide
    assert "at most 1.05 m fits" in wide and "fit: true" in wide
    assert notes(squeezed(ROUND | {"fit": True})) == notes(squeezed(ROUND | {"radius": 1.0})) == []
    (least,) = notes(squeezed(ROUND | {"fit": True}, width=1.8))
    assert least.startswith("the smallest circle of 0.7 m needs 2.3 m")
    assert notes(load_scenario("main")) == [], "one goes around a rock"


def test_a_door_narrower_than_a_robot():
    with pytest.raises(ScenarioError) as error:
        squeezed(ROUND, width=0.25)
    assert "walls[0]: leaves 0.25 m between wall_1 and wall_2" in str(error.value)
    assert "the largest robot needs 0.3 m" in str(error.value)


def test_what_rays_of_a_lidar_can_miss_is_told_beforehand():
    post = {"shape": "cylinder", "position": [9, 0], "size": [0.05]}
    keys = {"mission": {"behaviors": [{"behavior": "avoid_obstacles", "safe_distance": 1}, "surface"]}}
    keys |= {"obstacles": [{"position": [9, 4]}, post], "sensing": {"lidar": {"rays": 36}}}
    (note,) = notes(Scenario.model_validate(keys))
    assert note.startswith("obstacle_2 is 0.1 m wide, and rays of the lidar are 0.218 m apart")
    assert notes(Scenario.model_validate(keys | {"sensing": {"lidar": {"rays": 90}}})) == []


def test_opponents_that_never_set_out_are_told_of_beforehand():
    keys = {"duration": 10, "opponents": [{"count": 3, "interval": 5}]}
    (note,) = notes(Scenario.model_validate(keys))
    assert note == "the last opponent sets out at 10 s; the run ends at 10 s"
    assert notes(Scenario.model_validate(keys | {"duration": 10.1})) == []
