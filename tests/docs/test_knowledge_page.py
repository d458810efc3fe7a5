"""docs/knowledge.md: its benchmark has a place for each table, and its teams and study are valid."""

import pytest

from benchmarks.knowledge import HEADS, NOISES, TEAMS, team
from escort_mj.api import scenarios_folder
from escort_mj.study.sweeps.definition import load_study
from escort_mj.study.sweeps.design import Design
from tests.docs.pages import ROOT

PAGE = (ROOT / "docs" / "knowledge.md").read_text(encoding="utf-8")


def test_each_table_has_its_place_and_columns() -> None:
    for name, head in HEADS.items():
        assert f"<!-- {name} -->\n| {' | '.join(head)} |\n" in PAGE, name


@pytest.mark.parametrize("count", TEAMS)
def test_teams_are_valid(count: int) -> None:
    scenario = team(count, NOISES[-1])
    assert (scenario.robots.count, scenario.axes) == (count, TEAMS[count][0])
    assert scenario.knowledge is not None and scenario.communication is not None
    assert scenario.knowledge.target.noise.position == NOISES[-1]


def test_the_study_is_valid() -> None:
    path = scenarios_folder() / "studies" / "robustness_radio.yaml"
    assert len(Design(load_study(path), scenarios_folder()).cells) == 40
