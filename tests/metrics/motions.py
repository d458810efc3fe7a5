"""Motions that tests of measures and metrics share."""

import numpy as np

TIME = np.linspace(0.0, 10.0, 501)
RADIUS = 5.0


def ring(robots, radius=RADIUS, center=(0.0, 0.0), time=TIME):
    """Robots evenly on a circle, shape (time, robot, axis); radius a number or one per sample and robot."""
    angle = 2.0 * np.pi * np.arange(robots) / robots
    spokes = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    radii = np.broadcast_to(radius, (len(time), robots))
    return np.asarray(center) + radii[..., None] * spokes


def steps(time, when, height=1.0):
    """Zero before a moment, a height from it on."""
    return np.where(np.asarray(time) >= when - 1e-9, height, 0.0)


# Missions with goals: robots that arrive; one that cannot move, and one far from its goal.
HEADED = {
    "robots that arrive": {
        "duration": 3.0,
        "robots": {"positions": [[2, 0], [0, 2], [-2, 0], [0, -2]]},
        "target": {"position": [0, 6]},
        "mission": {"radius": 2, "behaviors": [{
            "behavior": "goal", "gain": 3, "reach": 0.1,
            "goals": [[2, 1], [[0, 2.5], [0.5, 2.5], [0.5, 3]], [-2.2, 0], [0, -2]],
        }]},
    },
    "a robot that is stuck": {
        "duration": 5.5,
        "robots": {"positions": [[3, -1], [0, 2], [-3, -1], [0, -2]],
                   "overrides": [{"robot": 1, "force_limit": 1e-12}]},
        "target": {"position": [0, 6]},
        "mission": {"radius": 2, "max_speed": 0.5, "behaviors": [
            {"behavior": "goal", "gain": 3, "goals": [[3, 2], [0, 2.5], [-3, 8], [0, -2.5]]},
        ]},
    },
}  # fmt: skip

# A mission in which one robot sees the target, and the others hear of it.
KNOWING = {
    "estimates and messages": {
        "robots": {"positions": [[2, 0], [0, 2], [-2, 0], [0, -2]]},
        "target": {"position": ["0.3*t", 0]},
        "mission": {"radius": 2, "behaviors": ["vertices", "surface"]},
        "knowledge": {
            "target": {"robots": [1], "rate": 50, "noise": {"position": 0.01, "velocity": 0.02}},
            "estimator": "kalman", "initial": {"position": 0.1, "velocity": 0.1},
        },
        "communication": {"graph": "ring", "rate": 50, "delay": 0.02, "loss": 0.2},
    },
    "everybody heard at once": {
        "duration": 0.2,
        "robots": {"positions": [[2, 0], [0, 2], [-2, 0], [0, -2]]},
        "mission": {"radius": 2, "behaviors": ["repulsion", "surface"]},
        "knowledge": {"estimator": "hold"},
        "communication": {},
    },
}  # fmt: skip

# A target that dashes out between two robots of a team that intercepts it; one of them touches it.
DASH = {
    "a dash": {
        "robots": {"positions": [[2, 0], [0, 2], [-2, 0], [0, -2]], "force_limit": None},
        "target": {"position": ["4*t", "2.5*t"], "radius": 0.3},
        "mission": {"radius": 2, "behaviors": [{"behavior": "intercept", "speed": 1, "within": 0.1}]},
    },
}  # fmt: skip

# A target of 2 kg that a force drives along a path.
DRIVEN = {
    "a target that a force drives": {
        "robots": {"positions": [[2, 0], [0, 2], [-2, 0], [0, -2]]},
        "target": {"position": ["0.4*sin(3*t)", "0.2*t"], "body": {"mass": 2, "gain": 10}},
        "mission": {"radius": 2, "behaviors": ["vertices", "surface"]},
    },
}

# One opponent that a robot intercepts, one that reaches the target, and one that waits.
OPPOSED = {
    "opponents": {
        "duration": 3.0,
        "robots": {"positions": [[2, 0], [-1, 2], [-2, 0], [0, -2]]},
        "target": {"position": [0, 0], "radius": 0.3},
        "mission": {"radius": 2, "behaviors": ["surface"]},
        "opponents": [
            {"count": 2, "positions": [[4, 0], [2.5, 2.5]], "policy": {"policy": "straight", "speed": 1.5}},
            {"name": "late", "positions": [[0, 9]], "start": 2.5, "policy": "straight"},
        ],
    },
}  # fmt: skip
