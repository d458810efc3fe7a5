"""A mission is worked out once, and all that is made of it agrees."""

from unittest.mock import patch

import numpy as np
import pytest

from escort_mj import Controller
from escort_mj.api import load_scenario
from escort_mj.scenario.geometry import placement
from escort_mj.scenario.mission import Mission, Seen, mission_of
from escort_mj.world.model.build import build


def test_checks_world_and_controller_share_one_drawn_team() -> None:
    keys = {"seed": 8_675_309, "robots": {"count": 7, "placement": {"within": 20.0}}}
    keys["mission"] = {"behaviors": ["surface"]}
    with patch.object(placement, "draw_places", wraps=placement.draw_places) as drawing:
        scenario = load_scenario(keys)
        world, controller = build(scenario), Controller(scenario)
    assert drawing.call_count == 1
    assert world.mission is mission_of(scenario)
    assert np.array_equal(controller.start, world.team.position)
    with pytest.raises(ValueError, match="read-only"):
        world.team.position[0] = 0.0


@pytest.mark.parametrize(
    "name",
    ["main", "truth", "knowledge/lidar", "knowledge/relay", "pursuit/raid", "pursuit/handover"]
    + ["robots/hexarotor", "goals/swap", "sixteen_cell", "sensing"],
)
def test_checks_know_how_large_the_record_of_a_world_is(name: str) -> None:
    world = build(load_scenario(name))
    assert world.mission.trace_size == 8.0 * world.record_size * world.schedule.count


def test_robots_may_start_elsewhere_than_the_scenario_says() -> None:
    scenario = load_scenario("main")
    place = mission_of(scenario).team.position + 1.0
    moved = Mission(scenario, start=place)
    assert np.array_equal(moved.team.position, place)
    assert np.array_equal(moved.team.mass, mission_of(scenario).team.mass)


def test_what_was_seen_has_been_measured_already() -> None:
    scenario = load_scenario("knowledge/relay")
    plain = mission_of(scenario)
    seen = Mission(scenario, seen=Seen(plain.team.position + 2.0, edges=(7,)))
    assert plain.setup.radio is not None and seen.setup.radio is seen.setup.sight is None
    assert np.array_equal(seen.team.position, plain.team.position + 2.0)
    assert 7 in seen.schedule.extra and 7 not in plain.schedule.extra
