"""Robots from MJCF files: what is found in them, and missions that they fly and drive."""

import shutil
from pathlib import Path

import mujoco
import numpy as np
import pytest

from escort_mj.mission import begin_folder, fly
from escort_mj.record.folder import RunFolder
from escort_mj.robots.drive import FORCE, POSITION, RATE, THRUST
from escort_mj.robots.modeled import RobotModel, Source
from escort_mj.scenario import load_file
from escort_mj.scenario.reader.load import stored_scenario
from escort_mj.world.model.build import build
from escort_mj.world.model.robot.reading import read_model
from tests import meshes

HEXAROTOR = (Path(__file__).parents[2] / "scenarios/robots/hexarotor.xml").read_text()
ROVER, SLIDES = (Path(__file__).with_name(f"{name}.xml").read_text() for name in ("rover", "slides"))
TORQUES = ROVER.format("motor", 'ctrlrange="-1.5 1.5"')
RATES = ROVER.format("velocity", 'kv="0.5" ctrlrange="-30 30"')


def found(text: str) -> RobotModel:
    return read_model(Source(text=text, name="robot"))


def test_rotors_of_any_geometry_share_the_weight() -> None:
    model = found(HEXAROTOR)
    weight, drive = model.mass * 9.81, model.drive
    assert (drive.mode, drive.found, drive.holds_attitude, drive.lifts) == (THRUST, "thrust", True, True)
    assert model.mass == pytest.approx(1.5)
    np.testing.assert_allclose([row.mix_1 * weight for row in drive.inputs], weight / 6, rtol=1e-9)
    assert drive.limits[2] == pytest.approx(6 * 9.0 - weight)
    angles = np.pi / 3 * np.arange(6)
    for turn, arm in (
        ("mix_2", np.sin(angles)),
        ("mix_3", -np.cos(angles)),
    ):  # least squares: as the arms are
        np.testing.assert_allclose([getattr(row, turn) for row in drive.inputs], arm / 0.25 / 3, atol=1e-4)


def test_wheels_by_torque_are_pushed_at_a_point_ahead_of_the_axle() -> None:
    model = found(TORQUES)
    drive = model.drive
    assert (drive.mode, drive.found, model.stands) == (FORCE, "wheels", True)
    assert drive.point[:2] == pytest.approx((0.13, 0.0)), "half the track"
    assert [[row.effect_x, row.effect_y] for row in drive.inputs] == pytest.approx(
        np.array([[1.0, -1.0], [1.0, 1.0]]) / 0.06
    )
    assert drive.limits[:2] == pytest.approx((50.0, 50.0)), "two torques of 1.5 N m at 0.06 m"
    spin = 0.5 * 0.4 * 0.06**2 * 2 / 0.06**2
    assert drive.effective_mass[0] == pytest.approx(7.0 + spin, rel=1e-5)


def test_motors_may_turn_both_wheels_through_tendons() -> None:
    tendons = """<tendon>
      <fixed name="ahead"><joint joint="left" coef="0.5"/><joint joint="right" coef="0.5"/></fixed>
      <fixed name="turn"><joint joint="left" coef="-0.5"/><joint joint="right" coef="0.5"/></fixed>
    </tendon>"""
    text = TORQUES.replace('joint="left" c', 'tendon="ahead" c').replace('joint="right" c', 'tendon="turn" c')
    text = text.replace("<actuator>", f"{tendons}<actuator>").replace(
        "<default>", '<default><joint damping="0.01" actuatorfrcrange="-2 2"/><tendon width="0.01"/>', 1
    )
    model, alone = found(text), found(TORQUES)
    assert model.drive.found == "wheels" and model.drive.effective_mass == alone.drive.effective_mass
    ahead, turn = model.drive.inputs
    assert ahead.mix_2 == turn.mix_1 == 0.0 and model.drive.limits[0] == pytest.approx(1.5 / 0.06)
    fixed = model.sections["tendon"][0]
    assert fixed.get("width") == "0.01" and set(fixed[0].keys()) == {"joint", "coef"}, "names, not a joint"


def test_an_attitude_loop_saturates_at_an_eighth_of_the_tilt_limit() -> None:
    slow = found(HEXAROTOR.replace('ctrlrange="0 9"', 'ctrlrange="0 2.7"')).drive
    assert slow.craft is not None
    tilt, torque = np.arctan(slow.craft.most_slope), slow.craft.stiffness_x * slow.craft.inertia_x
    within = min(min(row.high - row.mix_1 * 1.5 * 9.81, row.mix_1 * 1.5 * 9.81) / abs(row.mix_2)
                 for row in slow.inputs if abs(row.mix_2) > 1e-9)  # fmt: skip
    assert torque * tilt / 8 == pytest.approx(within, rel=1e-3)


