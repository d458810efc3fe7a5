"""Robots from files that cannot be used: one error each, which says what was found and what is allowed."""

import os
from pathlib import Path

import pytest

from escort_mj.errors import ScenarioError
from escort_mj.scenario import load_file

BODY = '<body name="base"><freejoint/><geom name="hull" size="0.1" mass="1"/>{}</body>'
MOTORS = "".join(
    f'<motor name="{axis}" site="middle" gear="{gear} 0 0 0" ctrlrange="-50 50" ctrllimited="true"/>'
    for axis, gear in zip("xyz", ("1 0 0", "0 1 0", "0 0 1"), strict=True)
)
LIFT = '<motor name="lift" site="middle" gear="0 0 1 0 0 0" ctrlrange="0 {}" ctrllimited="true"/>'
TURNS = "".join(
    f'<motor name="turn_{gear}" site="middle" gear="0 0 0 {gear}" ctrlrange="-1 1" ctrllimited="true"/>'
    for gear in ("1 0 0", "0 1 0", "0 0 1")
)
WEAK = TURNS.replace('"-1 1"', '"-1e-9 1e-9"')
WHEELS = "".join(
    f'<body name="{side}" pos="0 {y} -0.05"><joint name="{side}" axis="0 1 0"/>'
    '<geom type="cylinder" size="0.06 0.01" zaxis="0 1 0" mass="0.2"/></body>'
    for side, y in (("left", 0.1), ("right", -0.1))
)
DRIVEN = '<motor name="left" joint="left"/><motor name="right" joint="right"/>'


def model(body: str = BODY.format('<site name="middle"/>'), actuators: str = MOTORS, more: str = "") -> str:
    world = f"<worldbody>{body}</worldbody>"
    return f"<mujoco>{more}{world}<actuator>{actuators}</actuator></mujoco>"


