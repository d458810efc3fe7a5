"""`gains: auto`: numbers in the scenario that is read, and what is wrong with it."""

from typing import Any

import jsonschema
import pytest

from escort_mj.scenario import dump_scenario, parse_scenario
from escort_mj.scenario.geometry.team_gains import proposal

TEXT = "robots: {actuators: {lag: 0.1}}\ncontroller: {law: pd_smc, gains: auto, boundary_layer: 0.3}\n"


def test_the_stored_scenario_has_the_numbers() -> None:
    scenario = parse_scenario(TEXT)
    assert scenario.controller.derivative_gain == pytest.approx(0.9 / (2 * 0.103), rel=5e-3)
    assert scenario.controller.boundary_layer == 0.3
    assert "auto" not in dump_scenario(scenario).replace("autoreset", "")
    assert parse_scenario(dump_scenario(scenario)) == scenario
    found = proposal(scenario)
    assert found is not None and found.gains["slope"] == scenario.controller.slope


def test_overrides_come_before_the_gains() -> None:
    slow = parse_scenario(TEXT, overrides=["robots.actuators.lag=0.2"])
    assert slow.controller.derivative_gain < 0.6 * parse_scenario(TEXT).controller.derivative_gain
    heavy = parse_scenario("name: some\n", overrides=["controller.gains=auto", "robots.mass=2"])
    light = parse_scenario("name: some\ncontroller: {gains: auto}\n")
    assert heavy.controller.law == "apd_smc"
    assert heavy.controller.derivative_gain == pytest.approx(2 * light.controller.derivative_gain)


TEAMS = """
target: null
robots: {count: 5, overrides: [{robot: 4, mass: 3}, {robot: 5, mass: 4}]}
controller: {gains: auto}
teams:
  - {name: one, robots: [1, 2, 3], targets: [{name: a}]}
  - name: two
    robots: [4, 5]
    targets: [{name: b, position: [20, 0]}]
    controller: {law: pd, gains: auto, slope: 5}
"""


def test_gains_of_a_teams_law_fit_its_members() -> None:
    scenario = parse_scenario(TEAMS)
    own = scenario.teams[1].controller
    assert own is not None and (own.law, own.slope, own.derivative_gain) == ("pd", 5.0, 150.0)
    assert scenario.controller == parse_scenario("controller: {gains: auto}").controller
    assert parse_scenario(dump_scenario(scenario)) == scenario


def test_gains_of_a_robots_own_law_fit_that_robot() -> None:
    own = "robots.overrides[1].controller={law: pd, gains: auto, slope: 5}"
    scenario = parse_scenario(TEAMS, overrides=[own])
    (_, heavy), team = scenario.robots.overrides, scenario.teams[1].controller
    assert heavy.controller is not None and heavy.controller.derivative_gain == 200.0
    assert team is not None and team.derivative_gain == 150.0, "of robot 4, which has no law of its own"
    assert parse_scenario(dump_scenario(scenario)) == scenario


def test_where_robots_change_over_gains_fit_all() -> None:
    scenario = parse_scenario(TEAMS, overrides=["teams[0].demand=[{after: 1, robots: 4}]"])
    found = proposal(scenario, ("teams", 1))
    assert found is not None and (found.law, found.robot) == ("pd", 1)
    assert scenario.teams[1].controller.derivative_gain == 50.0


def test_editors_know_it(schema: dict[str, Any]) -> None:
    editor = jsonschema.Draft202012Validator(schema)
    assert editor.is_valid({"controller": {"law": "asmc", "gains": "auto"}})
    for wrong in ({"law": "asmc", "gains": "fast"}, {"law": "super_twisting", "gains": "auto"}):
        assert not editor.is_valid({"controller": wrong})
