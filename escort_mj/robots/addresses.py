"""Where the robots of a mission are in MuJoCo's arrays, and what each is like, as kernels read it."""

from __future__ import annotations

from typing import Annotated

from escort_mj.native.fields import Array, Fields, Value
from escort_mj.robots.attitude import ROTORS, Craft
from escort_mj.robots.drive import Input
from escort_mj.robots.drive import RobotDrive as DriveRow
from escort_mj.robots.hydrodynamics import Vessel


class Addresses(Fields):
    """Where things are in MuJoCo's arrays, for n robots, p axes and so many geoms."""

    qpos_address: Annotated[Array, "n", Value("1", "first position coordinate of each robot")]
    dof_address: Annotated[Array, "n", Value("1", "first velocity coordinate of each robot")]
    tree_end: Annotated[
        Array, "n", Value("1", "one past the last velocity coordinate of each robot's kinematic tree")
    ]
    target_address: Annotated[Array, "p", Value("1", "of each of the target's coordinates in `mocap_pos`")]
    target_offset: Annotated[Array, "p", Value("m", "what is added to it there")]
    target_radius: Annotated[float, Value("m", "of the target; 0 where there is none")]
    in_row: Annotated[
        bool,
        Value("1", "whether robots' coordinates and motors come first, in order, and motors are plain"),
    ]
    motor_address: Annotated[Array, "n", Value("1", "first motor of each robot")]
    dead_zone: Annotated[Array, "n", Value("N", "force that each command loses")]
    lift: Annotated[
        Array, "n", 3, Value("N", "force fed forward against a flying robot's weight, world frame")
    ]
    pilot: Annotated[Array, "n", Value("1", "row in `crafts` of each robot that flies, else -1")]
    crafts: Annotated[Array, "flying", len(Craft._fields), Value("1", "see `robots/attitude.py`")]
    rotor_gain: Annotated[Array, "flying", ROTORS, Value("1", "of each rotor's motor")]
    rotor_state: Annotated[Array, "flying", Value("1", "first activation of rotors that lag, else -1")]
    base: Annotated[Array, "n", Value("1", "body whose x axis is each robot's heading")]
    drive: Annotated[
        Array, "n", Value("1", "row in `drives` of each robot with actuators of its own, else -1")
    ]
    drives: Annotated[Array, "driven", len(DriveRow._fields), Value("1", "see `robots/drive.py`")]
    inputs: Annotated[Array, "inputs", len(Input._fields), Value("1", "likewise, of all drives")]
    vessel_robot: Annotated[Array, "afloat", Value("1", "which robot each vessel is")]
    vessels: Annotated[Array, "afloat", len(Vessel._fields), Value("1", "see `robots/hydrodynamics.py`")]
    geom_body: Annotated[
        Array, "geoms", Value("1", "which of the mission's bodies each geom belongs to, -1 for none")
    ]
    robot_geom: Annotated[
        Array, "seers", Value("1", "geom of each robot, and last of the target, -1 for none")
    ]
    obstacle_geom: Annotated[Array, "m", Value("1", "geom of each obstacle")]
    faces: Annotated[
        Array,
        "faces",
        5,
        Value("1 or m", "of meshes: obstacle, outward normal, offset in the geom's axes"),
    ]
    parts: Annotated[
        Array, "parts", Value("1", "geoms of each robot that can touch others, robot by robot; see part_span")
    ]
    part_span: Annotated[
        Array,
        "spanned",
        3,
        Value(
            "1, 1, m", "first of a robot's parts, their number, radius of the sphere they never leave or -1"
        ),
    ]
    limbs: Annotated[
        Array,
        "limbs",
        4,
        Value("1, 1, 1, m", "robot, body, the robot's root, reach of its parts from the center of mass"),
    ]
    mover_qpos: Annotated[Array, "movers", Value("1", "first position coordinate of what moves by itself")]
    mover_dof: Annotated[Array, "movers", Value("1", "and its first velocity coordinate")]
