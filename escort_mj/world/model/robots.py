"""The robots of a world: bodies and motors of every kind, from the hand-written parts in `models/`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any
from xml.etree.ElementTree import Element, SubElement

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj import palette
from escort_mj.components.mission import axis_names
from escort_mj.errors import PluginError
from escort_mj.mjcf import child_named, copied, names_in_copy, section, set_attributes
from escort_mj.plugin_calls import is_plugins
from escort_mj.robots.kind import FREE_COORDINATES, Motor, RobotKind
from escort_mj.scenario.geometry.placement import Placement
from escort_mj.world.model.parts import part_of, place_of
from escort_mj.world.model.robot.placing import add_model, start_model
from escort_mj.world.stages import IN_SPACE, THIN, Stage, robot_steps

Array = NDArray[np.float64]

HULL_OPACITY = 0.12  # of the sphere around robots that show themselves
RAIL = [0.72, 0.74, 0.77, 1.0]
ROUNDING = 1e-6
JOINTS = ("joint", "freejoint")
COORDINATES = {"freejoint": FREE_COORDINATES, "free": FREE_COORDINATES, "ball": 4}  # of others 1


def add_robots(
    tree: Element,
    robots: Placement,
    gravity: Sequence[float],
    stages: list[Stage],
    radius: float,
    colors: Sequence[palette.Color],
) -> None:
    """The bodies of each robot, one for each stage, and its motors.

    Args:
        tree: MJCF tree that receives them; robots come before every other body.
        robots: What they are.
        gravity: World frame, shape (3,) [m/s^2].
        stages: Where the axes of the mission are.
        radius: Distance to keep from the target [m].
        colors: Of each robot.
    """
    count, world = len(robots.mass), section(tree, "worldbody")
    for i, (steps, position) in enumerate(zip(robot_steps(count), robots.position, strict=True)):
        for stage in stages:
            _add_body(tree, robots, i, stage, stage.place(position, steps), gravity, colors[i])
            if stage.is_abacus:
                _add_rail(world, f"robot_{i + 1}_rail", stage, steps, radius)


def add_start(tree: Element, model: mujoco.MjModel, robots: Placement, gravity: Sequence[float]) -> bool:
    """A keyframe with what does not start at rest: robots that move, and rotors that lag and already turn.

    Args:
        tree: MJCF tree that receives it.
        model: Compiled from it.
        robots: What they are.
        gravity: World frame, shape (3,) [m/s^2].

    Returns:
        Whether there is one.
    """
    start = mujoco.MjData(model)
    pose, speeds, controls, activations = start.qpos, start.qvel, start.ctrl, start.act
    for i, (kind, velocity) in enumerate(zip(robots.kind, robots.velocity, strict=True)):
        own = robots.model(i)
        if own is not None:
            lagging = own.drive.lifts and robots.actuators[i].lag > 0.0
            lift = kind.lift(float(robots.mass[i]), gravity)[2] if lagging else 0.0
            start_model(model, own, f"robot_{i + 1}", velocity, lift, start)
            continue
        dof = model.jnt_dofadr[model.body(f"robot_{i + 1}").jntadr[0]]
        speeds[dof : dof + len(velocity)] = velocity
        rates = kind.start_rates(velocity, float(robots.radius[i]))
        speeds[dof + len(velocity) : dof + len(velocity) + len(rates)] = rates
        if robots.actuators[i].lag > 0.0:
            for motor in _free_motors(robots, i, gravity):
                if motor.limits is not None:
                    activations[model.actuator(f"robot_{i + 1}_{motor.name}").actadr[0]] = motor.start
    moving = bool(speeds.any() or activations.any() or controls.any() or (pose != model.qpos0).any())
    if moving:
        key = SubElement(section(tree, "keyframe"), "key", name="start")
        set_attributes(key, qpos=pose, qvel=speeds, act=activations)
        if controls.any():
            set_attributes(key, ctrl=controls)
    return moving


def _add_body(
    tree: Element,
    robots: Placement,
    i: int,
    stage: Stage,
    place: Array,
    gravity: Sequence[float],
    color: palette.Color,
) -> None:
    """One body of a robot with its motors; every body has all of the robot's mass."""
    kind, radius = robots.kind[i], float(robots.radius[i])
    name = f"robot_{i + 1}{stage.suffix}"
    own = robots.model(i)
    if own is not None:
        hull = [*color, HULL_OPACITY]
        add_model(tree, own, name, place, radius, hull, robots.actuators[i].lag, robots.gains[i])
        return
    unused = tuple(set("xyz") - set(stage.directions))
    body = copied(child_named(part_of(kind), "body", "robot"), name, skip=unused)
    section(tree, "worldbody").append(body)
    set_attributes(body, pos=[*place[:2], radius] if kind.rolls else place)
    set_attributes(child_named(body, "geom", f"{name}_body"), size=radius, rgba=[*color, kind.opacity])
    for painted in kind.painted:
        set_attributes(child_named(body, "geom", f"{name}_{painted}"), rgba=[*color, 1.0])
    _shape(body, name, kind, float(robots.mass[i]), radius, len(robots.position[i]))
    for geom in body.iter("geom"):
        set_attributes(geom, group=stage.number)
    _place_slides(body, stage, robots, i)
    if motors := _free_motors(robots, i, gravity):
        _add_free_motors(tree, motors, robots, i)
    else:
        _add_motors(tree, body, stage, robots, i)


