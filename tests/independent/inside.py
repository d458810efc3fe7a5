"""One body is deep inside another: how deep is a signed distance."""

from tests.independent.missions import (
    DEEP,
    NONE,
    OBSTACLES,
    Variation,
    apart,
    drifting,
    mission,
    touching,
    within,
)

INSIDE = (
    Variation(
        "a fast robot inside a turned block",
        mission(
            0.05, timestep=0.01, rate=100,
            robots=drifting([[-1.9, 0.2], [9, 9]], [[130, 4], [0, 0]], radius=0.05),
            obstacles=[{"shape": "box", "position": [0, 0], "size": [1, 0.8, 2], "orientation": 0.3}],
        ),
        [OBSTACLES, apart("robots", "obstacles"), *touching("robots", "obstacles")],
    ),
    Variation(
        "a target inside a tall turned block",
        mission(
            10, rate=3.125, target={"position": ["-6+1.3*t", "0.4*t-2"]},
            obstacles=[{"shape": "box", "position": [0, 0], "size": [3, 2.2, 9], "orientation": -0.7}],
        ),
        [*DEEP, *within(4.4, 5.1, *DEEP)],
    ),
    Variation(
        "a target inside a cylinder, by its side and by its end",
        mission(
            10, axes=3, target={"position": ["-3+t", "0.5", "0.2*t"]},
            obstacles=[
                {
                    "shape": "cylinder",
                    "position": [1.5, 0, 0.8],
                    "size": [1.5, 1.1],
                    "orientation": [0.4, 0.2, 0],
                }
            ],
        ),
        [*DEEP, *within(5.5, 6.0, *DEEP)],
    ),
    Variation(
        "a target inside a capsule",
        mission(
            8, axes=3, rate=10, target={"position": ["-3+t", "0.1*t", 0]},
            obstacles=[
                {
                    "shape": "capsule",
                    "position": [1, 0.6, 0],
                    "size": [1.1, 1.3],
                    "orientation": [0, 1.2, 0.5],
                }
            ],
        ),
        [*DEEP, *within(2.9, 3.6, *DEEP)],
    ),
    Variation(
        "a target inside an ellipsoid",
        mission(
            8, axes=3, rate=10, target={"position": ["-4+t", "0.2", "0.3*sin(t)"], "radius": 0.1},
            obstacles=[
                {"shape": "ellipsoid", "position": [0, 0, 0], "size": [2.5, 1.2, 1.7], "orientation": 0.4}
            ],
        ),
        [*DEEP, *within(2.2, 2.7, *DEEP), *within(0, 0.9, *DEEP)],
    ),
    Variation(
        "a target inside a mesh in space",
        mission(
            8, axes=3, rate=10, target={"position": ["-4+t", "0.2", "0.1"], "radius": 0.1},
            obstacles=[
                {
                    "shape": "mesh",
                    "position": [0.3, 0, 0],
                    "vertices": [
                        [-2, -1, -1], [2, -1, -1.2], [1.8, 1.5, -1], [-1.5, 1.7, -0.9], [0.2, 0.1, 2.2],
                    ],
                    "orientation": [0.3, -0.2, 0.1],
                }
            ],
        ),
        [*DEEP, *within(2.2, 2.9, *DEEP)],
    ),
    Variation(
        "a target inside a thick wall in space",
        mission(
            9.3, axes=3, rate=1, target={"position": ["-4+t", 0, 5]},
            walls=[{"points": [[0, -8, 0], [1, 8, 0]], "thickness": 3, "height": 10, "name": "dike"}],
        ),
        [
            apart("target", "walls"), *touching("target", "dike", "penetration", "touch_time"),
            *within(0, 3.33, apart("target", "dike")),
        ],
    ),
    Variation(
        "a robot deep inside a ball and a moving block, metrics with bounds below 0",
        mission(
            0.06, axes=3, timestep=0.01, rate=50,
            robots=drifting([[-1.6, 0, 0], [0, 9, 0]], [[90, 0, 5], [60, -60, 0]], radius=0.05),
            obstacles=[
                {"position": [0, 0, 0], "radius": 1},
                {"shape": "box", "size": [1, 1, 1], "motion": {"position": [2, "7+t", 0]}},
            ],
        ),
        [OBSTACLES, apart("robots", "obstacles"), *touching("robots", "obstacles")],
    ),
    Variation(
        "a target jumps into a moving block",
        mission(
            2, axes=3, timestep=0.004, rate=12.5, target={"position": ["3*tanh(2000*(t-1.001))", 0, 0]},
            obstacles=[{"shape": "box", "size": [1, 2, 1.5], "motion": {"position": ["2.8", "0.2*t", 0]}}],
        ),
        [apart("target", "obstacles"), *touching("target", "obstacles"), *within(0, 1.0, *DEEP)],
    ),
    Variation(
        "far from turned shapes: more than a meter, and exact",
        mission(
            8, axes=3, rate=10, target={"position": ["-4+t", 0, 0]},
            obstacles=[
                {
                    "shape": "ellipsoid",
                    "position": [0, 2.9, 0],
                    "size": [2.5, 0.4, 0.7],
                    "orientation": 0.5,
                    "name": "egg",
                },
                {
                    "shape": "cylinder",
                    "position": [1, -2.8, 0.9],
                    "size": [0.9, 0.9],
                    "orientation": [0.7, 0.6, 0],
                    "name": "can",
                },
            ],
        ),
        [apart("target", "egg"), apart("target", "can"), apart("target", "obstacles"), NONE],
    ),
)  # fmt: skip
