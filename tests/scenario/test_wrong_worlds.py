"""Wrong obstacles, walls, clutter and surroundings: each fault named with its place and what is allowed."""

import pytest

from tests.scenario.test_wrong_scenarios import fault_of

BOX = "obstacles:\n- {shape: box, "
WRONG = [
    ("no position", "obstacles: [{radius: 1}]\n", "obstacles[0].position: ", "is missing"),
    (
        "size of a sphere",
        "obstacles: [{position: [9, 9], size: [1]}]\n",
        "obstacles[0].size: ",
        "expected radius",
    ),
    ("radius of a box", BOX + "position: [9, 9], radius: 1}\n", "obstacles[0].radius: ", "expected size"),
    ("no size", BOX + "position: [9, 9]}\n", "obstacles[0].size: ", "is missing: size of a box"),
    ("sizes of a box", BOX + "position: [9, 9], size: [1]}\n", "obstacles[0].size: ", "a box has 2 or 3"),
    (
        "size of a capsule",
        "obstacles: [{shape: capsule, position: [9, 9], size: [1]}]\n",
        "obstacles[0].size: ",
        "a capsule has 2",
    ),
    (
        "a flat mesh",
        "obstacles: [{shape: mesh, position: [9, 9], vertices: [[0, 0], [1, 1], [2, 2]]}]\n",
        "obstacles[0].vertices: ",
        "span no body",
    ),
    (
        "corners of three axes",
        "obstacles: [{shape: mesh, position: [9, 9], vertices: [[0, 0], [1, 1], [2, 2, 0]]}]\n",
        "obstacles[0].vertices[2]: ",
        "found 3 numbers; expected 2",
    ),
    (
        "orientation",
        BOX + "position: [9, 9], size: [1, 1], orientation: [1, 2]}\n",
        "orientation: ",
        "quaternion",
    ),
    (
        "null turn",
        BOX + "position: [9, 9], size: [1, 1], orientation: [0, 0, 0, 0]}\n",
        "orientation: ",
        "not zero",
    ),
    (
        "color",
        "obstacles: [{position: [9, 9], color: grey}]\n",
        "obstacles[0].color: ",
        'did you mean "gray"?',
    ),
    (
        "position and motion",
        "obstacles: [{position: [9, 9], motion: {position: [9, t]}}]\n",
        "obstacles[0].position: ",
        "both position and motion",
    ),
    ("empty motion", "obstacles: [{motion: {}}]\n", "obstacles[0].motion: ", "says nothing"),
    (
        "undefined motion",
        'obstacles: [{motion: {position: [9, "1/t"]}}]\n',
        "motion.position[1]: ",
        "finite value",
    ),
    (
        "drive without motion",
        "obstacles: [{position: [9, 9], body: {}}]\n",
        "obstacles[0].body: ",
        "moves nothing",
    ),
    (
        "drive beyond its timestep",
        "target: {body: {gain: 900}}\n",
        "target.body.gain: ",
        "expected at most 500",
    ),
    (
        "shapes in four axes",
        "axes: 4\nobstacles: [{shape: box, position: [9, 9, 9, 9], size: [1, 1, 1]}]\n",
        "obstacles[0].shape: ",
        "only spheres",
    ),
    (
        "walls in four axes",
        "axes: 4\nwalls: [{points: [[0, 9, 0, 0], [9, 9, 0, 0]]}]\n",
        "walls[0]: ",
        "only spheres",
    ),
    ("body in four axes", "axes: 4\ntarget: {body: {}}\n", "target.body: ", "expected 2 or 3"),
    (
        "twin names",
        "obstacles: [{position: [9, 9], name: a}, {position: [9, 0], name: a}]\n",
        "name: ",
        "found a again",
    ),
    (
        "a wall's name",
        "obstacles: [{position: [9, 9], name: wall_1}]\nwalls: [{points: [[0, 14], [9, 14]]}]\n",
        "walls[0].name: ",
        "found wall_1 again",
    ),
    (
        "a wall that goes nowhere",
        "walls: [{points: [[9, 9], [9, 9]]}]\n",
        "walls[0].points[1]: ",
        "point before it",
    ),
    (
        "a wall that turns back",
        "walls: [{points: [[9, 9], [19, 9], [9, 9.1]]}]\n",
        "points[1]: ",
        "turns by 179",
    ),
    (
        "a low wall",
        "walls: [{points: [[9, 9], [19, 9]], height: 0.1}]\n",
        "walls[0].height: ",
        "below the robots",
    ),
    (
        "a tight corridor",
        "walls: [{points: [[9, 9], [12, 9], [12, 12]], corridor: 7}]\n",
        "walls[0].corridor: ",
        "longer stretches",
    ),
    (
        "a door beyond the wall",
        "walls: [{points: [[9, 9], [19, 9]], doors: [{at: 9.5, width: 2}]}]\n",
        "walls[0].doors[0]: ",
        "expected within 0 to 10 m",
    ),
    (
        "doors in one another",
        "walls: [{points: [[9, 9], [19, 9]], doors: [{at: 4, width: 2}, {at: 5, width: 2}]}]\n",
        "walls[0].doors[1]: ",
        "overlaps doors[0]",
    ),
    (
        "a window in the plane",
        "walls: [{points: [[9, 9], [19, 9]], doors: [{at: 4, width: 2, sill: 0.5}]}]\n",
        "walls[0].doors[0].sill: ",
        "axes 3",
    ),
    (
        "a door higher than its wall",
        "axes: 3\nwalls: [{points: [[9, 9, 0], [19, 9, 0]], doors: [{at: 4, width: 2, height: 3}]}]\n",
        "walls[0].doors[0]: ",
        "the wall has 1 m",
    ),
    (
        "a sloping foot",
        "axes: 3\nwalls: [{points: [[9, 9, 0], [19, 9, 1]]}]\n",
        "walls[0].points: ",
        "same z",
    ),
    (
        "a box of no size",
        "clutter: {count: 3, low: [5, 5], high: [5, 9]}\n",
        "clutter.high: ",
        "more than low",
    ),
    (
        "radii the wrong way around",
        "clutter: {count: 3, low: [5, 5], high: [15, 15], least_radius: 2}\n",
        "least_radius",
        "at least least_radius, 2 m",
    ),
    (
        "a passage too narrow",
        "clutter: {count: 3, low: [5, 5], high: [15, 15], passage: 0.3}\n",
        "clutter.passage: ",
        "more than a robot's diameter, 0.4 m",
    ),
    (
        "no room",
        "clutter: {count: 300, low: [5, 5], high: [9, 9]}\n",
        "clutter: ",
        "found no place for obstacle",
    ),
    ("a slope in space", "axes: 3\nenvironment: {slope: {angle: 0.1}}\n", "slope.angle: ", "takes axes 2"),
    ("a cliff", "environment: {slope: {angle: 1.5}}\n", "environment.slope.angle: ", "at most 1.047"),
    ("wind in a vacuum", "environment: {medium: {wind: [1, 0]}}\n", "medium.wind: ", "no force"),
    (
        "a robot in a wall",
        "robots: {positions: [[5, 0], [-5, 0]]}\nwalls: [{points: [[5, -3], [5, 3]]}]\n",
        "robots.positions[0]: ",
        "robot 1 overlaps wall_1 by 0.3 m",
    ),
    (
        "the target in a wall",
        "robots: {positions: [[5, 0], [-5, 0]]}\nwalls: [{points: [[-3, 0.3], [3, 0.3]]}]\n",
        "walls[0]",
        "wall_1 overlaps the target by 0.1 m",
    ),
]


@pytest.mark.parametrize(
    ("text", "place", "words"), [case[1:] for case in WRONG], ids=[case[0] for case in WRONG]
)
def test_wrong_worlds(text: str, place: str, words: str):
    fault = fault_of(text)
    assert place in fault
    assert words in fault
