"""Missions drawn at random: bodies that fly and are led through each other, asked about any window."""

from __future__ import annotations

import json
import random

from escort_mj.errors import ScenarioError
from escort_mj.scenario.reader.load import parse_scenario
from tests.independent.missions import (
    COUNT,
    NONE,
    OBSTACLES,
    ROBOTS,
    TUNNELING,
    Keys,
    Variation,
    apart,
    drifting,
    mission,
    touching,
)

TIMESTEPS = (0.0005, 0.001, 0.002, 0.005, 0.01)
STRIDES = (1, 2, 7, 20, 50, 333, 1000)
SHAPES = ("sphere", "box", "cylinder", "capsule", "ellipsoid", "mesh")


def drawn(seed: int) -> Variation:
    """Return the mission of a seed: the first of its draws in which nothing overlaps at the start."""
    dice = random.Random(seed)
    while True:
        variation = _draw(f"drawn {seed}", dice)
        try:
            parse_scenario(json.dumps(variation.keys))
        except ScenarioError as error:
            assert "overlaps" in str(error), error
        else:
            return variation


def _draw(name: str, dice: random.Random) -> Variation:
    axes = dice.choice((2, 2, 2, 3, 3, 3, 4, 6, 9))
    timestep = dice.choice(TIMESTEPS)
    steps = round(dice.uniform(0.3, 3.0) / timestep)
    duration = round((steps + dice.choice((0.0, 0.3, 0.49))) * timestep, 6)
    obstacles = [_obstacle(axes, duration, place, dice) for place in range(1, dice.choice((2, 3, 5)))]
    walls = []
    if axes < 4 and dice.random() < 0.4:
        foot = [] if axes == 2 else [dice.uniform(-2.0, 0.0)]
        walls = [{"points": [[*_point(2, dice), *foot] for _ in range(2)], "height": 2.0, "name": "wall"}]
        walls[0]["thickness"] = dice.choice((0.05, 0.2, 1.0))
    robots = drifting(*_robots(axes, dice), radius=dice.choice((0.05, 0.2, 0.4)))
    keys = mission(
        duration, axes, 1.0 / (timestep * dice.choice(STRIDES)), timestep,
        robots=robots, obstacles=obstacles, walls=walls, target=_target(axes, duration, dice),
        mission={"radius": 8, "behaviors": ["surface"]},
    )  # fmt: skip
    return Variation(name, keys, _questions(keys, dice))


def _point(axes: int, dice: random.Random, reach: float = 3.0) -> list[float]:
    """Return a place; beyond three axes places are nearer, or nothing would meet."""
    reach = reach if axes < 4 else 0.4 * reach
    return [round(dice.uniform(-reach, reach), 3) for _ in range(axes)]


def _robots(axes: int, dice: random.Random) -> tuple[list[list[float]], list[list[float]]]:
    """Return places apart from each other, and velocities towards the middle."""
    places = []
    for side in range(dice.choice((1, 2, 3))):
        place = _point(axes, dice, 1.0)
        place[side % 2] += (-1) ** side * dice.choice((3.0, 4.0))
        places.append(place)
    speed = dice.choice((0.3, 1.0, 3.0))
    return places, [[-speed * x + dice.uniform(-0.2, 0.2) for x in place] for place in places]


def _way(axes: int, duration: float, dice: random.Random) -> Keys:
    """Return how a body moves."""
    if dice.random() < 0.4:
        times = [duration * (share + dice.uniform(-0.15, 0.15)) for share in (0.2, 0.5, 0.9)]
        waypoints = [{"time": time, "position": _point(axes, dice)} for time in times]
        return {"waypoints": waypoints, "interpolation": dice.choice(("linear", "smooth"))}
    start, end = _point(axes, dice), _point(axes, dice)
    swings = ("", "+0.3*sin(7*t)", "-0.2*cos(19*t)", "+0.5*tanh(30*(t-0.6))")
    swing = [dice.choice(swings) for _ in range(axes)]
    return {
        "position": [
            f"{a}+({(b - a) / duration:.4f})*t{c}" for a, b, c in zip(start, end, swing, strict=True)
        ]
    }


def _target(axes: int, duration: float, dice: random.Random) -> Keys:
    target = _way(axes, duration, dice) | {"radius": dice.choice((0.1, 0.3, 0.6))}
    if axes < 4 and dice.random() < 0.2:
        target["body"] = {"mass": dice.choice((1.0, 1000.0))}
    return target


def _obstacle(axes: int, duration: float, place: int, dice: random.Random) -> Keys:
    """Return a body; what a planar one has of height is more than of width, so that depth is horizontal."""
    body: Keys = {"name": f"body_{place}", "shape": dice.choice(SHAPES) if axes < 4 else "sphere"}
    wide = [round(dice.uniform(0.1, 1.2), 3) for _ in range(3)]
    if axes == 2:
        wide[2] = 4.0
    shape = body["shape"]
    if shape == "sphere":
        body["radius"] = wide[0]
    elif shape == "mesh":
        corners = [_point(axes, dice, 1.5) for _ in range(9)]
        body["vertices"] = corners
    else:
        body["size"] = wide[1:] if shape in ("cylinder", "capsule") else wide
    if shape != "sphere":
        angles = [dice.uniform(-3.0, 3.0) for _ in range(3)]
        body["orientation"] = angles[0] if axes == 2 or dice.random() < 0.3 else angles
    if axes < 4 and dice.random() < 0.3:
        body["motion"] = _way(axes, duration, dice)
    else:
        body["position"] = _point(axes, dice)
    return body


def _questions(keys: Keys, dice: random.Random) -> list[Keys]:
    """Return questions about the whole mission, and the same about two windows of it."""
    duration, timestep = keys["duration"], keys["physics"]["timestep"]
    sides = [one["name"] for one in keys["obstacles"] + keys["walls"]]
    named = dice.choice(sides)
    asked = [
        NONE, COUNT, OBSTACLES, *TUNNELING, apart("target", "obstacles"), apart("robots", named),
        apart("robots", "target"), *touching("target", "obstacles", "touch_time"),
        *touching("target", named), *touching("robots", "obstacles"),
    ]  # fmt: skip
    if len(keys["robots"]["positions"]) > 1:
        asked.append(ROBOTS)
    found = list(asked)
    for _ in range(2):
        after, before = sorted(dice.uniform(0.0, duration) for _ in range(2))
        if before - after > 3 * timestep:
            after, before = ((round(x / timestep) + 0.5) * timestep for x in (after, before))
            found += [question | {"after": after, "before": min(before, duration)} for question in asked]
    return found
