"""Drives of robots: how the law's demand becomes the controls of a robot's own actuators.

One formula for all: controls = clip(trim + mix w), where w is what is demanded of the robot's base, and what
comes out is effect times the actuators' forces. `Drive` says which w, `Input` holds the rows of one actuator.
What an actuator does to the base is computed from the compiled model (`world/model/drives.py`), never guessed
from names.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.native.kernels import inlined
from escort_mj.robots.attitude import Craft

Array = NDArray[np.float64]

FORCE, THRUST, RATE, POSITION = range(4)
"""What w is: force and torque; thrust along z and torque; velocity; way from the start."""
NAMES = ("force", "thrust", "velocity", "position")
DEMANDS = 6  # numbers of w at most


class RobotDrive(NamedTuple):
    """What the loop knows of one robot's drive; the rows of `Addresses.drives`."""

    mode: float  # FORCE, THRUST, RATE or POSITION
    body: float  # MuJoCo's number of the base
    root: float  # likewise, of the body that the robot hangs on
    first: float  # of its rows in `Addresses.inputs`
    size: float  # number of these
    point_x: float  # what the law controls, in the base's frame [m]
    point_y: float
    point_z: float
    in_world: float  # 1 where w is along the world's axes, 0 along the base's
    holds_attitude: float  # 1 where the base is kept upright; of a thrust: where it keeps its heading
    holds_height: float  # 1 where planar missions hold the height
    follow: float  # RATE: what part of the error of position is added to the velocity [1/s]
    stiffen: float  # RATE: likewise of the error of velocity [1]
    most_follow: float  # RATE: both together, at most [m/s]
    start_x: float  # POSITION: where w counts from [m]
    start_y: float
    start_z: float


(
    MODE, BODY, ROOT, FIRST, COUNT, POINT, _, _, IN_WORLD, HOLDS_ATTITUDE, HOLDS_HEIGHT, FOLLOW, STIFFEN,
    MOST_FOLLOW, START, _, _,
) = range(len(RobotDrive._fields))  # fmt: skip


class Input(NamedTuple):
    """One actuator that drives a robot; the rows of `Addresses.inputs`."""

    control: float  # its place among the robot's controls
    trim: float  # control where nothing is demanded
    low: float  # least control
    high: float  # largest
    gain: float  # its force for a control of 1; 0 where a servo makes the force
    mix_1: float  # control for a demand of 1, one by one
    mix_2: float
    mix_3: float
    mix_4: float
    mix_5: float
    mix_6: float
    effect_x: float  # force on the point for an actuator force of 1, in w's frame
    effect_y: float
    effect_z: float


INDEX, TRIM, LOW, HIGH, GAIN, MIX = range(6)
EFFECT = MIX + DEMANDS


