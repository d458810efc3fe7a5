"""Scenarios that mean nothing: each key is well formed, and the whole is wrong whatever else it says."""

from __future__ import annotations

import copy
import random
from collections.abc import Callable
from typing import Any

Fault = dict[str, Any]
"""What to set: key paths with dots, list places as numbers, `+` to append, and values."""

PLAIN: dict[str, Any] = {
    "name": "plain",
    "duration": 2.0,
    "target": {"position": ["0.2*t", 0], "radius": 0.3},
    "robots": {"positions": [[3, 0], [-3, 0.5], [0, 3]], "radius": 0.2},
    "obstacles": [
        {"name": "rock", "position": [8, 0], "radius": 0.5},
        {"name": "block", "shape": "box", "size": [0.4, 0.6], "position": [0, 8]},
    ],
    "walls": [{"name": "fence", "points": [[-10, -8], [10, -8]], "doors": [{"at": 10, "width": 2}]}],
    "mission": {
        "radius": 3,
        "behaviors": [{"behavior": "avoid_obstacles", "safe_distance": 0.5}, "chords", "surface"],
    },
    "expect": [{"contacts": "none"}],
}


def _far(dice: random.Random) -> float:
    return dice.choice((2.5, 7.0, 1e4))


def _robot(dice: random.Random) -> int:
    return dice.choice((4, 17, 5000))


def _name(dice: random.Random) -> str:
    return dice.choice(("rok", "robot_4", "opponent_1", "Rock", "obstacle_3", "wall", "fence_9", "team_1"))


