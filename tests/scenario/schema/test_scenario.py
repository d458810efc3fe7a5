"""Scenarios built and changed in Python: checked as files are, with messages that speak of keys."""

import pickle

import numpy as np
import pytest

from escort_mj.errors import ScenarioError, UsageError
from escort_mj.robots import PointMass
from escort_mj.scenario import Scenario, parse_scenario


def faults(**data: object) -> list[str]:
    with pytest.raises(ScenarioError) as caught:
        Scenario(**data)
    return [str(fault) for fault in caught.value.faults]


def test_all_faults_at_once_with_their_keys() -> None:
    found = faults(
        recording={"rate": 60.0},
        expect=[{"metric": "contacts"}],
        robots={"count": 1},
        mission={"behaviors": ["chords"]},
        descripton="x",
    )
    assert [fault.partition(":")[0] for fault in found] == [
        *("descripton", "recording.rate", "expect[0]", "mission.behaviors[0]")
    ]
    assert 'did you mean "description"?' in found[0]


@pytest.mark.parametrize(
    ("data", "words"),
    [
        ({"axes": 3, "target": {"position": [0, 0]}}, "target.position: found 2"),
        ({"robots": {"count": 4, "positions": [[0, 0]]}}, "robots.positions: found 1 positions; expected 4"),
        ({"seed": "3"}, 'seed: found "3"; expected a whole number'),
        ({"duration": True}, "duration: found true; expected a number"),
        ({"duration": 1e-40}, "duration: found 1e-40; expected 0 or a number"),
        ({"description": "a\0b"}, "description: found the character U+0000"),
        ({"robots": {1: 2}}, "robots: found the key 1; expected text"),
    ],
)
def test_what_a_file_could_not_say_either(data: dict, words: str) -> None:
    (fault,) = faults(**data)
    assert fault.startswith(words)
    with pytest.raises(UsageError, match="Scenario: found a table of keys; expected keys, such as Scenario"):
        Scenario(data)


def test_arrays_scalars_and_tables_do_for_lists_numbers_and_mappings() -> None:
    scenario = Scenario(
        duration=np.float64(2.0),
        robots={"count": np.int64(2), "positions": np.array([[3.0, 0.0], [-3.0, 0.0]]), "kind": PointMass()},
        obstacles=({"position": np.array([9, 9]), "radius": np.float32(0.5)},),
    )
    text = """
      {duration: 2.0, obstacles: [{position: [9, 9], radius: 0.5}],
       robots: {count: 2, positions: [[3, 0], [-3, 0]], kind: point_mass}}
    """
    assert scenario == parse_scenario(text)
    assert scenario.replace({"robots.mass": np.array(2.0)}).robots.mass == 2.0
    assert Scenario(**scenario.model_dump()) == pickle.loads(pickle.dumps(scenario)) == scenario


def test_teams_with_the_same_law_have_one() -> None:
    teams = [
        {"name": name, "robots": robots, "targets": [{"name": f"of_{name}", "position": [x, 0.0]}]}
        for name, robots, x in (("left", [1, 2], -9.0), ("right", [3, 4, 5], 9.0))
    ]
    one = Scenario(target=None, teams=[{**team, "controller": "asmc"} for team in teams])
    assert one.law_names == "asmc" and len(one.laws) == 1
    two = Scenario(target=None, teams=[teams[0] | {"controller": "asmc"}, teams[1]])
    assert two.law_names == "asmc (left), apd_smc (right)" and len(two.laws) == 2
    assert two.replace({"teams[0].controller": None}).law_names == "apd_smc"
    assert two.replace({"controller": "asmc"}).law_names == "asmc"


def test_robots_may_have_laws_of_their_own() -> None:
    overrides = [{"robot": 2, "mass": 3}, {"robot": 4, "controller": {"law": "pd", "slope": 7}}]
    scenario = Scenario(robots={"count": 5, "overrides": overrides})
    assert scenario.law_names == "apd_smc, pd (robot 4)"
    assert [law.law for law in scenario.laws] == ["apd_smc", "pd"]
    same = scenario.replace({"robots.overrides[1].controller": "apd_smc"})
    assert same.law_names == "apd_smc" and len(same.laws) == 1


def test_replace_checks_what_it_returns() -> None:
    scenario = parse_scenario("robots: {count: 5}")
    changed = scenario.replace({"robots.mass": 2, "controller": "pd"}, duration=4)
    assert (changed.robots.mass, changed.controller.law, changed.duration) == (2.0, "pd", 4.0)
    assert scenario.robots.mass != 2.0
    assert scenario.replace(["robots.mass=2"]).replace(**{"controller.law": "pd", "duration": 4}) == changed
    with pytest.raises(ScenarioError) as caught:
        scenario.replace({"robots.masss": 2, "no key": 1}, seed=-1)
    assert "--set" not in str(caught.value)


def test_a_copy_with_changes_is_checked_too() -> None:
    scenario = Scenario()
    assert scenario.model_copy() == scenario
    assert scenario.model_copy(update={"seed": 3}).seed == 3
    with pytest.raises(ScenarioError, match="^axes: found 1; expected at least 2$"):
        scenario.model_copy(update={"axes": 1})


def test_a_fault_of_other_keys_names_the_one_that_was_set() -> None:
    with pytest.raises(ScenarioError, match="^physics.timestep: recording.rate: found 50 samples"):
        parse_scenario("name: x", "x.yaml", {"physics.timestep": 0.003})