@dataclass(frozen=True)
class DriveModel:
    """The drive of one robot as it was found, without places in MuJoCo's arrays.

    Attributes:
        mode: FORCE, THRUST, RATE or POSITION.
        found: What it is called: force, thrust, wheels, omni or velocity.
        point: What the law controls, in the base's frame, shape (3,) [m].
        inputs: The actuators that drive it.
        base: Name of the base's body; empty for the body that the robot hangs on.
        in_world: Whether the demand is along the world's axes.
        holds_attitude: Whether the base is kept upright; of a thrust: whether it keeps its heading.
        holds_height: Whether planar missions hold the height.
        lifts: Whether its weight is fed forward.
        craft: Attitude loop and height control, as for a height of 0; None without.
        follow: See `Drive`.
        stiffen: Likewise.
        most_follow: Likewise.
        limits: Largest force (where servos drive: velocity) along x, y and z that is always to be had, shape
            (3,) [N or m/s].
        bandwidth: Of what makes the force or velocity [rad/s]; inf where it is made at once.
        effective_mass: That the law moves, along x, y and z of the base, shape (3,) [kg].
    """

    mode: int
    found: str
    point: tuple[float, ...]
    inputs: tuple[Input, ...]
    base: str = ""
    in_world: bool = False
    holds_attitude: bool = False
    holds_height: bool = False
    lifts: bool = False
    craft: Craft | None = None
    follow: float = 0.0
    stiffen: float = 0.0
    most_follow: float = 0.0
    limits: tuple[float, ...] = (np.inf, np.inf, np.inf)
    bandwidth: float = np.inf
    effective_mass: tuple[float, ...] = (0.0, 0.0, 0.0)

    def row(self, body: int, root: int, first: int, start: Sequence[float]) -> RobotDrive:
        """Return what the loop is given.

        Args:
            body: MuJoCo's number of the base.
            root: Likewise, of the body that the robot hangs on.
            first: Of its rows among all inputs.
            start: Where the robot starts, along the mission's axes [m].
        """
        numbers = [self.mode, body, root, first, len(self.inputs), *self.point, self.in_world]
        numbers += [self.holds_attitude, self.holds_height, self.follow, self.stiffen, self.most_follow]
        return RobotDrive(*map(float, [*numbers, *[*start, 0.0][:3]]))

    @property
    def motors(self) -> tuple[Input, ...]:
        """The actuators that are motors; servos are none."""
        return tuple(row for row in self.inputs if row.gain > 0.0)

    @property
    def pushes(self) -> bool:
        """Whether the law's force is what is demanded; otherwise its reference."""
        return self.mode in (FORCE, THRUST)


@inlined
def past_dead_zone(command: float, zone: float) -> float:
    """What is left of a command behind a motor's dead zone [N]."""
    return command - min(max(command, -zone), zone)


@inlined
def controls_for(demand: Array, demands: int, inputs: Array, first: int, count: int, controls: Array) -> None:
    """Controls of a robot's actuators, within their ranges.

    Args:
        demand: w, shape (6,).
        demands: How many of its numbers count.
        inputs: Rows of `Input`.
        first: The robot's first row.
        count: How many it has.
        controls: Result, the robot's controls; those of other actuators are left alone.
    """
    for j in range(first, first + count):
        control = inputs[j, TRIM]
        for k in range(demands):
            control += inputs[j, MIX + k] * demand[k]
        controls[int(inputs[j, INDEX])] = min(max(control, inputs[j, LOW]), inputs[j, HIGH])


@inlined
def thrust_within(demand: Array, inputs: Array, first: int, count: int) -> float:
    """The thrust nearest to that demanded for which no actuator leaves its range, torque coming first.

    Arguments as of `controls_for`; the demand is a thrust and three torques.
    """
    least, most = -1e300, 1e300
    for j in range(first, first + count):
        share = inputs[j, MIX]
        if share == 0.0:
            continue
        control = inputs[j, TRIM]
        for k in range(1, 4):
            control += inputs[j, MIX + k] * demand[k]
        one, other = (inputs[j, LOW] - control) / share, (inputs[j, HIGH] - control) / share
        least, most = max(least, min(one, other)), min(most, max(one, other))
    return max(min(demand[0], most), least)


def controls(model: DriveModel, demand: Array) -> Array:
    """Controls for a demand w, within the actuators' ranges, shape (inputs,).

    Args:
        model: The drive.
        demand: w, shape (6,).
    """
    table = np.array(model.inputs)
    trim, low, high, mix = table[:, TRIM], table[:, LOW], table[:, HIGH], table[:, MIX : MIX + DEMANDS]
    demand = np.array(demand, dtype=float)
    if model.mode == THRUST:
        bare, share = trim + mix[:, 1:4] @ demand[1:4], mix[:, 0]
        pushing = share != 0.0
        ends = np.sort([(edge - bare)[pushing] / share[pushing] for edge in (low, high)], axis=0)
        demand[0] = max(min(demand[0], ends[1].min()), ends[0].max())
        demand[4:] = 0.0
    return np.asarray(np.clip(trim + mix @ demand, low, high))
