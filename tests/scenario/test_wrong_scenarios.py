"""Wrong scenarios of every kind: one fault each, named with its place, its key and what is allowed."""

import pytest

from escort_mj.errors import ScenarioError
from escort_mj.scenario import parse_scenario


def fault_of(text: str) -> str:
    """The one fault of a text, as line:column: key: message."""
    with pytest.raises(ScenarioError) as caught:
        parse_scenario(text, "s")
    (fault,) = caught.value.faults
    return str(fault).removeprefix("s:")


HOSTILE = [
    ("__import__('os').system('id')", 'found the unknown name "__import__"'),
    ("().__class__.__bases__", "expected a number"),
    ("t.__class__", 'found "."'),
    ("lambda: 1", 'found the unknown name "lambda"'),
    ("[x for x in (1,)]", 'found "["'),
    ("9**9**9", "no finite number"),
    ("t" + "+t" * 200, "401 characters"),
    ("t" + "+t" * 80, "more than 64"),
    ("(" * 95 + "t" + ")" * 95, "levels of nesting"),
    ("exec(t)", 'did you mean "exp"?'),
    ("log(t)", "no finite value at t = 0 s"),
    ("sqrt(t)", "no finite time derivative at t = 0 s"),
    ("1/(t - 15)", "no finite value at t = 15 s"),
    ("exp(t)", "the value 1e+06 at t = 13.8"),
]


@pytest.mark.parametrize(("expression", "words"), HOSTILE)
def test_hostile_expressions(expression: str, words: str):
    fault = fault_of(f'duration: 30\ntarget:\n  position: [0, "{expression}"]\n')
    assert fault.startswith("3:17: target.position[1]: ")
    assert words in fault