FAULTS: dict[str, Callable[[random.Random], Fault]] = {
    # places
    "target in an obstacle": lambda d: {"obstacles.0.position": [d.uniform(-0.5, 0.5), 0]},
    "two robots at one place": lambda d: {"robots.positions.1": [3 + d.uniform(-0.3, 0.3), 0]},
    "robot in an obstacle": lambda d: {"robots.positions.0": [8, d.uniform(-0.4, 0.4)]},
    "robot in a wall": lambda d: {"robots.positions.2": [d.uniform(-9, -2), -8]},
    "robot in the target": lambda d: {"robots.positions.0": [d.uniform(-0.3, 0.3), 0.1]},
    "fewer places than robots": lambda d: {"robots.count": d.choice((1, 2, 4, 9))},
    "places of three numbers": lambda d: {"robots.positions.1": [-3, 0.5, d.choice((0, 1))]},
    "velocities of two robots": lambda d: {"robots.velocities": [[0, 0]] * d.choice((1, 2, 4))},
    "places and a placement": lambda d: {"robots.placement": {"within": d.choice((3, 9))}},
    "no room for a team": lambda d: {
        "robots.positions": None,
        "robots.count": d.choice((60, 400)),
        "robots.placement": {"within": d.choice((1.0, 2.0))},
    },
    "places of a kind of space": lambda d: {"axes": 3},
    # names and numbers of what is not there
    "a robot beyond the last": lambda d: {"robots.overrides": [{"robot": _robot(d), "mass": 2}]},
    "a robot's values twice": lambda d: {
        "robots.overrides": [{"robot": 1, "mass": 2}, {"robot": 1, "mass": d.choice((2, 3))}]
    },
    "a failure of nobody": lambda d: {"robots.failures": [{"robot": _robot(d), "at": 1}]},
    "a failure after the end": lambda d: {"robots.failures": [{"robot": 1, "at": _far(d)}]},
    "two failures of a robot": lambda d: {
        "robots.failures": [{"robot": 1, "at": 1}, {"robot": 1, "at": d.choice((1, 1.5))}]
    },
    "a name twice": lambda d: {"obstacles.1.name": "rock"},
    "a name that is taken": lambda d: {
        "obstacles.0.name": d.choice(("target", "robot_1", "robots", "obstacles", "floor", "walls"))
    },
    "clearance to nobody": lambda d: {"expect.+": {"clearance": ["robots", _name(d)], "at_least": 0.1}},
    "contacts of nobody": lambda d: {"expect.+": {"contacts": ["robots", _name(d)]}},
    "clearance of one": lambda d: {"expect.+": {"clearance": ["rock", "rock"], "at_least": 0.1}},
    "clearance of things": lambda d: {"expect.+": {"clearance": ["rock", "block"], "at_least": 0.1}},
    "a leader that is not there": lambda d: {
        "target.position": None,
        "target.policy": {"policy": "follow", "leader": _name(d)},
    },
    "a target that leads itself": lambda d: {
        "target.position": None,
        "target.policy": {"policy": "follow", "leader": "target"},
    },
    "a law without a name": lambda d: {"controller": {"law": d.choice(("apd", "PD", "pid", "apd_smcc", ""))}},
    "a behavior twice": lambda d: {
        "mission.behaviors": ["chords", "surface", d.choice(("chords", "surface"))]
    },
    "order of a larger team": lambda d: {
        "mission.behaviors.1": {
            "behavior": "chords",
            "order": d.choice(([1, 2], [1, 2, 4], [1, 1, 2], [0, 1, 2])),
        }
    },
    "offsets of two robots": lambda d: {
        "mission.behaviors": [{"behavior": "formation", "offsets": [[1, 0]] * d.choice((1, 2, 4))}]
    },
    "offsets at one place": lambda d: {
        "mission.behaviors": [
            {"behavior": "formation", "offsets": [[1, 0], [1, d.uniform(-0.1, 0.1)], [0, 2]]}
        ]
    },
    "goals of two robots": lambda d: {
        "mission.behaviors": [{"behavior": "goal", "goals": [[1, 1]] * d.choice((1, 2, 4))}]
    },
    "goals at one place": lambda d: {
        "mission.behaviors": [{"behavior": "goal", "goals": [[1, 5], [1 + d.uniform(0, 0.2), 5], [4, 4]]}]
    },
    "a goal in a rock": lambda d: {
        "mission.behaviors": [{"behavior": "goal", "goals": [[1, 5], [8, d.uniform(-0.4, 0.4)], [4, 4]]}]
    },
    "guards without opponents": lambda d: {"mission.behaviors": ["guard", "surface"]},
    "who intercepts nobody": lambda d: {
        "mission.behaviors": [{"behavior": "intercept", "quarry": "opponents"}]
    },
    "seen by nobody": lambda d: {"knowledge": {"target": {"robots": [_robot(d)]}}},
    "an edge to nobody": lambda d: {"communication": {"graph": {"edges": [[1, _robot(d)]]}}},
    "an edge to itself": lambda d: {"communication": {"graph": {"edges": [[d.choice((1, 2)), 1], [2, 2]]}}},
    "an edge twice": lambda d: {"communication": {"graph": {"edges": [[1, 2], d.choice(([1, 2], [2, 1]))]}}},
    "a blackout of nobody": lambda d: {"communication": {"blackouts": [{"robots": [_robot(d)]}]}},
    "robots in two groups": lambda d: {
        "communication": {"blackouts": [{"groups": [[1, 2], [2, d.choice((1, 3))]]}]}
    },
    "a team of nobody": lambda d: {"expect.+": {"settled": 0.1, "by": 1, "team": _name(d)}},
    # times
    "a window that ends first": lambda d: {
        "expect.+": {"contacts": "none", "after": 1.5, "before": d.choice((0.5, 1.5))}
    },
    "a window after the end": lambda d: {"expect.+": {"contacts": "none", "after": _far(d)}},
    "settled after the end": lambda d: {"expect.+": {"settled": 0.1, "by": _far(d)}},
    "a phase after the end": lambda d: {"mission.supervisor": [{"after": _far(d), "behaviors": ["surface"]}]},
    "a phase that ends first": lambda d: {
        "mission.supervisor": [{"after": 1, "before": d.choice((0.5, 1)), "behaviors": ["surface"]}]
    },
    "a blackout after the end": lambda d: {"communication": {"blackouts": [{"after": _far(d)}]}},
    "a blackout that ends first": lambda d: {
        "communication": {"blackouts": [{"after": 1, "before": d.choice((0.5, 1))}]}
    },
    "waypoints that go back": lambda d: {
        "target": {"waypoints": [{"time": t, "position": [t, 0]} for t in (0, 1, d.choice((0.5, 1)))]}
    },
    "a waypoint of one axis": lambda d: {
        "target": {"waypoints": [{"time": 0, "position": [0]}, {"time": 1, "position": [1, 0]}]},
        "opponents": [{"policy": "straight"}] * d.choice((0, 1)),
    },
    "a mission as wide as a country": lambda d: {
        "robots": {"count": 3},
        "mission.radius": d.choice((6e4, 1e5)),
    },
    "no waypoints": lambda d: {"target": {"waypoints": []}},
    "a path twice": lambda d: {
        "target.waypoints": [{"time": 0, "position": [0, 0]}, {"time": 1, "position": [1, 0]}]
    },
    "steps longer than the run": lambda d: {"duration": d.choice((1e-9, 1e-4)), "physics.timestep": 0.01},
    "samples between steps": lambda d: {"recording.rate": d.choice((37.3, 700, 1e6))},
    "a delay between steps": lambda d: {"sensing.position.delay": d.choice((0.0013, 0.0201))},
    "a delay beyond the run": lambda d: {"sensing.velocity.delay": d.choice((2.5, 1e3))},
    "scans between steps": lambda d: {"sensing.lidar": {"rate": d.choice((37.3, 1e5))}},
    "messages between steps": lambda d: {"communication": {"rate": d.choice((37.3, 1e5))}},
    "delays turned around": lambda d: {"communication": {"delay": [0.1, d.choice((0.05, 0.02))]}},
    "a delay of three numbers": lambda d: {"communication": {"delay": [0.1, 0.2, 0.3]}},
    "looks between steps": lambda d: {"knowledge": {"target": {"rate": d.choice((37.3, 1e5))}}},
    "updates between bounds": lambda d: {"mission.trigger": {"dwell": 0.2, "longest": d.choice((0.1, 0.05))}},
    "a video that ends first": lambda d: {"video": {"start": 1.5, "end": d.choice((0.5, 1.5))}},
    "a video after the end": lambda d: {"video": {"start": _far(d)}},
    "a video of an odd width": lambda d: {"video": {"width": d.choice((641, 961))}},
    # bounds and shapes
    "bounds turned around": lambda d: {
        "expect.+": {"metric": "radius_error_mean", "at_least": 2, "at_most": d.choice((1, -1))}
    },
    "a metric without a bound": lambda d: {
        "expect.+": {"metric": d.choice(("radius_error_mean", "contacts"))}
    },
    "a metric that is none": lambda d: {
        "expect.+": {"metric": d.choice(("radius_eror_mean", "contact", "x", "")), "at_most": 1}
    },
    "a negative bound": lambda d: {
        "expect.+": {
            "metric": d.choice(("contacts", "radius_error_max", "path_length")),
            "at_most": d.choice((-1, -1e-9)),
        }
    },
    "a share beyond one": lambda d: {"expect.+": {"metric": "arrived", "at_least": d.choice((1.5, 100))}},
    "a metric of goals": lambda d: {
        "expect.+": {"metric": d.choice(("goal_distance_max", "arrival_time", "arrived")), "at_most": 1}
    },
    "a metric of opponents": lambda d: {
        "expect.+": {
            "metric": d.choice(("opponents_breached", "opponents_intercepted", "threat_time")),
            "at_most": 1,
        }
    },
    "a metric of knowledge": lambda d: {"expect.+": {"metric": "estimate_error_mean", "at_most": 1}},
    "reached without goals": lambda d: {"expect.+": {"reached": 0.1, "by": 1}},
    "outcomes twice": lambda d: {"expect.+": {"outcome": "diverged"}, "expect.+2": {"outcome": "completed"}},
    "contacts turned around": lambda d: {
        "expect.+": {"contacts": "any", "at_least": 3, "at_most": d.choice((0, 2))}
    },
    "a part and a window": lambda d: {
        "expect.+": {"metric": "radius_error_mean", "at_most": 1, "over": "tail", "after": 1}
    },
    "a box of two robots' sizes": lambda d: {"obstacles.1.size": [0.4] * d.choice((1, 4))},
    "a box with a radius": lambda d: {"obstacles.1.radius": 0.5},
    "a ball with a size": lambda d: {"obstacles.0.size": [0.5, 0.5, 0.5]},
    "a flat mesh": lambda d: {
        "obstacles.1": {
            "shape": "mesh",
            "position": [0, 8],
            "vertices": [[0, 0], [1, d.uniform(0, 1e-12)], [2, 0]],
        }
    },
    "a mesh of two": lambda d: {
        "obstacles.1": {"shape": "mesh", "position": [0, 8], "vertices": [[0, 0], [1, 1]]}
    },
    "an orientation of nothing": lambda d: {"obstacles.1.orientation": [0] * d.choice((2, 4, 5))},
    "a place and a path": lambda d: {"obstacles.0.motion": {"position": ["8-t", 0]}},
    "a body without a path": lambda d: {"obstacles.0.body": {"mass": 2}},
    "an obstacle nowhere": lambda d: {"obstacles.0": {"radius": 0.5}},
    "a wall of one point": lambda d: {"walls.0.points": [[0, -8]]},
    "a wall of no length": lambda d: {"walls.0.points": [[0, -8], [0, -8]], "walls.0.doors": []},
    "a door beyond the wall": lambda d: {"walls.0.doors.0.at": d.choice((20, 25, 1e6))},
    "a door wider than the wall": lambda d: {"walls.0.doors.0.width": d.choice((25, 1e6))},
    "two doors at one place": lambda d: {
        "walls.0.doors": [{"at": 10, "width": 2}, {"at": 10 + d.uniform(0, 1.9), "width": 2}]
    },
    "a box turned around": lambda d: {
        "clutter": {"count": 2, "low": [5, 5], "high": d.choice(([4, 9], [9, 4]))}
    },
    "radii turned around": lambda d: {
        "clutter": {"count": 2, "low": [9, 9], "high": [20, 20], "least_radius": 0.9, "largest_radius": 0.5}
    },
    "no room for clutter": lambda d: {
        "clutter": {"count": d.choice((200, 500)), "low": [9, 9], "high": [12, 12]}
    },
    "a circle within the target": lambda d: {"mission.radius": d.choice((0.01, 0.3, 0.45))},
    "a crowded circle": lambda d: {
        "robots.positions": None,
        "robots.count": d.choice((40, 200)),
        "mission.radius": 1,
    },
    "a circle in a circle": lambda d: {
        "mission.behaviors.2": {"behavior": "surface", "radius": d.choice((-1, 0, "-1-t", "1-t"))}
    },
    "a smallest circle beyond it": lambda d: {
        "mission.behaviors.2": {"behavior": "surface", "fit": True, "least": d.choice((3.5, 90))}
    },
    "a safe distance that nobody keeps": lambda d: {
        "mission.behaviors.0": {"behavior": "avoid_obstacles", "teammate_distance": d.choice((30, 500))}
    },
    "a condition twice": lambda d: {
        "mission.supervisor": [
            {"behaviors": ["surface"], "when": {"quantity": "robot_distance", "below": 1, "above": 2}}
        ]
    },
    "a condition of nothing": lambda d: {
        "mission.supervisor": [{"behaviors": ["surface"], "when": {"quantity": "robot_distance"}}]
    },
    "a condition that ends first": lambda d: {
        "mission.supervisor": [
            {
                "behaviors": ["surface"],
                "when": {"quantity": "robot_distance", "below": 1, "release": d.choice((0.5, 0.9))},
            }
        ]
    },
    "a phase of another team": lambda d: {"mission.supervisor": [{"behaviors": ["surface"], "team": "a"}]},
    "gravity of one axis": lambda d: {"physics.gravity": d.choice(([0], [0, 0, -9.81, 0]))},
    "wind of one axis": lambda d: {
        "environment.medium": {"density": 1.2, "wind": d.choice(([1], [1, 2, 3]))}
    },
    "wind in nothing": lambda d: {"environment.medium": {"wind": [1, 2]}},
    "forces of one axis": lambda d: {"uncertainty.disturbance": d.choice((["sin(t)"], ["t", "t", "t"]))},
    "a bias of one axis": lambda d: {"sensing.position.bias": d.choice(([0.1], [0.1, 0.1, 0.1]))},
    "gains of one motor": lambda d: {"robots.actuators": {"gains": [1] * d.choice((1, 3))}},
    "gains twice": lambda d: {"robots.actuators": {"gains": [1, 1], "gain_error": 0.1}},
    "a path with a hole": lambda d: {
        "target.position": [d.choice(("1/t", "log(t)", "sqrt(1-t)", "1/(t-1)", "tan(pi*t/2)")), 0]
    },
    "a path of words": lambda d: {
        "target.position": [d.choice(("north", "t t", "x", "2*", "sin t", "t if t else 0", "t; 1")), 0]
    },
    "a path that jumps": lambda d: {
        "target.position": [d.choice(("floor(t)*5", "sign(t-1)", "mod(t,1)*9")), 0]
    },
    "a path of one axis": lambda d: {"target.position": ["t"] * d.choice((1, 3))},
    "a force with a hole": lambda d: {
        "uncertainty.disturbance": [d.choice(("1/t", "sqrt(0.5-t)", "exp(1000*t)")), 0]
    },
    "a slope in space": lambda d: {"axes": 3, "environment.slope": {"angle": 0.1}},
    "opponents within the target": lambda d: {
        "opponents": [{"distance": d.choice((0.01, 0.3)), "policy": "straight"}]
    },
    "places of two opponents": lambda d: {
        "opponents": [{"count": d.choice((1, 3)), "positions": [[9, 9], [-9, 9]], "policy": "straight"}]
    },
    "opponents' name": lambda d: {
        "opponents": [{"name": "rock", "policy": "straight"}, {"name": "rock", "policy": "weave"}]
    },
    "robots in two teams": lambda d: {
        "target": None,
        "teams": [
            {"name": "a", "robots": [1, 2], "targets": [{"name": "x", "position": [9, 9]}]},
            {"name": "b", "robots": [2, 3], "targets": [{"name": "y", "position": [-9, 9]}]},
        ],
    },
    "a robot in no team": lambda d: {
        "target": None,
        "teams": [
            {"name": "a", "robots": [1], "targets": [{"name": "x", "position": [9, 9]}]},
            {"name": "b", "robots": [3], "targets": [{"name": "y", "position": [-9, 9]}]},
        ],
    },
    "a target in two teams": lambda d: {
        "target": None,
        "teams": [
            {"name": "a", "robots": [1], "targets": [{"name": "x", "position": [9, 9]}]},
            {"name": "b", "robots": [2, 3], "targets": [{"name": "x", "position": [-9, 9]}]},
        ],
    },
    "teams and a target": lambda d: {
        "teams": [{"name": "a", "robots": [1, 2, 3], "targets": [{"name": "x", "position": [9, 9]}]}]
    },
    "no target to surround": lambda d: {"target": None},
    "a kind for the plane": lambda d: {
        "axes": 3,
        "robots.kind": d.choice(("rolling_sphere", "diff_drive", "surface_vessel", "loaded")),
        "robots.positions": None,
        "target.position": [0, 0, 0],
        "obstacles": [],
        "walls": [],
    },
}
"""By what is wrong; each returns what to set in `PLAIN`."""


def nonsense(dice: random.Random, faults: list[str] | None = None) -> tuple[list[str], dict[str, Any]]:
    """Return what is wrong, and a scenario with that: one fault of those given, or one or two of all."""
    drawn = dice.sample(faults or sorted(FAULTS), 1 if faults else dice.choice((1, 1, 2)))
    scenario = copy.deepcopy(PLAIN)
    for name in drawn:
        for path, value in FAULTS[name](dice).items():
            put(scenario, path, value)
    return drawn, scenario


def put(data: Any, path: str, value: Any) -> None:
    """Set a value; tables on the way are made, and what is not there to be set is left."""
    *way, last = path.split(".")
    for key in way:
        if isinstance(data, list):
            if int(key) >= len(data):
                return
            if not isinstance(data[int(key)], dict | list):
                data[int(key)] = {}
            data = data[int(key)]
        else:
            if not isinstance(data.get(key), dict | list):
                data[key] = {}
            data = data[key]
    if isinstance(data, dict):
        data[last] = copy.deepcopy(value)
    elif last.startswith("+"):
        data.append(copy.deepcopy(value))
    elif int(last) < len(data):
        data[int(last)] = copy.deepcopy(value)
