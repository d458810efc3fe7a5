"""Bodies are fast for a moment, between two samples."""

from tests.independent.missions import (
    COUNT,
    NONE,
    ROBOTS,
    TUNNELING,
    Variation,
    apart,
    drifting,
    mission,
    touching,
    within,
)

SPEED = (
    Variation(
        "a target jumps in space between two samples",
        mission(
            8, axes=3, target={"position": ["4*tanh(1000*(t-5.01))", 1, 0], "radius": 0.1},
            robots=drifting([[0, 0, 0], [0, 3, 0]], radius=0.05),
        ),
        [*TUNNELING, *within(0, 4.9, *TUNNELING), apart("robots", "target"), NONE],
    ),
    Variation(
        "a target in four axes that every sample sees at rest",
        mission(
            3, axes=4, target={"position": ["2*cos(2*pi*50*t)", 0, 0, 0], "radius": 0.1},
            robots=drifting([[0, 0.5, 0, 0], [0, 3, 0, 0]], radius=0.05),
        ),
        [*TUNNELING, apart("robots", "target"), NONE],
    ),
    Variation(
        "a cart that every sample sees at rest",
        mission(
            2.5, rate=4, timestep=0.005,
            robots=drifting([[0, 3], [0, 6]]),
            obstacles=[{"name": "cart", "radius": 0.05, "motion": {"position": ["0.9*cos(2*pi*4*t)", 0]}}],
        ),
        [*TUNNELING, apart("robots", "cart")],
    ),
    Variation(
        "waypoints passed in haste after the last sample",
        mission(
            4.9, rate=0.25, timestep=0.005,
            target={
                "interpolation": "smooth",
                "radius": 0.1,
                "waypoints": [
                    {"time": 0, "position": [0, 3]}, {"time": 4.5, "position": [0, 4]},
                    {"time": 4.6, "position": [8, 4]},
                ],
            },
            robots=drifting([[0, 0], [9, 0]]),
        ),
        [*TUNNELING, *within(0, 4.2, *TUNNELING), apart("robots", "target")],
    ),
    Variation(
        "a zigzag with kinks, barely too slow to pass unseen",
        mission(
            3, rate=1, target={"position": ["0.4*t", "49*abs(t-1.5)"], "radius": 0.2},
            robots=drifting([[5, 0], [5, 3]], radius=0.05),
        ),
        [*TUNNELING, *within(0.5, 1.4, *TUNNELING)],
    ),
    Variation(
        "a zigzag with kinks, barely fast enough",
        mission(
            3, rate=1, target={"position": ["0.4*t", "50.2*abs(t-1.5)"], "radius": 0.2},
            robots=drifting([[5, 0], [5, 3]], radius=0.05),
        ),
        TUNNELING,
    ),
    Variation(
        "a thin wall and a target that sprints once",
        mission(
            5, rate=2, target={"position": ["0.3*t", "0.3*tanh(20*(t-2.25))"], "radius": 0.2},
            walls=[{"points": [[-4, 3], [4, 3]], "thickness": 0.01}],
        ),
        [*TUNNELING, *within(0, 1.9, *TUNNELING), *within(2.2, 2.3, *TUNNELING)],
    ),
    Variation(
        "robots that fly at each other",
        mission(
            0.1, axes=3, timestep=0.01, rate=12.5,
            robots=drifting([[-9, 0, 0], [9, 3, 0]], [[60, 0, 0], [-60, 10, 0]], radius=0.5),
        ),
        [*TUNNELING, ROBOTS],
    ),
    Variation(
        "a free target that is driven in a hurry",
        mission(
            2, timestep=0.005, rate=2,
            target={"position": ["tanh(60*(t-0.75))", 0], "radius": 0.1, "body": {"mass": 2, "gain": 50}},
            robots=drifting([[0.2, 1.5], [0, 5]], radius=0.2),
        ),
        [*TUNNELING, *within(0, 0.6, *TUNNELING), apart("robots", "target")],
    ),
    Variation(
        "a target that is thrown at a robot and stops",
        mission(
            2, timestep=0.004, rate=5, target={"position": ["min(0, 9*(t-1.03))", "max(0, 4*(t-1.5))"]},
            robots=drifting([[0.55, 0], [0, 5]], radius=0.2),
        ),
        [*TUNNELING, NONE, COUNT, *touching("robots", "target", "penetration"), apart("robots", "target")],
    ),
    Variation(
        "a tilted slab, thinner than anything along an axis",
        mission(
            3, axes=3, rate=10, target={"position": ["-20+14*t", 0, 0], "radius": 0.1},
            obstacles=[
                {
                    "shape": "mesh",
                    "position": [3, 0, 0],
                    "vertices": [
                        [x + 0.01 * s, x - 0.01 * s, z] for x in (-1, 1) for s in (-1, 1) for z in (-1, 1)
                    ],
                }
            ],
        ),
        [*TUNNELING, *touching("target", "obstacles", "touch_time")],
    ),
)  # fmt: skip
