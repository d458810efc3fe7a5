"""What happens between two samples, after the last one, or where a window's edge lies between two."""

from tests.independent.missions import (
    COUNT,
    NONE,
    OBSTACLES,
    ROBOTS,
    SWEPT,
    Variation,
    apart,
    drifting,
    mission,
    touching,
    within,
)

TIME = (
    Variation(
        "a target sweeps a row of robots between two samples 10 s apart",
        mission(
            17.77, rate=0.1, timestep=0.005,
            target={"position": ["2*t", "0.2*sin(3*t)"]},
            robots=drifting([[5, 0.3], [11, -0.4], [25, 3]]),
        ),
        SWEPT,
    ),
    Variation(
        "two robots meet in space after the last sample",
        mission(
            4.013, axes=3, robots=drifting([[-2.204, 0, 0.1], [2.204, 0, 0.1]], [[0.5, 0, 0], [-0.5, 0, 0]])
        ),
        [NONE, COUNT, ROBOTS, apart("robots", "robots"), *touching("robots", "robots")],
    ),
    Variation(
        "two robots meet in four axes 2 s after the last sample",
        mission(
            7.3, axes=4, rate=0.2,
            robots=drifting([[-1, 0, 0, -3.96], [-1, 0, 0, 3.5]], [[0, 0, 0, 0.5], [0, 0, 0, -0.5]]),
        ),
        [NONE, COUNT, ROBOTS, *touching("robots", "robot_2", "touch_time", "penetration")],
    ),
    Variation(
        "robots pass each other, nearest between two samples and beyond a window's end",
        mission(10, rate=1, robots=drifting([[-3.6, 0.3], [3.2, -0.3]], [[1, 0], [-0.7, 0]])),
        [*within(2.0, 3.97, ROBOTS, apart("robots", "robots")), *within(0.5, 4.45, ROBOTS), ROBOTS],
    ),
    Variation(
        "robots part, and a window begins between two samples",
        mission(
            6, axes=3, rate=0.5, robots=drifting([[0, 0, 0], [0.7, 0, 0]], [[-0.1, 0, 0], [0.2, 0.1, 0]])
        ),
        [*within(2.345, 5.0, ROBOTS), *within(3.9991, 5.9, apart("robot_1", "robot_2")), ROBOTS],
    ),
    Variation(
        "a window that no sample is in, of a target that swings",
        mission(
            8, rate=1, target={"position": ["1.5*sin(2*pi*t/1.7)", "0.7"]},
            robots=drifting([[0.3, 0], [4, 4]]),
        ),
        [
            *within(3.11, 3.29, apart("robots", "target"), NONE),
            *within(4.2503, 4.9707, apart("robot_1", "target"), COUNT),
            *SWEPT,
        ],
    ),
    Variation(
        "a window cuts touches in four axes",
        mission(
            9, axes=4, rate=0.5, target={"position": ["-3+1.5*t", 0, 0, "0.1*t"]},
            obstacles=[
                {"position": [1, 0.2, 0, 0], "radius": 0.6, "name": "rock"},
                {"position": [6, 0, 0.3, 0.8], "radius": 0.5, "name": "stone"},
            ],
        ),
        [
            *within(2.6, 5.9, *touching("target", "rock", "touch_time"), COUNT, apart("target", "rock")),
            *within(0.0, 1.9, NONE, apart("target", "obstacles")),
            *within(4.1, 5.1, NONE, COUNT, apart("target", "obstacles")),
        ],
    ),
    Variation(
        "a robot passes a wall's end, in windows between physics steps",
        mission(
            3.333, rate=2.5, walls=[{"points": [[-6, 0], [0, 0]], "name": "wall"}],
            robots=drifting([[-2, 1.2], [9, 9]], [[1.3, -0.5], [0, 0]]),
        ),
        [
            *within(1.111, 2.2222, apart("robots", "wall"), apart("robots", "robots")),
            *within(1.7, 2.0511, apart("robots", "walls")),
            apart("robots", "walls"),
            NONE,
        ],
    ),
    Variation(
        "an obstacle comes by a robot between samples",
        mission(
            5.55, axes=3, rate=4, timestep=0.01, robots=drifting([[0, 0, 0], [0, 8, 0]]),
            obstacles=[
                {
                    "name": "cart",
                    "radius": 0.4,
                    "motion": {
                        "waypoints": [
                            {"time": 0, "position": [-4, 1, 0]},
                            {"time": 2.1, "position": [0.4, 0.3, 0.9]},
                            {"time": 4.8, "position": [3, -2, 0.5]},
                        ],
                        "interpolation": "smooth",
                    },
                }
            ],
        ),
        [
            apart("robots", "cart"), OBSTACLES, NONE,
            *within(1.23, 2.06, apart("robots", "obstacles"), OBSTACLES),
        ],
    ),
    Variation(
        "a team at work, one sample a second",
        mission(
            12.34, rate=1,
            target={"position": ["0.4*t", "0.5*sin(0.4*t)"]},
            robots={"count": 5},
            mission={"radius": 2.5},
            obstacles=[
                {"position": [4, 2.2], "radius": 0.5},
                {"shape": "box", "position": [3, -3], "size": [0.4, 0.6], "orientation": 0.4},
            ],
        ),
        [
            ROBOTS, OBSTACLES, apart("robots", "target"), apart("robots", "obstacles"),
            *within(2.71, 6.13, ROBOTS, OBSTACLES, apart("robots", "target")),
            *within(7.501, 7.899, ROBOTS, OBSTACLES, apart("robots", "obstacle_2")),
        ],
    ),
)  # fmt: skip