def _place_slides(body: Element, stage: Stage, robots: Placement, i: int) -> None:
    """Have joints that slide along the axes of a stage measure positions in the mission."""
    slides = {joint.get("name"): joint for joint in body if joint.tag == "joint"}
    names = axis_names(robots.position.shape[1])[stage.axes]
    for direction, name, start in zip(stage.directions, names, robots.position[i][stage.axes], strict=True):
        joint = slides.get(f"{body.get('name')}_{direction}")
        if joint is not None:
            set_attributes(joint, name=f"robot_{i + 1}_{name}", ref=start)


def _add_motors(tree: Element, body: Element, stage: Stage, robots: Placement, i: int) -> None:
    """One motor for each axis of a stage."""
    part = part_of(robots.kind[i])
    axes, names = np.arange(robots.position.shape[1])[stage.axes], axis_names(robots.position.shape[1])
    free = child_named(part, "body", "robot").find("freejoint") is not None
    for direction, axis in zip(stage.directions, axes, strict=True):
        motor, name = child_named(part, "motor", direction), f"robot_{i + 1}_{names[axis]}"
        limit = float(robots.force_limit[i])
        joint = f"{body.get('name')}_{motor.get('joint')}" if free else name
        where = {"joint": joint, "gear": motor.get("gear", "1")}
        _add_motor(tree, name, robots, i, axis, (-limit, limit), **where)


def _free_motors(robots: Placement, i: int, gravity: Sequence[float]) -> tuple[Motor, ...]:
    """The motors of a robot on its free joint; none where there is one for each axis."""
    return robots.kind[i].free_motors(float(robots.mass[i]), float(robots.radius[i]), gravity)


def _add_free_motors(tree: Element, motors: Sequence[Motor], robots: Placement, i: int) -> None:
    """Motors of a kind's own, in their order, each where its part has it."""
    part, name = part_of(robots.kind[i]), f"robot_{i + 1}"
    names = names_in_copy(child_named(part, "body", "robot"), name)
    for number, motor in enumerate(motors):
        own = child_named(part, "motor", motor.name)
        where: dict[str, Any] = {
            key: names[own.attrib[key]] for key in ("joint", "site") if key in own.attrib
        }
        where["gear"] = own.get("gear", "1") if motor.gear is None else motor.gear
        if motor.limits is None:
            plain = SubElement(section(tree, "actuator"), "motor", name=f"{name}_{motor.name}")
            set_attributes(plain, **where)
        else:
            _add_motor(tree, f"{name}_{motor.name}", robots, i, number, motor.limits, **where)


