"""Robots that are more than their hulls: what they touch, how near they come, how fast their points are."""

import json

import mujoco
import numpy as np
import pytest

from escort_mj import mission
from escort_mj.errors import PluginError, ScenarioError
from escort_mj.robots.modeled import Source
from escort_mj.scenario import load_file
from escort_mj.scenario.reader.load import parse_scenario
from escort_mj.world.model.build import build
from escort_mj.world.model.robot.reading import read_model

SLIDER = (
    '<mujoco><worldbody><body name="base" pos="0 0 {height}">'
    '<joint name="x" type="slide" axis="1 0 0"/><joint name="y" type="slide" axis="0 1 0"/>'
    '<geom name="hub" type="sphere" size="0.2" mass="1" {more}/>{limb}</body></worldbody>'
    '<actuator><motor joint="x" ctrlrange="-20 20"/><motor joint="y" ctrlrange="-20 20"/>{servo}</actuator>'
    "{key}</mujoco>"
)
TELESCOPE = (
    '<body name="arm"><joint type="slide" axis="1 0 0" range="0 1.5" springref="1.2" stiffness="3" '
    'damping="1"/><geom name="tip" type="sphere" size="0.1" mass="0.1"/></body>'
)
BLADE = (
    '<body name="bar"><joint name="spin" type="hinge" axis="0 0 1"/>'
    '<geom type="box" size="0.5 0.01 0.05" mass="0.05"/></body>'
)
AXES = {"x": "1 0 0", "y": "0 1 0", "z": "0 0 1"}
ROCK = {"name": "rock", "position": [0, 0.1], "radius": 0.3}


def slider(height=0.2, more="", limb="", servo="", key=""):
    return SLIDER.format(height=height, more=more, limb=limb, servo=servo, key=key)


def write_limb(folder, arm="", hull='type="sphere" size="0.2"', body="", axes=AXES, more=""):
    """A plugin's kind of robots, and a mission of two of them."""
    joints = "".join(f'<joint name="{a}" type="slide" axis="{v}"/>' for a, v in axes.items())
    motors = "".join(f'<motor name="{axis}" joint="{axis}"/>' for axis in axes)
    hull = f'<geom name="body" mass="1" {hull}/>'
    whole = f'<worldbody><body name="robot" {body}>{joints}{hull}{arm}</body></worldbody>'
    (folder / "limb.py").write_text(
        "from typing import ClassVar, Literal\nfrom escort_mj.plugins import RobotKind\n\n\n"
        "class Limb(RobotKind):\n    kind: Literal['limb'] = 'limb'\n"
        f"    mjcf: ClassVar[str] = '<mujoco>{more}{whole}<actuator>{motors}</actuator></mujoco>'\n"
    )
    (folder / "limb.yaml").write_text("plugins: [limb.py]\nrobots: {count: 2, kind: limb}\n")


@pytest.fixture
def flown(tmp_path):
    """Load a mission of robots that drive from -3 to 3 along x, and fly it."""

    def fly(*robots, expect=(), run=True, **keys):
        kinds = []
        for number, robot in enumerate(robots):
            if isinstance(robot, str) and robot.startswith("<"):
                (tmp_path / f"{number}.xml").write_text(robot)
                robot = {"kind": "mjcf", "file": f"{number}.xml"}
            kinds.append(robot)
        goals = [[3, float(k)] for k in range(len(kinds))]
        scenario = {
            "duration": 6,
            "target": None,
            "robots": {
                "positions": [[-3, float(k)] for k in range(len(kinds))],
                "kind": kinds[0],
                "overrides": [{"robot": k + 1, "kind": kind} for k, kind in enumerate(kinds) if k],
            },
            "mission": {"max_speed": 1, "behaviors": [{"behavior": "goal", "goals": goals, "gain": 1}]},
            "controller": {"gains": "auto"},
            "expect": list(expect),
        }
        (tmp_path / "mission.yaml").write_text(json.dumps(scenario | keys))
        loaded = load_file(tmp_path / "mission.yaml")
        return mission.fly(loaded) if run else loaded

    return fly


def held(run):
    return {verdict.metric: verdict.held for verdict in run.verdicts}


