"""Wrong robots: kinds that do not fit their bodies, their motors, their gravity or one another."""

import pytest

from escort_mj.errors import ScenarioError
from escort_mj.scenario import parse_scenario

# What is wrong, the scenario, the place and key, and words of the message.
WRONG = [
    ("no such kind", "robots: {kind: slang}", "1:16: robots.kind: ", 'did you mean "slung"?'),
    ("a list of kinds", "robots: {kind: {kind: [mjcf]}}", "1:23: robots.kind.kind: ", 'did you mean "mjcf"?'),
    ("a table without its kind", "robots: {kind: {payload: 1}}", "1:16: robots.kind.kind: ", "is missing"),
    (
        "a key of another kind",
        "robots: {kind: {kind: slung, offset: 1}}",
        "1:30: robots.kind.offset: ",
        "not a key of slung",
    ),
    (
        "a wrong key of one robot's kind",
        "robots: {overrides: [{robot: 1, kind: {kind: quadrotor, arms: 3}}]}",
        "1:57: robots.overrides[0].kind.arms: ",
        'did you mean "arm"?',
    ),
    ("no load", "robots: {kind: {kind: loaded, load: 0}}", "1:37: robots.kind.load: ", "at least 1e-06"),
    (
        "the load outside",
        "robots: {kind: {kind: loaded, offset: 0.3}}",
        "1:16: robots.kind: ",
        "a load 0.3 m off the center of a ball of radius 0.2 m",
    ),
    (
        "a ball too small for its load",
        "robots: {kind: loaded, overrides: [{robot: 2, radius: 0.05}]}",
        "1:55: robots.overrides[0].radius: ",
        "a load 0.1 m off",
    ),
    ("a load in space", "axes: 3\nrobots: {kind: loaded}", "2:16: robots.kind: ", "rolls on a floor: axes 2"),
    (
        "a payload in four axes",
        "axes: 4\nrobots: {kind: slung}",
        "2:16: robots.kind: ",
        "slung in 4 axes; expected axes 2 to 3",
    ),
    (
        "a differential drive in space",
        "axes: 3\nrobots: {kind: diff_drive}",
        "2:16: robots.kind: ",
        "found diff_drive in 3 axes; it rolls on a floor: axes 2",
    ),
    (
        "a chassis beyond the hull",
        "robots: {kind: {kind: diff_drive, track: 0.3}}",
        "1:16: robots.kind: ",
        "a body that reaches 0.26 m from its hand point in a hull of radius 0.2 m",
    ),
    (
        "wheels beyond the casters",
        "robots: {kind: {kind: diff_drive, wheel_radius: 0.09}}",
        "1:16: robots.kind: ",
        "wheels of radius 0.09 m at a track of 0.16 m",
    ),
    (
        "wheels that weigh all",
        "robots: {kind: {kind: diff_drive, wheel_share: 0.5}}",
        "1:48: robots.kind.wheel_share: ",
        "at most 0.4",
    ),
    (
        "a vessel in the air",
        "axes: 3\nrobots: {kind: surface_vessel}",
        "2:16: robots.kind: ",
        "found surface_vessel in 3 axes; expected axes 2",
    ),
    (
        "a vessel longer than its hull",
        "robots: {radius: 1, kind: {kind: surface_vessel, length: 1.255}}",
        "1:27: robots.kind: ",
        "a stern 1.17",
    ),
    (
        "water that pushes",
        "robots: {kind: {kind: surface_vessel, added_mass: [1, 1, 1, 2]}}",
        "1:16: robots.kind: ",
        "not positive definite; no water has such",
    ),
    (
        "a hand point that is the center",
        "robots: {kind: {kind: surface_vessel, hand_point: 0.01, center_of_gravity: 0.02}}",
        "1:16: robots.kind: ",
        "expected the hand point ahead of it",
    ),
    (
        "damping of two coefficients",
        "robots: {kind: {kind: surface_vessel, surge_damping: [1, 2]}}",
        "1:54: robots.kind.surge_damping: ",
        "at least 3 items",
    ),
    (
        "one ball in space",
        "axes: 3\nrobots: {overrides: [{robot: 2, kind: rolling_sphere}]}",
        "2:39: robots.overrides[0].kind: ",
        "found rolling_sphere in 3 axes",
    ),
    (
        "no damping of air",
        "robots: {kind: {kind: slung, damping: -1}}",
        "1:39: robots.kind.damping: ",
        "at least 0",
    ),
    (
        "arms beyond the hull",
        "robots: {kind: {kind: quadrotor, arm: 0.5}}",
        "1:16: robots.kind: ",
        "arms of 0.5 m in a hull of radius 0.2 m",
    ),
    (
        "two moments",
        "robots: {kind: {kind: quadrotor, inertia: [1, 2]}}",
        "1:43: robots.kind.inertia: ",
        "at least 3 items",
    ),
    (
        "no such body",
        "robots: {kind: {kind: quadrotor, inertia: [1, 1, 3]}}",
        "1:16: robots.kind: ",
        "no body has such",
    ),
    (
        "too weak to hover",
        "robots: {kind: {kind: quadrotor, thrust_to_weight: 0.9}}",
        "1:52: robots.kind.thrust_to_weight: ",
        "more than 1",
    ),
    (
        "hovering in no gravity",
        "physics: {gravity: [0, 0, 0]}\nrobots: {kind: quadrotor, count: 3}",
        "1:20: physics.gravity: ",
        "robot 1 is a quadrotor, which hovers against gravity",
    ),
    (
        "hovering against gravity aslant",
        "physics: {gravity: [1, 0, -9]}\nrobots: {overrides: [{robot: 3, kind: quadrotor}]}",
        "1:20: physics.gravity: ",
        "robot 3 is a quadrotor",
    ),
    (
        "rolling below flying",
        "robots: {kind: rolling_sphere, overrides: [{robot: 3, kind: quadrotor}]}",
        "1:61: robots.overrides[0].kind: ",
        "robot 3, a quadrotor, is at least 0.7 m above the floor, and robot 1, a rolling_sphere,",
    ),
    (
        "heavier than its motors",
        "axes: 3\nrobots: {kind: slung}",
        "2:16: robots.force_limit: ",
        "robot 1, a slung, weighs 12.8 N and has motors of 10 N",
    ),
    (
        "gains for another kind",
        "robots: {kind: quadrotor, actuators: {gains: [1, 1]}}",
        "1:46: robots.actuators.gains: ",
        "found 2 gains; expected 4, one for each motor of a quadrotor",
    ),
    (
        "gains drawn and given",
        "robots: {actuators: {gains: [1, 1.1], gain_error: 0.1}}",
        "1:29: robots.actuators.gains: ",
        "give one of them",
    ),
    (
        "gains of one robot",
        "robots: {overrides: [{robot: 1, actuators: {gains: [1]}}]}",
        "1:52: robots.overrides[0].actuators.gains: ",
        "found 1 gains; expected 2, one for each motor of a point_mass",
    ),
    (
        "velocities of two robots",
        "robots: {count: 3, velocities: [[0, 1], [1, 0]]}",
        "1:32: robots.velocities: ",
        "found 2 velocities; expected 3",
    ),
    (
        "a velocity in space",
        "robots: {count: 1, velocities: [[0, 1, 2]]}",
        "1:33: robots.velocities[0]: ",
        "found 3 numbers; expected 2",
    ),
    ("no gain", "robots: {actuators: {gain_error: 1}}", "1:34: robots.actuators.gain_error: ", "less than 1"),
    ("lag", "robots: {actuators: {lag: -0.1}}", "1:27: robots.actuators.lag: ", "at least 0"),
    ("dead zone", "robots: {actuators: {dead_zone: x}}", "1:33: robots.actuators.dead_zone: ", "a number"),
]


@pytest.mark.parametrize(
    ("text", "place", "words"), [wrong[1:] for wrong in WRONG], ids=[w[0] for w in WRONG]
)
def test_wrong_robots(text: str, place: str, words: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        parse_scenario(text, "s")
    (fault,) = caught.value.faults
    message = str(fault).removeprefix("s:")
    assert message.startswith(place), message
    assert words in message
