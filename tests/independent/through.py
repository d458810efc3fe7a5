"""A led target drives through bodies that stand still, which MuJoCo never lets meet."""

from tests.independent.missions import (
    COUNT,
    MET,
    NONE,
    SWEPT,
    Variation,
    apart,
    mission,
    touching,
    within,
)

THROUGH = (
    Variation(
        "through a turned box, past another",
        mission(
            8.7, target={"position": ["-4+t", "0.1"]},
            obstacles=[
                {"shape": "box", "position": [0, 0], "size": [0.7, 0.3], "orientation": 0.6},
                {"shape": "box", "position": [3, 1.2], "size": [0.5, 0.5], "orientation": -0.8},
            ],
        ),
        MET,
    ),
    Variation(
        "through a turned cylinder in space",
        mission(
            6, axes=3, rate=10, target={"position": ["-3+t", "0.2*t", 0.1]},
            obstacles=[
                {
                    "shape": "cylinder",
                    "position": [0, 0.9, 0],
                    "size": [0.4, 0.8],
                    "orientation": [0.5, 0.3, 1],
                }
            ],
        ),
        MET,
    ),
    Variation(
        "through a lying capsule, above another",
        mission(
            6.005, axes=3, timestep=0.005, target={"position": ["-3+t", 0, "0.3*sin(t)"], "radius": 0.15},
            obstacles=[
                {
                    "shape": "capsule",
                    "position": [0, 0.3, 0],
                    "size": [0.25, 1],
                    "orientation": [1.57, 0, 0.4],
                },
                {"shape": "capsule", "position": [1.7, 0, -1], "size": [0.2, 0.5], "name": "low"},
            ],
        ),
        [*MET, apart("target", "low")],
    ),
    Variation(
        "through a turned ellipsoid in space",
        mission(
            7, axes=3, rate=5, target={"position": ["2*cos(0.9*t)", "2*sin(0.9*t)", "0.1*t"]},
            obstacles=[
                {
                    "shape": "ellipsoid",
                    "position": [-1.6, 0.3, 0.6],
                    "size": [0.9, 0.3, 0.5],
                    "orientation": [0.9, 0.1, -0.3, 0.2],
                }
            ],
        ),
        MET,
    ),
    Variation(
        "through the corner of a mesh",
        mission(
            6, target={"position": ["-2+0.8*t", "1.1-0.1*t"], "radius": 0.25},
            obstacles=[
                {"shape": "mesh", "position": [0.2, 0.1], "vertices": [[-1, -1], [1.2, -0.7], [0.1, 0.9]]}
            ],
        ),
        MET,
    ),
    Variation(
        "through a door, and through a wall",
        mission(
            9, rate=2,
            target={"position": ["-4+t", "0.3"]},
            walls=[
                {"points": [[-1, -5], [-1, 5]], "doors": [{"at": 5.2, "width": 1.1}], "name": "gate"},
                {"points": [[2, -3], [3, 3]], "thickness": 0.1, "name": "fence"},
            ],
        ),
        [
            NONE, COUNT, apart("target", "walls"), *touching("target", "walls", "touch_time"),
            *within(0, 4.9, apart("target", "walls"), NONE), *touching("target", "fence"),
            *touching("target", "gate_1"), apart("target", "gate_1"),
        ],
    ),
    Variation(
        "through two balls in four axes",
        mission(
            9.99, axes=4, rate=20, target={"position": ["-3+0.7*t", "sin(t)", 0, "0.1*t"], "radius": 0.2},
            obstacles=[
                {"position": [-1.5, 0.8, 0.3, 0.2], "radius": 0.4},
                {"position": [2, 0.6, 0, 0.9], "radius": 0.7},
                {"position": [2, 3, 0, 0.9], "radius": 0.7},
            ],
        ),
        MET,
    ),
    Variation(
        "in six axes, a hair into one ball and a hair past another",
        mission(
            6, axes=6, rate=1, target={"position": ["-3+t", 0, 0, 0, 0, 0]},
            obstacles=[
                {"position": [-1, 0, 0, 0, 0.48, 0.6396], "radius": 0.5, "name": "met"},
                {"position": [1, 0, 0, 0.48, 0.6404, 0], "radius": 0.5, "name": "missed"},
            ],
        ),
        [*MET, *touching("target", "met"), *touching("target", "missed"), apart("target", "missed")],
    ),
    Variation(
        "in space, a hair into a ball, a box and a capsule, and a hair past others",
        mission(
            13, axes=3, rate=1, timestep=0.01, target={"position": ["-6+t", 0, 0]},
            obstacles=[
                {"position": [-4, 0.5599, 0.5599], "radius": 0.49194959, "name": "ball"},
                {"position": [-2, 0.7904, 0], "radius": 0.49, "name": "other_ball"},
                {"shape": "box", "position": [0, 0, 0.6998], "size": [0.2, 0.2, 0.4], "name": "box"},
                {"shape": "box", "position": [2, 0, 0.7003], "size": [0.2, 0.2, 0.4], "name": "other_box"},
                {"shape": "capsule", "position": [4, 0.4998, 0], "size": [0.2, 0.4], "name": "pill"},
                {"shape": "capsule", "position": [6, 0.5002, 0], "size": [0.2, 0.4], "name": "other_pill"},
            ],
        ),
        [
            *MET, *touching("target", "other_ball"), *touching("target", "box"),
            *touching("target", "other_pill"),
        ],
    ),
    Variation(
        "again and again through a rock, and into a cart",
        mission(
            11.1, rate=0.5,
            target={
                "interpolation": "smooth",
                "waypoints": [
                    {"time": 0, "position": [-2, 0]}, {"time": 2, "position": [2, 0.2]},
                    {"time": 5, "position": [-2, -0.1]}, {"time": 9, "position": [2, 0]},
                ],
            },
            obstacles=[
                {"position": [0, 0.1], "radius": 0.4, "name": "rock"},
                {"name": "cart", "radius": 0.3, "motion": {"position": ["2", "4-0.4*t"]}},
            ],
        ),
        [
            *MET, *within(1.4, 5.2, *touching("target", "rock", "touch_time")), *touching("target", "cart"),
            *SWEPT,
        ],
    ),
)  # fmt: skip