@pytest.mark.parametrize("height", [-3.0, 0.2, 1.7])
def test_a_mission_happens_at_the_height_of_robots_that_cannot_rise(flown, height):
    expect = [{"contacts": "none"}, {"metric": "contacts", "at_most": 0}]
    run = flown(slider(height), obstacles=[ROCK], expect=expect)
    assert not any(held(run)[name] for name in ("contacts",))
    model = build(run.scenario).model
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    hub, rock = data.geom("robot_1/hub").xpos[2], data.geom("rock_body").xpos[2]
    assert hub == pytest.approx(rock) == pytest.approx(max(height, 0.2))


def test_bodies_that_would_pass_above_one_another_are_refused_with_their_heights(flown):
    with pytest.raises(
        ScenarioError, match=r"between 0\.1 and 0\.5 m .* and robot 2, a slung, .*0\.78 and 1\.18"
    ):
        flown(slider(0.3), "slung", run=False)
    small = {"name": "pebble", "position": [0, 3], "radius": 0.05}
    with pytest.raises(ScenarioError, match=r"pebble between 0\.55 and 0\.65 m|and pebble"):
        flown(slider(0.2), slider(0.9), obstacles=[small], run=False)
    assert flown(slider(0.3), "point_mass", run=False)


def test_each_pair_of_bodies_shares_heights(flown):
    """A rock that has its bottom highest of all, and meets both robots, hides nothing."""
    own = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
    low = slider(0.5).replace('"sphere" size="0.2"', '"cylinder" size="0.2 0.5"')
    high = slider(1.1, 'pos="0 0 0.38"', own).replace('"sphere" size="0.2"', '"cylinder" size="0.2 0.52"')
    rock = {"name": "rock", "position": [0, 3], "radius": 0.25}
    with pytest.raises(
        ScenarioError, match=r"between 0 and 1 m .* and robot 2, a mjcf, between 0\.96 and 2 m"
    ):
        flown(low, high, obstacles=[rock], run=False)


def test_a_touch_may_be_found_late_and_a_rail_may_stand():
    """What is refused: tests/scenario/wrong_models.yaml."""
    assert read_model(Source(text=slider(more='margin="0.3" gap="-0.3"'), name="late"))
    rail = '<body name="frame"><geom size="0.1" contype="0" conaffinity="0"/><body name="base"'
    text = slider().replace('<body name="base"', rail).replace("</worldbody>", "</body></worldbody>")
    assert read_model(Source(text=text, name="rail")).drive.base == "base"


def test_the_base_of_a_robot_may_be_a_body_within_another(flown):
    sideways = '<joint name="y" type="slide" axis="0 1 0"/>'
    within = f'<geom name="bridge" size="0.05" mass="0.1"/><body name="trolley">{sideways}'
    bridge = slider().replace(sideways, within).replace("</body></worldbody>", "</body></body></worldbody>")
    run = flown(bridge, obstacles=[ROCK], expect=[{"contacts": "none"}])
    assert not held(run)["contacts"] and run.trace["q"].values[-1, 0, 1] != 0.0


def test_what_touches_by_pairs_alone_touches_what_a_mission_has(flown):
    bumper = '<geom name="bumper" type="box" size="0.4 0.4 0.1" mass="0.1" contype="0" conaffinity="0"/>'
    ground = '<geom name="ground" type="plane" size="5 5 1"/><body name="base"'
    paired = (
        slider(limb=bumper)
        .replace('<body name="base"', ground)
        .replace("<actuator>", '<contact><pair geom1="bumper" geom2="ground"/></contact><actuator>')
    )
    beside = {**ROCK, "position": [0, 0.6]}
    assert held(flown(slider(limb=bumper), obstacles=[beside], expect=[{"contacts": "none"}]))["contacts"]
    assert not held(flown(paired, obstacles=[beside], expect=[{"contacts": "none"}]))["contacts"]


def test_touches_of_the_floor_are_not_asked_of_what_passes_through_it(flown):
    arm = '<body><joint axis="0 1 0"/><geom type="capsule" size="0.05" fromto="0 0 0 1 0 0" mass="1"/></body>'
    assert flown(slider(0.5, limb=arm), expect=[{"contacts": "none"}], run=False)
    for side in ("robots", "robot_1"):
        with pytest.raises(ScenarioError, match="floor, which robot_1 never touches"):
            flown(slider(0.5, limb=arm), expect=[{"contacts": ["floor", side]}], run=False)


