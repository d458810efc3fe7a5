"""IR-SIM: kinematic robots in the plane; overlaps are resolved as contacts of rigid bodies after each step.

Modes: `velocities`, told by a vectorized go-to-place law; `rvo`, its own reciprocal velocity obstacles.
"""

from __future__ import annotations

import tempfile
from importlib.metadata import version

import irsim
import numpy as np
import stage
import yaml
from flight import Flight, serve

TIMESTEP, GAIN, LIMIT = 0.1, 1.0, 2.0  # its own default [s]; of the law [1/s]; largest speed [m/s]


def world(mode: str, n: int) -> dict:
    """Its scene."""
    start = stage.places(n, 2) + stage.target(0.0, n, 2)[0]
    robot = {
        "kinematics": {"name": "omni"},
        "shape": {"name": "circle", "radius": stage.RADIUS},
        "vel_max": [LIMIT, LIMIT],
        "vel_min": [-LIMIT, -LIMIT],
    }
    own = (
        {"behavior": {"name": "rvo", "vxmax": LIMIT, "vymax": LIMIT, "accer": 10.0}} if mode == "rvo" else {}
    )
    spread = float(stage.radius(n, 2)) + 20.0
    return {
        "world": {
            "step_time": TIMESTEP,
            "width": 2 * spread,
            "height": 2 * spread,
            "offset": [-spread, -spread],
            "collision_mode": "contact",
        },
        "robot": [
            robot | own | {"state": [*map(float, place), 0.0], "goal": [*map(float, place), 0.0]}
            for place in start
        ],
        "obstacle": [
            {
                "shape": {"name": "circle", "radius": stage.OBSTACLE_RADIUS},
                "state": [*map(float, center), 0.0],
            }
            for center in stage.obstacles(n, 2)
        ],
    }


def fly(mode: str, n: int) -> Flight:
    """The mission of n robots."""
    with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
        yaml.safe_dump(world(mode, n), file)
        file.flush()
        env = irsim.make(file.name, headless=True, log_level="ERROR")
    robots, places, everyone, done = env.robot_list, stage.places(n, 2), list(range(n)), 0

    def position() -> np.ndarray:
        return np.array([robot.state[:2, 0] for robot in robots])

    def step(count: int) -> None:
        nonlocal done
        for _ in range(count):
            center, drift = stage.target(done * TIMESTEP, n, 2)
            if mode == "rvo":
                for robot, place in zip(robots, center + places, strict=True):
                    robot.set_goal([place[0], place[1], 0.0])
                env.step()
            else:
                velocity = np.clip(drift + GAIN * (center + places - position()), -LIMIT, LIMIT)
                env.step(list(velocity[:, :, None]), everyone)
            done += 1

    def error() -> float:
        goal = stage.target(done * TIMESTEP, n, 2)[0] + places
        return float(np.linalg.norm(position() - goal, axis=1).mean())

    return Flight(step, error, TIMESTEP, n, version("ir-sim"))


if __name__ == "__main__":
    serve(fly)
