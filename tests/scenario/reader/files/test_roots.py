"""Files outside of the scenario's folder: where the scenario declares a root that contains them."""

from pathlib import Path

import pytest

from escort_mj.errors import ScenarioError
from escort_mj.scenario.reader.load import Template, load_file
from tests import meshes
from tests.corpus import assert_said, read
from tests.test_cli import command  # noqa: F401  a fixture: one command in a folder of its own

ROBOT = """\
<mujoco>
  <compiler meshdir="../meshes"/>
  <asset>{mesh}</asset>
  <worldbody><body name="base" pos="0 0 0.1">
    <joint type="slide" axis="1 0 0" name="x"/><joint type="slide" axis="0 1 0" name="y"/>
    <geom type="box" size="0.1 0.1 0.1"/>
  </body></worldbody>
  <actuator><motor joint="x" ctrlrange="-9 9"/><motor joint="y" ctrlrange="-9 9"/></actuator>
</mujoco>
"""
MISSION = """\
duration: 0.5
target: {{waypoints: ../data/way.csv}}
robots: {{count: 2, kind: {{kind: mjcf, file: {file}}}, placement: {{within: 5, least_gap: 0.5}}}}
mission: {{radius: 3, behaviors: [surface]}}
"""


@pytest.fixture
def repo(tmp_path: Path) -> Path:
    """A repository with missions, robots, meshes and data side by side; the mission declares no root."""
    for name in ("missions", "robots", "meshes", "data", "elsewhere"):
        (tmp_path / "repo" / name).mkdir(parents=True)
    repo = tmp_path / "repo"
    (repo / "data" / "way.csv").write_text("0,0,0\n9,1,1\n")
    (repo / "meshes" / "a.obj").write_text(meshes.obj())
    (repo / "robots" / "plain.xml").write_text(ROBOT.format(mesh=""))
    (repo / "robots" / "meshed.xml").write_text(ROBOT.format(mesh='<mesh name="a" file="a.obj"/>'))
    (repo / "missions" / "m.yaml").write_text(MISSION.format(file="../robots/meshed.xml"))
    (tmp_path / "secret.csv").write_text("0,0,0\n9,1,1\n")
    (repo / "data" / "link.csv").symlink_to(tmp_path / "secret.csv")
    return repo


def load(repo: Path, root: str, *overrides: str):
    file = repo / "missions" / "m.yaml"
    text = file.read_text()
    file.write_text(f"root: {root}\n" * bool(root) + text)
    try:
        return load_file(file, overrides)
    finally:
        file.write_text(text)


@pytest.mark.parametrize("root", ["..", "../../repo", "../.."])
def test_a_root_that_holds_all_files(repo: Path, root: str) -> None:
    scenario = load(repo, root)
    assert scenario.robots.kind.file.endswith("meshed.xml") and len(scenario.target.waypoints) == 2
    assert scenario.root == "."  # what is read needs no root any more: it may lie anywhere
    absolute = f"robots.kind.file={repo / 'robots' / 'plain.xml'}"
    assert load(repo, root, absolute).robots.kind.file == str(repo / "robots" / "plain.xml")
    assert load(repo, "", f"root={root}", absolute).robots.mass == pytest.approx(8.0)


def test_without_a_root_the_error_says_how_to_declare_it(repo: Path) -> None:
    with pytest.raises(ScenarioError) as error:
        load(repo, "")
    words = "leads out of the scenario's folder; the key root of the scenario allows it: root: .."
    files = "../data/way.csv", "meshed.xml"
    assert [fault.message for fault in error.value.faults] == [f"{file}: {words}" for file in files]


@pytest.mark.parametrize("case", read(Path(__file__).parents[2] / "roots.yaml"))
def test_nothing_beyond_the_root(repo: Path, case: dict[str, str]) -> None:
    overrides = [case["set"]] if "set" in case else []
    with pytest.raises(ScenarioError) as error:
        load(repo, case["root"], *overrides)
    *others, fault = [fault.message for fault in error.value.faults]
    assert_said(fault, case["said"])
    assert all("leads out" in other for other in others), error.value
    if "leads out" in fault and "/robot.xml" not in case.get("set", ""):  # and what it says helps
        load(repo, fault.rpartition("root: ")[2], *overrides)


def test_a_run_folder_needs_no_root(repo: Path, command, tmp_path: Path) -> None:  # noqa: F811
    mission = repo / "missions" / "m.yaml"
    mission.write_text("root: ..\n" + mission.read_text())
    assert command("run", str(mission), "--no-video", "--no-figures", "--out", "here")[0] == 0
    repo.rename(tmp_path / "gone")
    code, out, _ = command("rerun", "here")
    assert code == 0 and "same bits" in out
    assert Template((tmp_path / "here" / "resolved.yaml").read_text()).overridden()["root"] == "."


def test_check_robot_takes_a_root(repo: Path, command) -> None:  # noqa: F811
    code, _, err = command("check-robot", str(repo / "robots" / "meshed.xml"))
    assert code == 2 and "a.obj: leads out of the robot's folder; --root names a folder" in err
    assert command("check-robot", str(repo / "robots" / "meshed.xml"), "--root", str(repo))[0] in (0, 1)
