import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from escort_mj.errors import ScenarioError
from escort_mj.laws import Asmc
from escort_mj.scenario import Scenario, parse_scenario

TEXT = """\
name: x
obstacles:
  - {position: [9, 9], radius: 1}
controller: {law: apd_smc, slope: 5}
"""


def overridden(*overrides: str) -> Scenario:
    return parse_scenario(TEXT, "s", overrides)


def test_keys_in_the_file_and_not_in_it():
    scenario = overridden("robots.count=7", "name=y", "mission.radius = 6", "robots.mass=1e-1")
    assert (scenario.robots.count, scenario.name, scenario.mission.radius) == (7, "y", 6.0)
    assert scenario.robots.mass == 0.1


def test_items_of_lists():
    scenario = overridden("obstacles.0.radius=2", "obstacles[1].position=[-9, 9]", "obstacles[1].radius=0.1")
    assert [obstacle.radius for obstacle in scenario.obstacles] == [2.0, 0.1]


def test_items_of_lists_that_are_left_to_their_defaults():
    scenario = overridden("mission.behaviors.1.gain=2", "robots.overrides[0].robot=3")
    assert [behavior.behavior for behavior in scenario.mission.behaviors] == [
        "avoid_obstacles",
        "vertices",
        "surface",
    ]
    assert scenario.mission.behaviors[1].gain == 2.0
    assert scenario.robots.overrides[0].robot == 3


def test_whole_lists_tables_and_expressions():
    scenario = overridden("target.position=[3 + 0.1*t, 0]", "obstacles=[]", "robots={count: 3, mass: 2}")
    assert scenario.target.position == ("3 + 0.1*t", 0.0)
    assert scenario.obstacles == ()
    assert scenario.robots.mass == 2.0


def test_laws():
    assert overridden("controller=asmc").controller == Asmc()
    assert overridden("controller.law=asmc").controller == Asmc(slope=5)
    assert overridden("controller=asmc", "controller.slope=3").controller == Asmc(slope=3)
    assert parse_scenario("name: x", overrides=["controller.slope=3"]).controller.law == "apd_smc"


def test_later_overrides_win():
    assert overridden("seed=1", "seed=2").seed == 2
    assert overridden("robots={mass: 3}", "robots.mass=4").robots.mass == 4.0


def test_a_mapping_of_values():
    scenario = parse_scenario(
        TEXT,
        overrides={
            "robots.mass": np.float64(1 / 3),
            "seed": np.int64(4),
            "target.position": np.array([0.1, 0.2]),
            "controller": Asmc(slope=2),
            "expect": [{"metric": "contacts", "at_most": 0}],
            "description": "3",
        },
    )
    assert scenario.robots.mass == 1 / 3
    assert scenario.seed == 4
    assert scenario.target.position == (0.1, 0.2)
    assert scenario.controller == Asmc(slope=2)
    assert scenario.description == "3"


def test_faults_of_file_and_overrides_together():
    with pytest.raises(ScenarioError) as caught:
        parse_scenario("duration: -1\n", "s", ["seed=x", "robots.count"])
    assert [str(fault) for fault in caught.value.faults] == [
        "s:1:11: duration: found -1; expected more than 0",
        '--set seed=x: seed: found "x"; expected a whole number',
        "--set robots.count: expected key.path=value, such as robots.count=7",
    ]


def test_an_override_can_mend_a_fault():
    assert parse_scenario("duration: -1\n", overrides=["duration=3"]).duration == 3.0


LETTERS = st.characters(exclude_categories=("Cs",), exclude_characters="\0")  # refused in any argument
keys = st.sampled_from(
    ["robots", "count", "obstacles", "0", "[1]", "mission", "behaviors", "controller", "law", "x"]
)


@given(st.lists(keys, min_size=1, max_size=4), st.text(LETTERS, max_size=20))
def test_any_override_is_set_or_an_error(path: list[str], value: str):
    try:
        overridden(f"{'.'.join(path)}={value}")
    except ScenarioError as error:
        assert error.faults
