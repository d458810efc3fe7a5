"""What `escort-mj new` writes is a scenario that does what it says."""

import pytest

from escort_mj.api import fly
from escort_mj.components.parameters import description_of
from escort_mj.scenario.reader.load import parse_scenario
from escort_mj.scenario.reader.starter import WIDTH, starter
from escort_mj.scenario.schema.scenario import Mission, Scenario


@pytest.mark.parametrize(("robots", "axes"), [(2, 2), (3, 2), (6, 2), (40, 2), (4, 3), (12, 3), (100, 3)])
def test_every_starter_reads_back(robots: int, axes: int) -> None:
    scenario = parse_scenario(starter("mine", robots, axes, "pd"), "mine.yaml")
    assert (scenario.name, scenario.robots.count, scenario.axes) == ("mine", robots, axes)
    assert scenario.controller.law == "pd"


def test_every_key_is_explained_in_the_words_of_the_schema() -> None:
    lines = starter("mine").splitlines()
    assert f"# {description_of(Scenario, 'duration')}" in lines
    assert f"  # {description_of(Mission, 'radius')}" in lines
    keys = [i for i, line in enumerate(lines) if not line.lstrip().startswith(("#", "-"))]
    assert len(keys) > 15
    assert all(lines[i - 1].lstrip().startswith("#") for i in keys)
    assert max(map(len, lines)) <= WIDTH + len("# ")


@pytest.mark.parametrize("axes", [2, 3])
def test_a_starter_passes_its_own_verdicts(axes: int) -> None:
    run = fly(parse_scenario(starter("mine", axes=axes), "mine.yaml"))
    assert run.passed, run.verdicts