def test_wheels_by_velocity_servos_are_given_rates() -> None:
    drive = found(RATES).drive
    assert (drive.mode, drive.found) == (RATE, "wheels")
    mixed = [[row.mix_1, row.mix_2] for row in drive.inputs]
    assert mixed == pytest.approx(np.array([[1.0, -1.0], [1.0, 1.0]]) / 0.06)
    assert drive.limits[:2] == pytest.approx((1.8, 1.8)) and 0.0 < drive.stiffen <= 4.0


def test_position_servos_get_places_in_their_own_coordinates() -> None:
    model = found(SLIDES)
    drive = model.drive
    assert (drive.mode, drive.found, model.stands) == (POSITION, "omni", False)
    assert [(row.control, row.trim, row.mix_1, row.mix_2) for row in drive.inputs] == [
        (0.0, 2.0, pytest.approx(0.0, abs=1e-9), pytest.approx(1.0)),
        (1.0, 1.0, pytest.approx(1.0), pytest.approx(0.0, abs=1e-9)),
        (2.0, 0.5, pytest.approx(0.0, abs=1e-9), pytest.approx(0.0, abs=1e-9)),
    ], "the arm's servo drives nothing"
    assert model.ctrl == (2.0, 1.0, 0.5, 0.3)


def omni_wheel(number: int) -> str:
    """A wheel a third of a turn after the one before, with rollers around it."""
    along = 2.0 * np.pi * number / 3
    out, side, up = np.array(
        [[np.cos(along), np.sin(along), 0], [-np.sin(along), np.cos(along), 0], [0, 0, 1]]
    )
    rollers = ""
    for angle in np.pi / 4 * np.arange(8):
        place, axis = np.cos(angle) * side + np.sin(angle) * up, np.cos(angle) * up - np.sin(angle) * side
        words = [" ".join(map(str, each)) for each in (0.04 * place, axis, -0.01 * axis, 0.01 * axis)]
        rollers += (
            f'<body pos="{words[0]}"><joint axis="{words[1]}"/>'
            f'<geom type="capsule" size="0.01" fromto="{words[2]} {words[3]}" mass="0.01"/></body>'
        )
    place, axis = (" ".join(map(str, each)) for each in (0.15 * out, out))
    wheel = f'<joint name="w{number}" axis="{axis}"/><geom size="0.02" mass="0.1"/>'
    return f'<body pos="{place}">{wheel}{rollers}</body>'


def test_wheels_with_rollers_move_it_in_all_directions() -> None:
    wheels = "".join(map(omni_wheel, range(3)))
    motors = "".join(f'<velocity joint="w{k}" kv="1"/>' for k in range(3))
    base = f'<body pos="0 0 0.05"><freejoint/><geom size="0.1 0.02" type="cylinder" mass="5"/>{wheels}</body>'
    drive = found(f"<mujoco><worldbody>{base}</worldbody><actuator>{motors}</actuator></mujoco>").drive
    assert (drive.mode, drive.found, drive.holds_attitude) == (RATE, "omni", True)
    angles = 2.0 * np.pi * np.arange(3) / 3
    mixed = np.array([[row.mix_1, row.mix_2, row.mix_6] for row in drive.inputs])
    expected = np.column_stack([np.sin(angles), -np.cos(angles), np.full(3, -0.15)]) / 0.05
    np.testing.assert_allclose(mixed, expected, atol=1e-6)


@pytest.fixture
def team(tmp_path: Path) -> Path:
    for name, text in (("rover", TORQUES), ("servo_rover", RATES), ("slides", SLIDES)):
        (tmp_path / f"{name}.xml").write_text(text)
    path = tmp_path / "team.yaml"
    path.write_text("""
duration: 25
target: {position: [0.3*t, 0.5*sin(0.2*t)], radius: 0.2}
mission:
  radius: 2.5
  max_speed: 1
  behaviors: [{behavior: avoid_obstacles, safe_distance: 0.4, measure: surface}, vertices, surface]
obstacles: [{position: [4, 2.3], radius: 0.4}]
robots:
  count: 5
  kind: {kind: mjcf, file: rover.xml}
  placement: {within: 5, least_gap: 0.6}
  overrides:
    - {robot: 2, kind: {kind: mjcf, file: servo_rover.xml}}
    - {robot: 3, kind: {kind: mjcf, file: slides.xml}}
    - {robot: 5, kind: {kind: mjcf, file: slides.xml}}
controller: {proportional_gain: 90, derivative_gain: 50, adaptation_rate: 40, slope: 2, switching_gain: 5}
""")
    return path


def test_servos_are_integrated_implicitly_unless_told_otherwise(team: Path) -> None:
    assert load_file(team).physics.integrator == "implicitfast"
    assert load_file(team, {"physics.integrator": "euler"}).physics.integrator == "euler"


