"""What is wrong between the keys of a scenario, each of which is right by itself."""

from typing import Any

import pytest

from escort_mj.scenario import Scenario
from escort_mj.scenario.checks.whole import RELATIONS, SHAPES, findings_between_keys


def keys_of(**data: Any) -> Scenario:
    """A scenario whose keys are right one by one."""
    return Scenario.model_validate(data)


def test_default_scenario_passes():
    assert findings_between_keys(keys_of()) == []
    assert findings_between_keys(keys_of(axes=3)) == []


def test_checks_of_wrong_parts_wait():
    scenario = keys_of(recording={"rate": 60.0}, expect=({"metric": "contacts"},))
    assert [finding.path[0] for finding in findings_between_keys(scenario, wrong={"recording"})] == ["expect"]
    assert [finding.path[0] for finding in findings_between_keys(scenario, wrong={"expect"})] == ["recording"]


def test_every_check_names_parts_that_exist():
    for _, needs in (*SHAPES, *RELATIONS):
        assert set(needs) <= set(Scenario.model_fields)


@pytest.mark.parametrize(
    ("timestep", "rate"), [(0.002, 50), (0.002, 500), (0.001, 1000), (0.004, 25), (0.005, 40), (1 / 600, 60)]
)
def test_rates_that_divide(timestep: float, rate: float):
    assert findings_between_keys(keys_of(physics={"timestep": timestep}, recording={"rate": rate})) == []


def test_many_overlaps_are_cut_short():
    robots = {"positions": tuple((5.0, 0.001 * k) for k in range(100))}
    assert len(findings_between_keys(keys_of(robots=robots, mission={"behaviors": ("surface",)}))) == 20


def test_teammate_distance_between_centers_counts_no_radius():
    def distance(measure: str) -> list:
        avoid = {"behavior": "avoid_obstacles", "teammate_distance": 5.6, "measure": measure}
        return findings_between_keys(keys_of(mission={"behaviors": (avoid, "chords")}))

    assert distance("center") == []
    assert len(distance("surface")) == 1


def test_the_video_may_end_after_the_run():
    assert findings_between_keys(keys_of(video={"start": 10.0, "end": 99.0})) == []


def test_sizes_wait_for_the_physics_as_all_that_needs_them():
    scenario = keys_of(obstacles=({"shape": "box", "position": (9.0, 9.0), "size": (1.0,)},))
    assert findings_between_keys(scenario, wrong={"physics"}) == []
    assert len(findings_between_keys(scenario)) == 1