# What is wrong, the scenario, the place and key, and words of the message.
WRONG = [
    ("unknown key", "robots:\n  cuont: 3\n", "2:3: robots.cuont: ", 'did you mean "count"?'),
    ("unknown section", "robotos: {}\n", "1:1: robotos: ", 'did you mean "robots"?'),
    ("wrong type", "duration: soon\n", "1:11: duration: ", 'found "soon"; expected a number'),
    ("quoted number", 'duration: "30"\n', "1:11: duration: ", 'found "30"; expected a number'),
    (
        "boolean for a number",
        "robots: {mass: true}\n",
        "1:16: robots.mass: ",
        "found true; expected a number",
    ),
    (
        "fraction for a count",
        "robots: {count: 2.5}\n",
        "1:17: robots.count: ",
        "found 2.5; expected a whole number",
    ),
    ("huge count", "robots: {count: 1000000000}\n", "1:17: robots.count: ", "at most 5000"),
    (
        "huger count",
        "robots: {count: " + "9" * 6000 + "}\n",
        "1:17: robots.count: ",
        "expected a whole number",
    ),
    ("zero count", "robots: {count: 0}\n", "1:17: robots.count: ", "at least 1"),
    (
        "wrong count",
        "robots:\n  count: 3\n  positions: [[9, 0]]\n",
        "3:14: robots.positions: ",
        "found 1 positions",
    ),
    ("beyond float", "robots: {positions: [[1e999, 0]]}", "1:23: robots.positions[0][0]: ", "found infinity"),
    (
        "NaN in an axis",
        "target: {position: [.nan, 0]}\n",
        "1:21: target.position[0]: ",
        "expected a finite number",
    ),
    (
        "boolean in an axis",
        "target: {position: [0, yes]}",
        "1:24: target.position[1]: ",
        'unknown name "yes"',
    ),
    ("negative mass", "robots: {mass: -1}\n", "1:16: robots.mass: ", "found -1; expected at least"),
    (
        "zero radius",
        "obstacles: [{position: [9, 9], radius: 0}]",
        "1:40: obstacles[0].radius: ",
        "at least 0.001",
    ),
    (
        "overlapping robots",
        "robots: {positions: [[9, 0], [9, 0.1]]}\n",
        "1:30: robots.positions[1]: ",
        "by 0.3 m",
    ),
    (
        "robot inside an obstacle",
        "robots: {positions: [[9, 0], [-9, 0]]}\nobstacles: [{position: [-9, 0.3], name: rock}]\n",
        "1:30: robots.positions[1]: ",
        "robot 2 overlaps rock by 0.4 m at the start",
    ),
    (
        "robot in the target",
        "robots: {positions: [[0, 0], [9, 0]]}\n",
        "1:22: robots.positions[0]: ",
        "the target",
    ),
    (
        "obstacle in the target",
        "obstacles: [{position: [0, 0.5]}]\n",
        "1:24: obstacles[0].position: ",
        "overlaps the target",
    ),
    ("dropout 1", "sensing: {velocity: {dropout: 1}}\n", "1:31: sensing.velocity.dropout: ", "less than 1"),
    ("negative noise", "sensing: {position: {noise: -1}}\n", "1:29: sensing.position.noise: ", "at least 0"),
    (
        "negative delay",
        "sensing: {position: {delay: -0.1}}\n",
        "1:29: sensing.position.delay: ",
        "at least 0",
    ),
    (
        "half a step's delay",
        "sensing: {position: {delay: 0.003}}\n",
        "1:29: sensing.position.delay: ",
        "found 0.003 s, 1.5 steps of 0.002 s; expected a whole number of steps, as with 0.002 or 0.004 s",
    ),
    (
        "a delay as long as the run",
        "duration: 5\nsensing: {target_position: {delay: 5}}\n",
        "2:36: sensing.target_position.delay: ",
        "the run ends at 5 s",
    ),
    (
        "a delay beyond memory",
        "duration: 10000\nsensing: {velocity: {delay: 5000}}\n",
        "2:29: sensing.velocity.delay: ",
        "2.5e+06 steps to remember",
    ),
    (
        "a bias of too many axes",
        "sensing: {position: {bias: [0, 0, 1]}}\n",
        "1:28: sensing.position.bias: ",
        "found 3 numbers; expected 2",
    ),
    (
        "a negative radius",
        "sensing: {position: {bias: -1}}\n",
        "1:28: sensing.position.bias: ",
        "from 0 to 1e6",
    ),
    ("a bias in words", "sensing: {position: {bias: a}}\n", "1:28: sensing.position.bias: ", 'found "a"'),
    (
        "no resolution",
        "sensing: {position: {resolution: 0}}\n",
        "1:34: sensing.position.resolution: ",
        "1e-09",
    ),
    (
        "too short a sight",
        "sensing: {radius: {obstacles: 1.5}}\n",
        "1:31: sensing.radius.obstacles: ",
        "less than the safe distance of mission.behaviors[0]; expected at least 2 m",
    ),
    (
        "too short a sight of each other",
        "sensing: {radius: {robots: 1.5}}\n",
        "1:28: sensing.radius.robots: ",
        "expected at least 2 m",
    ),
    (
        "noise where it was",
        "uncertainty: {noise: {position: 1}}\n",
        "1:15: uncertainty.noise: ",
        "is not a key",
    ),
    ("RK4", "physics: {integrator: RK4}\n", "1:23: physics.integrator: ", "four times a step"),
    ("capitals", "physics: {solver: CG}\n", "1:19: physics.solver: ", 'did you mean "cg"?'),
    ("empty file", "", "1:1: ", "found nothing; a scenario is a table of keys"),
    ("only a comment", "# soon\n", "1:1: ", "found nothing"),
    ("a list", "- duration: 3\n", "1:1: ", "found a list of 1"),
    ("a sentence", "run the mission, please\n", "1:1: ", 'found "run the mission, please"'),
    ("not YAML", "duration: [1\nname: x\n", "2:5: ", "this is not YAML"),
    ("tab", "robots:\n\tcount: 3\n", "2:1: ", "this is not YAML"),
    ("control character", "name: a\x07b\n", "1:8: ", "this is not YAML"),
    ("two documents", "duration: 3\n---\nduration: 4\n", "2:1: ", "found a second document"),
    ("duplicate key", "seed: 1\nname: x\nseed: 2\n", "3:1: seed: ", 'found the key "seed" twice'),
    ("key is a number", "name: x\n3: 4\n", "2:1: 3: ", "is not a key"),
    ("key is a list", "name: x\n[1]: 4\n", "2:1: ", "found a key that is not a plain word"),
    ("python tag", "name: !!python/object/apply:os.system [id]\n", "1:7: name: ", "tags are not allowed"),
    ("set tag", "name: !!set {x}\n", "1:7: name: ", 'found the tag "!!set"'),
    (
        "alias bomb",
        "a: &a [x, x]\n"
        + "".join(f"{b}: &{b} [*{a}, *{a}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)),
        "1:4: a: ",
        "found the anchor &a",
    ),
    ("alias to itself", "robots: &a {count: *a}\n", "1:9: robots: ", "anchor"),
    ("deep nesting", "name: " + "[" * 5000 + "]" * 5000, "1:19: name[0]", "levels of nesting"),
    (
        "empty section",
        "name: x\nrobots:\n",
        "2:1: robots: ",
        "found nothing (null); expected a table of keys",
    ),
    (
        "unknown law",
        "controller: lqr\n",
        "1:13: controller: ",
        "allowed are apd_smc, asmc, ",
    ),
    (
        "gain of another baseline",
        "controller: {law: computed_torque, proportional_gain: 3}",
        "1:36: controller.proportional_gain: ",
        "is not a key of computed_torque; allowed are slope, anti_windup",
    ),
    (
        "a filter from the future",
        "controller: {law: computed_torque, acceleration_filter: -1}",
        "1:57",
        "at least 0",
    ),
    ("unknown law in a table", "controller: {law: amsc}\n", "1:19: controller.law: ", 'did you mean "asmc"?'),
    (
        "unknown gain",
        "controller: {kp: 3}\n",
        "1:14: controller.kp: ",
        "is not a key of apd_smc; allowed are",
    ),
    (
        "gain of another law",
        "controller: {law: asmc, derivative_gain: 3}",
        "1:25: controller.derivative_gain: ",
        "asmc",
    ),
    (
        "wrong dimension",
        "axes: 3\ntarget: {position: [0, 0]}\n",
        "2:20: target.position: ",
        "found 2 numbers; expected 3",
    ),
    ("a line", "axes: 1\n", "1:7: axes: ", "found 1; expected at least 2"),
    ("too many axes", "axes: 10\n", "1:7: axes: ", "found 10; expected at most 9"),
    ("half an axis", "axes: 3.5\n", "1:7: axes: ", "found 3.5; expected a whole number"),
    ("rolling in four axes", "axes: 4\nrobots: {kind: rolling_sphere}\n", "2:16: robots.kind: ", "rolls on"),
    (
        "gravity in five axes",
        "axes: 5\nphysics: {gravity: [0, 0, -9.81]}\n",
        "2:20: physics.gravity: ",
        "gravity pulls along x, y, z only",
    ),
    (
        "three numbers in four axes",
        "axes: 4\nobstacles: [{position: [1, 2, 3]}]\n",
        "2:24: obstacles[0].position: ",
        "found 3 numbers; expected 4",
    ),
    (
        "a shadow's name",
        "obstacles: [{position: [30, 30], name: rock_shadow_1}]\n",
        "1:40: obstacles[0].name: ",
        "robots, target and world have theirs",
    ),
    (
        "rolling in space",
        "axes: 3\nrobots: {kind: rolling_sphere}\n",
        "2:16: robots.kind: ",
        "rolls on a floor",
    ),
    ("gravity", "physics: {gravity: [0, -9.81]}\n", "1:20: physics.gravity: ", "at least 3 items"),
    (
        "no such robot",
        "robots: {overrides: [{robot: 6, mass: 2}]}",
        "1:30: robots.overrides[0].robot: ",
        "1 to 5",
    ),
    (
        "robot twice",
        "robots: {overrides: [{robot: 1}, {robot: 1}]}",
        "1:42: robots.overrides[1].robot: ",
        "again",
    ),
    (
        "which robot",
        "robots: {overrides: [{mass: 2}]}",
        "1:22: robots.overrides[0].robot: ",
        "is missing: number of the robot, from 1",
    ),
    (
        "no room",
        "robots: {count: 40, placement: {within: 2}}",
        "1:32: robots.placement: ",
        "found no free place",
    ),
    ("bad name", "name: ../../etc\n", "1:7: name: ", "not beginning with a dot"),
    ("surrogate", 'name: "\\ud800"\n', "1:7: name: ", "U+D800"),
    (
        "wrong version",
        "version: 2\nrobot_count: 3\n",
        "1:10: version: ",
        "found 2; this program reads version 1",
    ),
    ("odd video", "video: {width: 641}\n", "1:16: video.width: ", "a multiple of 2"),
    (
        "rate that does not divide",
        "recording: {rate: 60}\n",
        "1:19: recording.rate: ",
        "as with 55.5555556 or 62.5",
    ),
    ("timestep that does not divide", "physics: {timestep: 0.003}", "1:21: recording.rate: ", "47.6190476"),
    (
        "too many steps",
        "duration: 1e6\nphysics: {timestep: 1e-4}\nrecording: {rate: 1}",
        "1:11: duration: ",
        "10000 s",
    ),
    ("trace too large", "robots: {count: 60}\nduration: 1e5\n", "2:11: recording.rate: ", "GiB"),
    ("no bound", "expect: [{metric: contacts}]\n", "1:10: expect[0]: ", "give at_most or at_least"),
    (
        "impossible bounds",
        "expect: [{metric: contacts, at_most: 1, at_least: 2}]",
        "1:10: expect[0]: ",
        "no value",
    ),
    ("unknown metric", "expect: [{metric: contact, at_most: 0}]", "1:19: expect[0].metric: ", '"contacts"?'),
    (
        "empty window",
        "expect: [{metric: contacts, at_most: 0, after: 9, before: 8}]",
        "1:10: expect[0]: ",
        "is empty",
    ),
    (
        "late window",
        "expect: [{metric: contacts, at_most: 0, after: 30}]",
        "1:48: expect[0].after: ",
        "ends at 30 s",
    ),
    (
        "long window",
        "expect: [{metric: contacts, at_most: 0, before: 31}]",
        "1:49: expect[0].before: ",
        "ends at 30",
    ),
    (
        "balls of unlike size",
        "robots: {kind: rolling_sphere, overrides: [{robot: 2, radius: 0.5}]}\n",
        "1:63: robots.overrides[0].radius: ",
        "robot 2, a rolling_sphere, is at least 0.5 m above the floor, and robot 1",
    ),
    (
        "obstacle names",
        "obstacles: [{position: [9, 9], name: a}, {position: [-9, 9], name: a}]",
        "1:68: obst",
        "again",
    ),
    (
        "position and waypoints",
        "target: {position: [0, 0], waypoints: [{time: 0, position: [0, 0]}]}",
        "1:9: tar",
        "both",
    ),
    (
        "waypoints out of order",
        "target:\n  waypoints:\n    - {time: 1, position: [0, 0]}\n    - {time: 1, position: [1, 0]}\n",
        "4:14: target.waypoints[1].time: ",
        "in order of time",
    ),
    ("no waypoints", "target: {waypoints: []}\n", "1:21: target.waypoints: ", "at least 1"),
]


@pytest.mark.parametrize(
    ("text", "start", "words"), [case[1:] for case in WRONG], ids=[case[0] for case in WRONG]
)
def test_wrong_scenario(text: str, start: str, words: str):
    fault = fault_of(text)
    assert fault.startswith(start)
    assert words in fault
    assert "pydantic" not in fault
    assert "Error" not in fault
