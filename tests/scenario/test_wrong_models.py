"""Robots from files that cannot be used: one error each, which says what was found and what is allowed."""

import os
from pathlib import Path
from string import Template

import pytest
from ruamel.yaml import YAML

from escort_mj.errors import ScenarioError
from escort_mj.scenario import load_file

PARTS, CASES = YAML(typ="safe").load_all(Path(__file__).with_name("wrong_models.yaml"))
DEEP = f"<mujoco><worldbody>{'<body>' * 5000}{'</body>' * 5000}</worldbody></mujoco>"


def scenario(folder: Path, text: str, keys: str = "", more: str = "") -> Path:
    inside = folder / "inside"
    inside.mkdir()
    (inside / "robots.xml").write_text("<mujoco/>")
    (inside / "broken.stl").write_bytes(b"solid")
    with (inside / "huge.stl").open("wb") as huge:
        huge.truncate(60_000_000)
    if text:
        (inside / "robot.xml").write_text(text)
    kind = f"kind: mjcf, {'' if 'file:' in keys else 'file: robot.xml, '}{keys}".rstrip(", ")
    path = inside / "scenario.yaml"
    path.write_text(f"duration: 1\nrobots:\n  count: 2\n  kind: {{{kind}}}\n{more}")
    return path


@pytest.mark.parametrize("case", CASES, ids=[case["what"] for case in CASES])
def test_one_error_with_its_place(case: dict[str, str], tmp_path: Path) -> None:
    text, more = Template(case["file"]).substitute(PARTS), case.get("more", "")
    path = scenario(tmp_path, text, case.get("kind", ""), more)
    with pytest.raises(ScenarioError) as caught:
        load_file(path)
    (fault,) = caught.value.faults
    assert case["said"] in fault.message, fault
    if not more:
        assert fault.key.startswith("robots.kind") and fault.line == 4 and fault.source == str(path)


def test_too_many_elements_in_each_other(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="found more than 100 elements in each other"):
        load_file(scenario(tmp_path, DEEP))


def test_a_model_that_is_not_here(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(__import__("sys").modules, "mujoco_menagerie", None)
    path = tmp_path / "scenario.yaml"
    path.write_text("duration: 1\nrobots: {count: 2, kind: {kind: menagerie, model: skydio_x2}}\n")
    with pytest.raises(ScenarioError, match="the Menagerie's package is not installed: pip install"):
        load_file(path)


@pytest.mark.parametrize(
    "key", ["robots: {count: 2, kind: {kind: mjcf, file: pipe.xml}}", "target: {waypoints: pipe.csv}"]
)
def test_a_fifo_is_not_waited_for(tmp_path: Path, key: str) -> None:
    for suffix in (".xml", ".csv"):
        os.mkfifo(tmp_path / f"pipe{suffix}")
    (tmp_path / "s.yaml").write_text(f"duration: 1\n{key}\n")
    with pytest.raises(ScenarioError, match="is a FIFO, not a file"):
        load_file(tmp_path / "s.yaml")