@pytest.mark.parametrize(
    ("bits", "words"),
    [
        (("'0'", "'0'"), "robot 1, a odd, .*geoms that cannot touch anything"),
        (("'4'", "'4'"), "robot 1, a odd, .*cannot touch target"),
        (("'1'", "'0'"), "robot 1, a odd, .*cannot touch robot_2"),
        ((1, "'1'"), r"the kind odd: shape\(\) sets contype of a geom to 1, which is no text"),
    ],
)
def test_a_plugin_whose_hull_is_wrong_or_passes_through_bodies_is_refused(tmp_path, bits, words):
    (tmp_path / "odd.py").write_text(
        "from typing import ClassVar, Literal\nfrom escort_mj.plugins import RobotKind\n\n\n"
        "class Odd(RobotKind):\n    part: ClassVar[str] = 'point_mass'\n"
        "    kind: Literal['odd'] = 'odd'\n\n    def shape(self, parts, radius):\n"
        f"        parts['body'].set('contype', {bits[0]})\n"
        f"        parts['body'].set('conaffinity', {bits[1]})\n"
    )
    (tmp_path / "odd.yaml").write_text("plugins: [odd.py]\nrobots: {count: 2, kind: odd}\n")
    with pytest.raises((ScenarioError, PluginError), match=words):
        build(load_file(tmp_path / "odd.yaml"))


@pytest.mark.parametrize(
    ("arm", "words"),
    [
        ('contype="4" conaffinity="4"', "robot 1, a limb, has geoms that cannot touch anything"),
        ('contype="1" conaffinity="0"', "robot 1, a limb, cannot touch robot_2"),
        ('contype="0" conaffinity="1"', "robot 1, a limb, cannot touch robot_2"),
        ('margin="-0.2"', "robot 1, a limb: the geom robot_1_arm: found margin -0.2 m and gap 0 m"),
        ('gap="-0.2"', "robot 1, a limb: the geom robot_1_arm: found margin 0 m and gap -0.2 m"),
        ('gap="20"', "robot 1, a limb: the geom robot_1_arm: found a gap of 20 m"),
    ],
)
def test_a_plugin_whose_arm_alone_passes_through_bodies_is_refused(tmp_path, arm, words):
    write_limb(tmp_path, f'<geom name="arm" type="capsule" size="0.05" fromto="0 0 0 0 1 0" {arm}/>')
    with pytest.raises(ScenarioError, match=words):
        build(load_file(tmp_path / "limb.yaml"))


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"hull": 'type="capsule" size="0.2" fromto="0 -1 0 0 1 0"'}, "no sphere with the robot's radius"),
        ({"hull": 'size="0.2" pos="0 0.6 0"'}, "not at the center of the body robot"),
        ({"body": 'euler="0 0 1.57"'}, "joints x, y and z do not slide"),
        ({"axes": AXES | {"x": "-1 0 0"}}, "joints x, y and z do not slide"),
    ],
)
def test_a_plugin_whose_hull_is_not_where_its_coordinates_say_is_refused(tmp_path, keys, words):
    """Clearances were those of a sphere at its coordinates, wherever it touched something."""
    write_limb(tmp_path, **keys)
    with pytest.raises(PluginError, match=f"limb.py: the kind limb: .*{words}"):
        build(load_file(tmp_path / "limb.yaml"))


def test_more_than_a_body_and_motors_of_a_plugin_is_refused(tmp_path):
    """It was left out without a word: defaults, masks that exclude, constraints, what stands beside."""
    for more in ("<default><geom contype=\\'0\\'/></default>", "<worldbody><light/></worldbody>"):
        write_limb(tmp_path, more=more)
        with pytest.raises(PluginError, match=r"found <(default|light)>; a mission takes the body robot"):
            build(load_file(tmp_path / "limb.yaml"))


def test_a_plugin_whose_hull_grows_is_refused(tmp_path):
    write_limb(tmp_path)
    with (tmp_path / "limb.py").open("a") as file:
        file.write("\n    def shape(self, parts, radius):\n        parts['body'].set('size', '0.4')\n")
    with pytest.raises(PluginError, match="no sphere with the robot's radius, which is 0.2 m"):
        build(load_file(tmp_path / "limb.yaml"))