ROVER = model(BODY.format(WHEELS), DRIVEN)
MESH = '<asset><mesh name="skin" file="skin.stl"/></asset>'
# name: the file's text, further keys of the scenario, what the error says
WRONG: dict[str, tuple[str, str, str]] = {
    "no file": ("", "", "there is no such file; did you mean"),
    "no XML": ("free joint", "", "this is not XML"),
    "another format": ("<robot name='x'/>", "", "found <robot>; a robot is MJCF"),
    "a document type": ("<!DOCTYPE x [<!ENTITY a 'b'>]><mujoco/>", "", "found a document type"),
    "refused by MuJoCo": (model(more="<optoin/>"), "", "MuJoCo refuses it"),
    "no actuator": (model(actuators=""), "", "has no actuator"),
    "too many elements in each other": (
        model("<body>" * 5000 + "</body>" * 5000),
        "",
        "found more than 100 elements in each other",
    ),
    "too many bodies": (
        model(BODY.format('<replicate count="3000"><body><geom size="0.01"/></body></replicate>')),
        "",
        "found more than 2000 bodies, repeated ones counted",
    ),
    "numbers too large": (
        model(BODY.format('<site name="middle"/>'), LIFT.format("1e200") + TURNS),
        "",
        'found <motor ctrlrange="0 1e200">; expected finite numbers of at most 1e+10',
    ),
    "a gap beyond the margin": (
        model(BODY.format('<site name="middle"/>').replace('mass="1"', 'mass="1" gap="1e9"')),
        "",
        "the geom hull: found a gap of 1e+09 m; allowed is at most 10 m",
    ),
    "no number": (
        model(BODY.replace('mass="1"', 'mass="nan"').format('<site name="middle"/>')),
        "",
        'found <geom mass="nan">; expected finite numbers',
    ),
    "no torque": (
        model(BODY.format('<site name="middle"/>'), LIFT.format("50") + WEAK),
        "",
        "its rotors turn it about x or y with at most",
    ),
    "no free base": (model('<body name="base"><geom size="0.1"/></body>', ""), "", "has no base"),
    "a base on one rail": (
        model('<body><joint name="x" type="slide"/><geom size="1"/></body>', '<motor joint="x"/>'),
        "",
        "has no base",
    ),
    "two bases": (
        model(
            BODY.format('<site name="middle"/>')
            + '<body name="other"><freejoint/><geom size="0.1"/><site name="far"/></body>',
            MOTORS + '<motor site="far" gear="1 0 0 0 0 0"/>',
        ),
        "",
        "found 2 bases, base and other; say which by the key body",
    ),
    "actuator elsewhere": (
        model(
            BODY.format('<site name="middle"/>')
            + '<body name="door"><joint name="door"/><geom size="1"/></body>',
            MOTORS + '<motor name="opener" joint="door"/>',
        ),
        "body: base",
        "the actuator opener acts on door, which is no part of the robot base",
    ),
    "unknown body": (model(), "body: bass", "has no body bass; found base; did you mean"),
    "a body that cannot move": (
        model(BODY.format('<site name="middle"/>') + '<body name="post"><geom size="0.1"/></body>'),
        "body: post",
        "the body post cannot move",
    ),
    "unknown drive": (model(), "drive: legs", 'found "legs"; allowed are force'),
    "a drive that it has not": (ROVER, "drive: thrust", "found no actuator on its base for the drive thrust"),
    "no mass": (
        model('<body name="base"><freejoint/><geom size="0.1" mass="0"/><site name="middle"/></body>'),
        "",
        "mass and inertia",
    ),
    "clashing names": (model(actuators=MOTORS + MOTORS), "", "repeated name 'x' in actuator"),
    "missing mesh": (model(more=MESH), "", "skin.stl: there is no such file"),
    "mesh outside": (model(more=MESH.replace("skin", "../../skin")), "", "leads out of the scenario"),
    "mesh by an absolute path": (model(more=MESH.replace("skin.stl", "/a.stl")), "", "expected a path"),
    "mesh that is none": (model(more=MESH.replace("skin.stl", "broken.stl")), "", "MuJoCo refuses it"),
    "mesh too large": (model(more=MESH.replace("skin.stl", "huge.stl")), "", "allowed are 50 MB"),
    "cyclic include": ("<mujoco><include file='robot.xml'/></mujoco>", "", "robot.xml includes itself"),
    "missing include": ("<mujoco><include file='arm.xml'/></mujoco>", "", "arm.xml: there is no such file"),
    "keyframe of another robot": (
        model(more='<keyframe><key qpos="0 0 1 1 0 0 0 0 0"/></keyframe>'),
        "",
        "MuJoCo refuses it",
    ),
    "too weak to hover": (
        model(actuators=LIFT.format(5) + TURNS),
        "",
        "its thrust of 5 N cannot hold its weight of 9.81 N; expected at least 1.05 times as much",
    ),
    "pushed along one axis": (
        model(actuators='<motor site="middle" gear="1 0 0 0 0 0"/>'),
        "",
        "push the base along x and cannot turn it",
    ),
    "one wheel": (model(BODY.format(WHEELS), '<motor joint="left"/>'), "", "in one line, so it cannot be"),
    "skin": (model(more="<deformable><skin/></deformable>"), "", "found <deformable>"),
    "another content": (model(), f"sha256: {'a' * 64}", "has changed: its sha256 is"),
    "out of the folder": (model(), "file: ../robot.xml", "leads out of the scenario's folder"),
    "absolute": (model(), "file: /robot.xml", "expected a path relative to the scenario's folder"),
}  # fmt: skip


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


@pytest.mark.parametrize("name", WRONG)
def test_one_error_with_its_place(name: str, tmp_path: Path) -> None:
    text, keys, words = WRONG[name]
    path = scenario(tmp_path, text, keys)
    with pytest.raises(ScenarioError) as caught:
        load_file(path)
    (fault,) = caught.value.faults
    assert words in fault.message, fault
    assert fault.key.startswith("robots.kind") and fault.line == 4 and fault.source == str(path)


MISUSED = {
    "in space": (ROVER, "axes: 3\n", "found mjcf in 3 axes; expected axes 2"),
    "errors of motors": (
        ROVER.replace("<motor", "<velocity"),
        "  actuators: {lag: 0.1}\n",
        "found errors of motors; servos move robot 1",
    ),
    "another mass": (model(), "  mass: 3\n", "found 3 kg; the robot's file says 1 kg, leave it out"),
    "too small": (model(), "  radius: 0.05\n", "found 0.05 m; it reaches 0.1"),
    "the truth": (model(), "recording: {truth: true}\n", "found true; robot 1 is of the kind mjcf"),
    "a law with a model": (model(), "controller: {law: pd}\n", "found pd, which is given each robot's mass"),
}


@pytest.mark.parametrize("name", MISUSED)
def test_what_a_scenario_may_not_ask_of_it(name: str, tmp_path: Path) -> None:
    text, more, words = MISUSED[name]
    with pytest.raises(ScenarioError) as caught:
        load_file(scenario(tmp_path, text, more=more))
    (fault,) = caught.value.faults
    assert words in fault.message


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