def test_files_with_the_same_names_stand_side_by_side(team: Path) -> None:
    world = build(load_file(team))
    data = mujoco.MjData(world.model)
    mujoco.mj_resetDataKeyframe(world.model, data, 0)
    mujoco.mj_forward(world.model, data)
    for i, place in enumerate(world.team.position, 1):
        np.testing.assert_allclose(data.geom(f"robot_{i}_body").xpos[:2], place, atol=1e-6)
    assert data.joint("robot_3/arm").qpos == data.actuator("robot_3/arm").ctrl == pytest.approx(0.3)
    assert data.geom("robot_1_body").xpos[2] == pytest.approx(0.06 + world.model.geom("robot_1_body").pos[2])
    assert world.team.mass == pytest.approx([7.0, 7.0, 10.5, 7.0, 10.5])
    again = mujoco.MjModel.from_xml_string(world.xml, world.assets)
    assert (again.nq, again.nu) == (world.model.nq, world.model.nu) == (3 * 9 + 2 * 4, 3 * 2 + 2 * 4)


def test_a_team_of_three_kinds_escorts(team: Path, compiled: None) -> None:
    run = fly(load_file(team))
    assert run.passed, run.message
    trace = run.trace
    distance = np.linalg.norm(trace["q"].values - trace["target_position"].values[:, None], axis=2)
    assert np.abs(distance[-100:] - 2.5).max(axis=0) == pytest.approx(0.0, abs=0.03)
    assert not len(trace["episode_start"]) or set(
        trace["body_group"].values[trace["episode_second"].values.astype(int)]
    ) == {"floor"}
    torque = slice(0, 1)
    np.testing.assert_allclose(
        trace["drive_force"].values[:, torque], trace["force"].values[:, torque], atol=1e-6
    )
    assert not trace["drive_force"].values[:, 2].any(), "a servo decides on its force"


MOTORS = """
duration: 3
target: {{position: [0, 0], radius: 0.2}}
mission: {{radius: 2, behaviors: [surface]}}
robots: {{kind: {{kind: mjcf, file: robot.xml}}, actuators: {{{}}}, positions: [[3, 0], [-3, 0]]}}
controller: {{gains: auto}}
"""


def test_motors_of_a_file_lag_and_have_errors_of_their_gains(tmp_path: Path, compiled: None) -> None:
    (tmp_path / "robot.xml").write_text(HEXAROTOR)
    (tmp_path / "team.yaml").write_text(MOTORS.format("lag: 0.05, gain_error: 0.1"))
    scenario = load_file(tmp_path / "team.yaml")
    model = build(scenario).model
    assert (model.actuator_dynprm[:, 0] == 0.05).all() and model.na == 12
    off = model.actuator_gainprm[:, 0] - 1.0
    assert 0.03 < np.abs(off).max() <= 0.1 and len(set(off)) == 12
    np.testing.assert_allclose(model.key_act[0], 1.5 * 9.81 / 6, rtol=1e-9)
    run = fly(scenario)
    assert run.passed, run.message
    assert np.ptp(run.trace["qpos"].values[:, 2]) < 0.15, "rotors turn from the start"


def test_motors_of_a_file_have_dead_zones(tmp_path: Path, compiled: None) -> None:
    (tmp_path / "robot.xml").write_text(TORQUES)
    (tmp_path / "team.yaml").write_text(MOTORS.format("dead_zone: 1.4"))
    run = fly(load_file(tmp_path / "team.yaml"))
    assert run.passed, run.message
    pushed = np.linalg.norm(run.trace["drive_force"].values, axis=2)
    most = 2.0 * (1.5 - 1.4) / 0.06  # along the robot, and as much across at a point half the track ahead
    assert 0.5 * most < pushed.max() < np.hypot(most, most) + 1e-9


def test_what_is_left_of_robots_that_fail(team: Path, compiled: None) -> None:
    """Dead wheels come to rest, and a servo that is stuck keeps its place."""
    failures = [{"robot": 2, "at": 2}, {"robot": 3, "at": 2, "kind": "stuck"}]
    run = fly(load_file(team, {"duration": 5, "robots.failures": failures, "obstacles": []}))
    assert run.passed, run.message
    speed = np.linalg.norm(run.trace["v"].values[-1], axis=1)
    assert speed[1] < 0.02 and speed[2] < 0.01 < speed[0]


def test_a_run_folder_holds_its_robots(team: Path, tmp_path: Path) -> None:
    skin = '<asset><mesh name="skin" file="skin.obj"/></asset>'
    (tmp_path / "skin.obj").write_text(meshes.obj(0.1))
    drawn = TORQUES.replace(
        '<geom class="part"', '<geom type="mesh" mesh="skin" mass="0"/><geom class="part"'
    )
    (tmp_path / "rover.xml").write_text(drawn.replace("<worldbody>", f"{skin}<worldbody>"))
    scenario = load_file(team)
    with RunFolder.create(tmp_path / "run") as folder:
        begin_folder(folder, scenario, build(scenario))
        folder.fail("only begun")
    moved = shutil.move(tmp_path / "run", tmp_path / "moved")
    for file in tmp_path.glob("*.[xo][mb][lj]"):
        file.unlink()
    again = stored_scenario((moved / "resolved.yaml").read_text(), moved / "resolved.yaml")
    assert build(again).xml == build(scenario).xml
    assert mujoco.MjModel.from_xml_path(str(moved / "model.xml")).nmesh == 1
