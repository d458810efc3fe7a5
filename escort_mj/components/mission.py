"""What all components share of a mission: its numbers, its bodies, and where they are in truth."""

from __future__ import annotations

from typing import Annotated, Any

from escort_mj.components.setup import MissionSetup
from escort_mj.native.fields import Array, Fields, Recorded, Value


class MissionParameters(Fields):
    """What is given of the mission as a whole; n robots, p axes."""

    timestep: Annotated[float, Value("s", "of physics and control")]
    seed: Annotated[int, Value("1", "key of the random streams")]
    radius: Annotated[float, Value("m", "distance to keep from the target")]
    target_radius: Annotated[float, Value("m", "of the target; 0 without one")]
    max_speed: Annotated[float, Value("m/s", "largest reference speed; 1e300 for no limit")]
    target_feedforward: Annotated[
        bool, Value("1", "whether the target's velocity is added to the escort behaviors")
    ]
    robots: Annotated[int, Value("1", "number of robots, n")]
    robot_radius: Annotated[Array, "n", Value("m", "of each robot")]
    force_limit: Annotated[Array, "n", Value("N", "largest force per axis; 1e300 for no limit")]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        names = (
            "timestep",
            "seed",
            "radius",
            "max_speed",
            "target_feedforward",
            "robot_radius",
            "force_limit",
        )
        given = {name: getattr(setup, name) for name in names}
        return given | {"robots": setup.count, "target_radius": setup.target_radius or 0.0}


class MissionSignals(Fields):
    """The present state of physics and what acts on it; time comes first in every sample."""

    time: Annotated[Array, 1, Recorded("s", "time at which the law is evaluated")]
    q: Annotated[Array, "n", "p", Recorded("m", "true position of the robots")]
    v: Annotated[Array, "n", "p", Recorded("m/s", "true velocity of the robots")]
    qpos: Annotated[Array, "coordinates", Recorded("m or 1", "MuJoCo's generalized positions, for replay")]
    disturbance: Annotated[Array, "n", "p", Recorded("N", "disturbance force on the robots")]
    target_position: Annotated[Array, "p", Recorded("m", "position of the target")]
    target_velocity: Annotated[Array, "p", Recorded("m/s", "velocity of the target")]
    force: Annotated[
        Array,
        "n",
        "p",
        Recorded(
            "N",
            "force applied by the motors, after their limits; without the force that "
            "compensates a quadrotor's weight",
        ),
    ]


class DriveSignals(Fields):
    """What robots with drives of their own make of the law's demand; recorded where there are such robots."""

    drive_force: Annotated[
        Array,
        "driven",
        "p",
        Recorded(
            "N",
            "force commanded from the actuators, within their ranges; 0 where servos determine it",
        ),
    ]


class MissionState(Fields):
    """What the controller hands the motors."""

    command: Annotated[Array, "n", "p", Value("N", "force that the motors are asked for")]


def axis_names(axes: int) -> list[str]:
    """Names of so many axes: x, y, z, x4, x5 ..."""
    return ["x", "y", "z", *(f"x{k}" for k in range(4, axes + 1))][:axes]
