"""Obstacles resolved: names, groups, sizes."""

from escort_mj.scenario import parse_scenario
from escort_mj.scenario.obstacles import obstacles_of


def test_spheres_are_named_and_numbered() -> None:
    scenario = parse_scenario("obstacles: [{position: [8, 0], radius: 0.7}, {position: [0, 8], name: gate}]")
    first, second = obstacles_of(scenario)
    assert (first.name, first.group, first.shape, first.size) == ("obstacle_1", "obstacles", "sphere", (0.7,))
    assert first.position.tolist() == [8.0, 0.0]
    assert first.bounding_radius == 0.7
    assert (second.name, second.path) == ("gate", ("obstacles", 1))
