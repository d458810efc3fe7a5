"""A vector has a number for each axis, in whatever table it stands."""

from typing import Any

import pytest

import escort_mj
from escort_mj.errors import ScenarioError

WRONG: list[tuple[dict[str, Any], str]] = [
    ({"target.position": [0]}, "target.position: found 1 numbers; expected 2, as axes says"),
    ({"target.waypoints": [{"time": 0, "position": [1, 2, 3]}]}, "target.waypoints[0].position: found 3"),
    ({"robots.velocities": [[0, 0]] * 4 + [[0]]}, "robots.velocities[4]: found 1"),
    ({"robots.overrides": [{"robot": 1, "position": [1, 2, 3]}]}, "robots.overrides[0].position: found 3"),
    ({"robots.placement": {"center": [1], "within": 9}}, "robots.placement.center: found 1"),
    ({"obstacles": [{"position": [9, 9, 9]}]}, "obstacles[0].position: found 3"),
    ({"walls": [{"points": [[9, 9], [9]]}]}, "walls[0].points[1]: found 1"),
    ({"clutter": {"count": 1, "low": [8, 8], "high": [9]}}, "clutter.high: found 1"),
    ({"environment.medium": {"wind": [1, 0, 0], "density": 1.2}}, "environment.medium.wind: found 3"),
    ({"uncertainty.disturbance": [1, 0, 0]}, "uncertainty.disturbance: found 3"),
    (
        {"uncertainty.disturbances": [{"disturbance": "expressions", "per_axis": ["t"]}]},
        "uncertainty.disturbances[0].per_axis: found 1",
    ),
    (
        {"sensing.velocity": {"bias": [0.1]}},
        "sensing.velocity.bias: found 1 numbers; expected 2, as axes says, or one",
    ),
    ({"mission.behaviors": [{"behavior": "goal", "goals": [[0, 0, 0]] + [[1, 1]] * 4}]}, "goals[0]: found 3"),
    (
        {"mission.behaviors": [{"behavior": "goal", "goals": [[[0], [1, 1]]] + [[1, 1]] * 4}]},
        "goals[0][0]: found 1",
    ),
    (
        {"mission.behaviors": [{"behavior": "goal", "goals": {"center": [0], "within": 9}}]},
        "goals.center: found 1",
    ),
    (
        {"mission.behaviors": [{"behavior": "formation", "offsets": [[1, 1]] * 4 + [[1]]}]},
        "offsets[4]: found 1",
    ),
    (
        {"mission.behaviors": [{"behavior": "formation", "offsets": [[1, 1]] * 5, "position": ["t"]}]},
        "mission.behaviors[0].position: found 1",
    ),
]


@pytest.mark.parametrize(("keys", "words"), WRONG, ids=[words.split(":")[0] for _, words in WRONG])
def test_a_vector_of_another_length_is_told_once(keys: dict[str, Any], words: str) -> None:
    with pytest.raises(ScenarioError) as error:
        escort_mj.load_scenario({"name": "five", "duration": 1, "robots": {"count": 5}}, keys)
    said = [str(fault) for fault in error.value.faults]
    assert len(said) == 1 and words in said[0]
