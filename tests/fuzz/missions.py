"""Scenarios drawn at random from all that the format has: valid for the most part, sensible or not."""

from __future__ import annotations

import json
import random
from typing import Any

from escort_mj.robots import KINDS
from escort_mj.robots.mjcf import FileKind

LAWS = ["apd_smc", "asmc", "pd_smc", "pd", "computed_torque", "super_twisting"]
SHAPES = ["box", "cylinder", "capsule", "ellipsoid"]


def mission(dice: random.Random) -> str:
    """A scenario as JSON, which is YAML."""
    axes = dice.choice((2, 2, 2, 3, 3, 4))
    count = dice.choice((1, 2, 3, 5, 6, 8, 13))
    scenario: dict[str, Any] = {
        "name": "drawn",
        "seed": dice.randrange(1000),
        "duration": dice.choice((0.1, 0.5, 1.0, 2.0)),
        "axes": axes,
        "physics": {
            "timestep": dice.choice((0.0005, 0.001, 0.002, 0.005, 0.02)),
            "integrator": dice.choice(("euler", "implicitfast", "implicit")),
            "solver": dice.choice(("newton", "cg", "pgs", None)),
        },
        "target": _target(axes, dice),
        "robots": _robots(count, axes, dice),
        "obstacles": [_obstacle(axes, dice) for _ in range(dice.choice((0, 0, 1, 3, 8)))],
        "mission": _orders(axes, dice),
        "controller": dice.choice((dice.choice(LAWS), _gains(dice))),
        "recording": {"rate": dice.choice((10.0, 50.0)), "truth": axes < 4 and dice.random() < 0.1},
        "uncertainty": {"disturbance": [dice.choice((0, "sin(t)", "20*cos(9*t)")) for _ in range(axes)]},
    }
    if dice.random() < 0.4:
        scenario["sensing"] = {
            "position": {"noise": dice.choice((0.0, 0.02, 3.0)), "delay": dice.choice((0.0, 0.02, 0.1))},
            "velocity": {"noise": dice.choice((0.0, 0.5)), "dropout": dice.choice((0.0, 0.5))},
            "target_position": {"bias": dice.choice((0.0, 0.2)), "resolution": dice.choice((None, 0.1))},
        }
    if dice.random() < 0.2 and axes == 2:
        scenario["walls"] = [{"points": [[-20, 12], [20, 12]], "corridor": dice.choice((4.0, 30.0))}]
    if dice.random() < 0.15:
        scenario["clutter"] = {"count": dice.choice((3, 10)), "low": [-30.0] * axes, "high": [30.0] * axes}
    return json.dumps(scenario)


def _target(axes: int, dice: random.Random) -> dict[str, Any]:
    still = [0.0] * (axes - 2)
    target: dict[str, Any] = dice.choice(
        (
            {},
            {"position": ["0.5*t", "sin(t)", *still]},
            {"position": ["50*t", "5*sin(9*t)", *still]},
            {"waypoints": [{"time": 0, "position": [0.0] * axes}, {"time": 1, "position": [1.0] * axes}]},
        )
    )
    if axes < 4 and dice.random() < 0.2:
        target |= {"body": {"mass": dice.choice((0.1, 5.0))}}
    return target


def _robots(count: int, axes: int, dice: random.Random) -> dict[str, Any]:
    robots: dict[str, Any] = {
        "count": count,
        "mass": dice.choice((0.01, 1.0, 300.0)),
        "force_limit": dice.choice((None, 0.1, 10.0, 1e4)),
    }
    if axes < 4:
        drawn = [kind for kind in KINDS if not issubclass(kind, FileKind) and axes <= kind.most_axes]
        kinds = [kind.model_fields["kind"].default for kind in drawn]
        robots["kind"] = dice.choice(("point_mass", "point_mass", dice.choice(kinds)))
    if dice.random() < 0.3:
        robots["actuators"] = {"lag": dice.choice((0.0, 0.05)), "dead_zone": dice.choice((0.0, 1.0))}
    if dice.random() < 0.2:
        robots["failures"] = [{"robot": 1, "at": 0.05, "kind": dice.choice(("dead", "stuck", "mad"))}]
    return robots


def _obstacle(axes: int, dice: random.Random) -> dict[str, Any]:
    place = [dice.uniform(-12.0, 12.0) for _ in range(axes)]
    if axes < 4 and dice.random() < 0.4:
        shape = dice.choice(SHAPES)
        size = [dice.uniform(0.2, 2.0) for _ in range(2 if shape in ("cylinder", "capsule") else 3)]
        return {"shape": shape, "size": size, "position": place, "orientation": dice.uniform(-3.0, 3.0)}
    if dice.random() < 0.3:
        return {"radius": 0.5, "motion": {"position": [f"{x:.3f} + sin(2*t)" for x in place]}}
    return {"radius": dice.choice((0.1, 0.5, 3.0)), "position": place}


def _orders(axes: int, dice: random.Random) -> dict[str, Any]:
    behaviors: list[Any] = ["avoid_obstacles", dice.choice(("vertices", "repulsion", "chords")), "surface"]
    if axes > 3:
        behaviors[1] = dice.choice(("vertices", "repulsion"))
    behaviors[0] = {"behavior": "avoid_obstacles", "safe_distance": dice.choice((0.3, 0.8, 2.0))}
    dice.shuffle(behaviors)
    return {
        "radius": dice.choice((1.0, 3.0, 10.0)),
        "behaviors": behaviors[: dice.choice((1, 2, 3, 3, 3))],
        "outer": dice.choice(("nsb", "nsb", "nsb", "potential_field", "barrier_filter")),
        "target_feedforward": dice.random() < 0.7,
        "max_speed": dice.choice((None, 0.5, 3.0)),
    }


def _gains(dice: random.Random) -> dict[str, Any]:
    return {
        "law": "apd_smc",
        "proportional_gain": dice.choice((0.0, 30.0, 1e4)),
        "derivative_gain": dice.choice((0.0, 50.0, 1e4)),
        "slope": dice.choice((0.1, 20.0, 1e3)),
        "anti_windup": dice.random() < 0.5,
        "smoothing": dice.choice(("tanh", "saturation", "sign")),
    }
