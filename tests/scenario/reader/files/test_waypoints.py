"""Waypoints from a CSV file: what they become, and one clear error for each table that is wrong."""

from pathlib import Path

import pytest

from escort_mj.errors import ScenarioError
from escort_mj.scenario import dump_scenario, load_file, parse_scenario
from escort_mj.scenario.reader.load import Template
from escort_mj.scenario.schema.obstacle_tables import Waypoint
from tests.corpus import assert_said, read

TABLE = "time,x,y\n# a comment\n0, 0, 0\n10, 3, 1\n\n"
POINTS = (Waypoint(time=0.0, position=(0.0, 0.0)), Waypoint(time=10.0, position=(3.0, 1.0)))


def scenario(folder: Path, table: str | None = TABLE, name: str = "way.csv") -> Path:
    if table is not None:
        (folder / "way.csv").write_text(table)
    file = folder / "mine.yaml"
    file.write_text(f"name: mine\nrobots: {{count: 5}}\ntarget:\n  waypoints: {name}\n")
    return file


def test_a_table_becomes_waypoints(tmp_path: Path) -> None:
    loaded = load_file(scenario(tmp_path))
    assert loaded.target.waypoints == POINTS
    assert parse_scenario(dump_scenario(loaded)) == loaded, "a stored scenario needs no table"


def test_obstacles_take_tables(tmp_path: Path) -> None:
    file = scenario(tmp_path, "0,5,5\n10,3,8\n")
    file.write_text(
        "name: mine\nrobots: {count: 5}\n"
        "obstacles: [{radius: 0.5, position: [9, 9]}, {radius: 0.5, motion: {waypoints: way.csv}}]\n"
    )
    motion = load_file(file).obstacles[1].motion
    assert motion is not None and motion.waypoints is not None
    assert [waypoint.position for waypoint in motion.waypoints] == [(5.0, 5.0), (3.0, 8.0)]


def test_overrides_name_tables_and_studies_see_their_content(tmp_path: Path) -> None:
    file = scenario(tmp_path)
    (tmp_path / "other.csv").write_text("0,1,1\n5,2,2\n")
    template = Template(file.read_text(), str(file))
    assert template.scenario({"target.waypoints": "other.csv"}).target.waypoints[1].time == 5.0
    before = template.overridden()
    (tmp_path / "way.csv").write_text(TABLE.replace("10", "20"))
    assert template.overridden() != before


MANY = {"table": "0,0,0\n" * 10_001, "said": "... more than 10,000 waypoints"}


@pytest.mark.parametrize("case", [*read(Path(__file__).parents[2] / "waypoints.yaml"), MANY])
def test_wrong_tables(tmp_path: Path, case: dict[str, str]) -> None:
    with pytest.raises(ScenarioError) as wrong:
        load_file(scenario(tmp_path, case.get("table"), case.get("name", "way.csv")))
    (fault,) = wrong.value.faults
    assert_said(fault.message, case["said"])
    assert (fault.key, fault.line) == ("target.waypoints", 4)


def test_what_is_in_a_table_is_checked_like_a_list(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="waypoints are in order of time"):
        load_file(scenario(tmp_path, "10,0,0\n0,3,1\n"))
    with pytest.raises(ScenarioError, match=r"target.waypoints\[0\].position"):
        load_file(scenario(tmp_path, "0,0,0,1\n"))