def test_clearance_is_that_of_an_arm_that_leaves_the_hull(flown):
    block = {"name": "block", "shape": "box", "position": [3.1, 0], "size": [0.3, 0.3, 1]}
    goal = {"max_speed": 1, "behaviors": [{"behavior": "goal", "goals": [[2, 0]], "gain": 1}]}
    expect = [
        {"clearance": ["robots", "obstacles"], "at_least": 0.5},
        {"metric": "obstacle_clearance_min", "at_least": 0.5},
        {"clearance": ["robots", "block"], "at_least": 0.5},
    ]
    run = flown(slider(limb=TELESCOPE), obstacles=[block], mission=goal, expect=expect)
    values = [verdict.value for verdict in run.verdicts[1:]]
    assert values == [pytest.approx(-0.003, abs=0.002)] * 3 and len(set(values)) == 1
    assert not any(verdict.held for verdict in run.verdicts[1:])
    assert all(verdict.message.endswith("by geoms") for verdict in run.verdicts[1:])


def test_clearance_is_that_of_a_payload_that_collides(flown):
    tower = {"name": "tower", "shape": "box", "position": [0, 0.3], "size": [0.1, 0.1, 0.5]}
    expect = [{"clearance": ["robots", "obstacles"], "at_least": 0.05}]
    swinging = {"kind": "slung", "payload_collides": True}
    run = flown(swinging, obstacles=[tower], expect=expect, controller={})
    touched = run.trace["episode_start"].values
    assert len(touched) and not run.verdicts[-1].held and run.verdicts[-1].value < 0.0
    sample = int(np.searchsorted(run.trace["time"].values, touched[0]))
    assert run.trace["clearance"].values[sample, 0, 2] < 0.0


def test_beyond_what_is_asked_for_the_sphere_around_a_robot_stands_for_it(flown):
    far = {"name": "far", "position": [0, 9], "radius": 0.5}
    run = flown(slider(), obstacles=[far], expect=[{"clearance": ["robots", "far"], "at_least": 0.5}])
    assert run.verdicts[-1].value == pytest.approx(9 - 0.5 - 0.2, abs=1e-4)
    assert run.verdicts[-1].value <= 8.3
    assert run.verdicts[-1].message.endswith("at least, by the spheres around robots")


@pytest.mark.parametrize("more", ['margin="0.6"', 'gap="0.6"', 'margin="0.3" gap="0.3"'])
def test_a_force_is_a_touch_and_so_are_surfaces_that_meet(flown, more):
    block = {"name": "block", "shape": "box", "position": [0.5, 0], "size": [0.3, 0.3, 1]}
    run = flown(slider(more=more), obstacles=[block], expect=[{"contacts": "none"}])
    force = run.trace["episode_peak_force"].values
    least = run.trace["clearance"].values.min()
    assert not run.verdicts[-1].held and len(force) and (force.max() > 50.0 or least < 0.0)


def test_tunneling_counts_the_tip_of_what_turns(flown):
    key = '<keyframe><key qpos="0 0 0" ctrl="0 0 1570"/></keyframe>'
    servo = '<velocity joint="spin" kv="0.05" ctrlrange="0 2000"/>'
    pole = {
        "name": "pole",
        "shape": "cylinder",
        "size": [0.02],
        "motion": {"position": ["1.5 - 0.6*t", 0.25]},
    }
    still = {"max_speed": 1, "behaviors": [{"behavior": "goal", "goals": [[0, 0]], "gain": 1}]}
    run = flown(
        slider(1.0, limb=BLADE, servo=servo, key=key), obstacles=[pole], mission=still, duration=4,
        robots={"positions": [[0, 0]], "kind": {"kind": "mjcf", "file": "0.xml"}},
        expect=[{"sanity": ["tunneling"]}, {"sanity": ["energy"]}],
    )  # fmt: skip
    tunneling, energy = run.verdicts[1:]
    reach = np.hypot(0.5, np.hypot(0.01, 0.05))
    assert tunneling.value == pytest.approx(1570 * reach * 0.002 / 0.02, rel=0.02) and not tunneling.held
    assert energy.held and energy.value + energy.margin >= 0.0


def test_a_robot_that_is_its_hull_records_nothing_more():
    world = build(parse_scenario("robots: {count: 2}"))
    assert world.shapes[:2] == ("sphere", "sphere") and "several" not in world.sizes