def _add_motor(
    tree: Element,
    name: str,
    robots: Placement,
    i: int,
    number: int,
    limits: tuple[float, float],
    **where: Any,
) -> None:
    """A motor with its lag and gain; what lags is commanded no more than the limit, or it would wind up."""
    lag = robots.actuators[i].lag
    motor = SubElement(section(tree, "actuator"), "general", name=name)
    set_attributes(motor, gainprm=robots.gains[i][number], **where)
    if lag > 0.0:
        set_attributes(motor, dyntype="filterexact", dynprm=lag)
    if np.isfinite(limits).all():
        set_attributes(motor, forcerange=limits)
        if lag > 0.0:
            set_attributes(motor, ctrlrange=limits)


def _shape(body: Element, name: str, kind: RobotKind, mass: float, radius: float, axes: int) -> None:
    """Have a kind give its body sizes and masses.

    Raises:
        PluginError: If it raises an error, or has other coordinates than it says.
    """
    parts = {"robot": body}
    for part in body.iter():
        parts.setdefault(part.get("name", part.tag).removeprefix(f"{name}_"), part)
    kind.weigh(parts, mass, radius)
    kind.shape(parts, radius)
    for part in body.iter():
        if wrong := [key for key, value in part.attrib.items() if not isinstance(value, str)]:
            words = f"shape() sets {wrong[0]} of a {part.tag} to {part.attrib[wrong[0]]!r}, which is no text"
            raise PluginError(f"the kind {kind.kind}: {words}")
    types = [joint.get("type", joint.tag) for joint in body.iter() if joint.tag in JOINTS]
    found = sum(COORDINATES.get(each, 1) for each in types)
    if axes <= IN_SPACE and found != kind.coordinates(axes):
        raise PluginError(
            f"the kind {kind.kind}: its joints have {found} coordinates in {axes} axes, and coordinates() "
            f"says {kind.coordinates(axes)}"
        )


def check_hulls(model: mujoco.MjModel, robots: Placement) -> None:
    """Make sure that the hulls of plugins' kinds are where their coordinates say, and as large as is said.

    Args:
        model: A compiled world of at most three axes.
        robots: What they are.

    Raises:
        PluginError: If one is not: clearances would be those of another sphere.
    """
    slide, sphere = int(mujoco.mjtJoint.mjJNT_SLIDE), int(mujoco.mjtGeom.mjGEOM_SPHERE)
    for i, (kind, radius) in enumerate(zip(robots.kind, robots.radius, strict=True)):
        if kind.modeled or not is_plugins(type(kind)):
            continue
        body, hull = model.body(f"robot_{i + 1}"), model.geom(f"robot_{i + 1}_body")
        own = slice(body.jntadr[0], body.jntadr[0] + min(body.jntnum[0], robots.position.shape[1]))
        ways = model.jnt_axis[own].copy()
        for way in ways:
            mujoco.mju_rotVecQuat(way, way.copy(), body.quat)
        words = ""
        if hull.type[0] != sphere or abs(hull.size[0] - radius) > ROUNDING * radius:
            words = f"its hull, the geom body, is no sphere with the robot's radius, which is {radius:g} m"
        elif hull.bodyid[0] != body.id or np.abs(hull.pos).max() > ROUNDING * radius:
            words = "its hull, the geom body, is not at the center of the body robot"
        elif (model.jnt_type[own] == slide).all() and np.abs(ways - np.eye(3)[: len(ways)]).max() > ROUNDING:
            words = "its joints x, y and z do not slide along the axes of these names"
        if words:
            raise PluginError(f"{place_of(kind)}: {words}")


def _add_rail(world: Element, name: str, stage: Stage, robot: float, radius: float) -> None:
    """The column of an abacus along which a robot's body slides, only to be seen."""
    foot, top = stage.place_at(stage.low[2], robot), stage.place_at(stage.high[2], robot)
    rail = SubElement(world, "geom", name=name, type="capsule")
    set_attributes(rail, fromto=[*foot, *top], size=THIN * radius, rgba=RAIL, group=stage.number)
