"""Puts robots that are whole MJCF models into a world: their copies, and their poses at the start."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from xml.etree.ElementTree import Element, SubElement

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj.mjcf import section, set_attributes
from escort_mj.robots.drive import DEMANDS, THRUST
from escort_mj.robots.drive import controls as commanded
from escort_mj.robots.modeled import RobotModel
from escort_mj.scenario.geometry.placement import Placement
from escort_mj.scenario.schema.environment import Environment
from escort_mj.world.model.robot.flat import asset_copy, named_copy

Array = NDArray[np.float64]

DIGITS = 8  # of a model's digest before the names of its assets


def models_of(robots: Placement) -> list[RobotModel]:
    """The models of a team, each once."""
    models = map(robots.model, range(len(robots.kind)))
    return list({model.digest: model for model in models if model is not None}.values())


def add_assets(tree: Element, models: Iterable[RobotModel]) -> None:
    """Add meshes, materials and textures of models to a tree, under names of their own."""
    for model in models:
        section(tree, "asset").extend(
            asset_copy(each, model.digest[:DIGITS]) for each in model.sections["asset"]
        )


def add_model(
    tree: Element,
    model: RobotModel,
    name: str,
    place: Array,
    radius: float,
    color: Sequence[float],
    lag: float,
    gains: Array,
) -> None:
    """Add one robot with all that belongs to it.

    Args:
        tree: MJCF tree that receives it.
        model: What to copy.
        name: Of the robot: its outermost body is called so, and all else begins with it.
        place: Of the controlled point, shape (3,) [m]; the height of robots on the floor is their own.
        radius: Of the hull [m].
        color: Of the hull.
        lag: Of its motors [s].
        gains: Of its motors, over those of the file, shape (motors,).
    """
    assets, root = model.digest[:DIGITS], str(model.root.get("name"))
    body = named_copy(model.root, name, assets, root)
    section(tree, "worldbody").append(body)
    moved = place - np.array(model.start)
    if not model.drive.lifts:
        moved[2] = model.lifted
    set_attributes(body, pos=np.array(model.place[:3]) + moved, quat=model.place[3:])
    base = body
    if model.drive.base:
        base = next(each for each in body.iter("body") if each.get("name") == f"{name}/{model.drive.base}")
    hull = SubElement(
        base, "geom", name=f"{name}_body", type="sphere", contype="0", conaffinity="0", mass="0"
    )
    set_attributes(hull, size=radius, pos=model.drive.point, rgba=color)
    for tag, elements in model.sections.items():
        if tag != "asset":
            copies = [named_copy(each, name, assets, root) for each in elements]
            section(tree, tag).extend(copies)
            if tag == "actuator":
                _spoil([copies[int(row.control)] for row in model.drive.motors], lag, gains)


def _spoil(motors: Sequence[Element], lag: float, gains: Array) -> None:
    """Give motors their lag and the errors of their gains."""
    for motor, gain in zip(motors, gains, strict=True):
        if gain != 1.0:
            nominal, *others = map(float, motor.get("gainprm", "1").split())
            set_attributes(motor, gainprm=[gain * nominal, *others])
        if lag > 0.0:
            set_attributes(motor, dyntype="filterexact", dynprm=lag)


def own_geoms(tree: Element, robots: Placement) -> set[Element]:
    """The geoms of robots that are models: contact and drag are as their files say."""
    names = {f"robot_{i}" for i, kind in enumerate(robots.kind, 1) if kind.modeled}
    bodies = [body for body in section(tree, "worldbody") if body.get("name") in names]
    return {geom for body in bodies for geom in body.iter("geom")}


def add_media(tree: Element, models: Sequence[RobotModel], environment: Environment) -> None:
    """Add the medium that models ask for, unless the scenario says which there is."""
    if environment.medium.density > 0.0 or environment.medium.viscosity > 0.0 or not models:
        return
    density, viscosity = np.max([model.medium for model in models], axis=0)
    if density > 0.0 or viscosity > 0.0:
        set_attributes(section(tree, "option"), density=density, viscosity=viscosity)


def start_model(
    model: mujoco.MjModel,
    robot: RobotModel,
    name: str,
    velocity: Array,
    lift: float,
    start: mujoco.MjData,
) -> None:
    """Write a robot's start pose, motion, controls and what its motors make into those of the world.

    Args:
        model: The compiled world.
        robot: What the robot is.
        name: Of its outermost body.
        velocity: Of its controlled point, shape (p,) [m/s].
        lift: Force against its weight, made by motors that lag; 0 where they do not [N].
        start: Result: of the world.
    """
    root = model.body(name).id
    joints = np.flatnonzero(model.body_rootid[model.jnt_bodyid] == root)
    place, dof = int(model.jnt_qposadr[joints[0]]), int(model.jnt_dofadr[joints[0]])
    free = model.jnt_type[joints[0]] == mujoco.mjtJoint.mjJNT_FREE and model.jnt_bodyid[joints[0]] == root
    own = 7 if free else 0  # of a free joint: where its body stands
    start.qpos[place + own : place + len(robot.qpos)] = robot.qpos[own:]
    moving = np.array([*velocity, 0.0])[:3]
    start.qvel[dof : dof + robot.freedoms] = np.array(robot.way) @ moving
    first = next(
        (number for number in range(model.nu) if model.actuator(number).name.startswith(f"{name}/")), None
    )
    if first is not None:
        start.ctrl[first : first + robot.actuators] = robot.ctrl
        if lift > 0.0:
            demand = np.zeros(DEMANDS)
            demand[0 if robot.drive.mode == THRUST else 2] = lift
            for row, control in zip(robot.drive.inputs, commanded(robot.drive, demand), strict=True):
                start.act[model.actuator_actadr[first + int(row.control)]] = control
