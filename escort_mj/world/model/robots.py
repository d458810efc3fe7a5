"""The robots of a world: bodies and motors of every kind, from the hand-written parts in `models/`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any
from xml.etree.ElementTree import Element, SubElement

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj import palette
from escort_mj.control.custom.place import place_of
from escort_mj.errors import PluginError
from escort_mj.scenario.geometry.placement import Team
from escort_mj.scenario.schema.kinds import ROTORS, Loaded, Quadrotor, RobotKind, Slung
from escort_mj.signals import axis_names
from escort_mj.world.model.parts import copied, load_part, named, part_of, section, write
from escort_mj.world.stages import IN_SPACE, THIN, Stage, robot_steps

Array = NDArray[np.float64]

RAIL = [0.72, 0.74, 0.77, 1.0]
GLASS = 0.3  # alpha of a hull that something is to be seen in
THRUSTS = ("thrust_x", "thrust_y", "thrust_z")
LOAD, CABLE, HUB, ROTOR = 0.3, 0.06, 0.3, 0.28  # sizes of what is seen of a robot, of its radius
TOUCHABLE = 1  # contype of what robots, obstacles and target are


def add_robots(
    tree: Element, robots: Team, gravity: Sequence[float], stages: list[Stage], radius: float
) -> None:
    """The bodies of each robot, one for each stage, and its motors.

    Args:
        tree: MJCF tree that receives them; robots come before every other body.
        robots: What they are.
        gravity: World frame, shape (3,) [m/s^2].
        stages: Where the axes of the mission are.
        radius: Distance to keep from the target [m].
    """
    count, world = len(robots.mass), section(tree, "worldbody")
    for i, (steps, position) in enumerate(zip(robot_steps(count), robots.position, strict=True)):
        for stage in stages:
            _add_body(tree, robots, i, stage, stage.place(position, steps), gravity)
            if stage.is_abacus:
                _add_rail(world, f"robot_{i + 1}_rail", stage, steps, radius)


def add_start(tree: Element, model: mujoco.MjModel, robots: Team, gravity: Sequence[float]) -> bool:
    """A keyframe with what does not start at rest: robots that move, and rotors that lag and already turn.

    Args:
        tree: MJCF tree that receives it.
        model: Compiled from it.
        robots: What they are.
        gravity: World frame, shape (3,) [m/s^2].

    Returns:
        Whether there is one.
    """
    speeds, activations = np.zeros(model.nv), np.zeros(model.na)
    for i, (kind, velocity) in enumerate(zip(robots.kind, robots.velocity, strict=True)):
        dof = model.jnt_dofadr[model.body(f"robot_{i + 1}").jntadr[0]]
        speeds[dof : dof + len(velocity)] = velocity
        if kind.rolls:
            speeds[dof + 3 : dof + 5] = np.array([-velocity[1], velocity[0]]) / robots.radius[i]
        if isinstance(kind, Quadrotor) and robots.actuators[i].lag > 0.0:
            rotors = [
                model.actuator(f"robot_{i + 1}_rotor_{number}").actadr[0] for number in range(1, ROTORS + 1)
            ]
            activations[rotors] = kind.lift(robots.mass[i], gravity)[2] / ROTORS
    moving = bool(speeds.any() or activations.any())
    if moving:
        key = SubElement(section(tree, "keyframe"), "key", name="start")
        write(key, qpos=model.qpos0, qvel=speeds, act=activations)
    return moving


def _add_body(
    tree: Element, robots: Team, i: int, stage: Stage, place: Array, gravity: Sequence[float]
) -> None:
    """One body of a robot with its motors; every body has all of the robot's mass."""
    kind, radius = robots.kind[i], float(robots.radius[i])
    name = f"robot_{i + 1}{stage.suffix}"
    unused = tuple(set("xyz") - set(stage.directions))
    body = copied(named(part_of(kind), "body", "robot"), name, skip=unused)
    section(tree, "worldbody").append(body)
    write(body, pos=[*place[:2], radius] if kind.rolls else place)
    rgba = [*palette.robot_color(i, len(robots.mass)), 1.0]
    hull = named(body, "geom", f"{name}_body")
    write(hull, size=radius, rgba=rgba)
    if not isinstance(kind, Quadrotor):
        write(hull, mass=robots.mass[i])
    if isinstance(kind, Slung):
        _hang_payload(body, name, kind, radius)
    elif isinstance(kind, Loaded):
        write(hull, rgba=[*rgba[:3], GLASS])
        load = named(body, "geom", f"{name}_load")
        write(load, size=LOAD * radius, pos=[0.0, 0.0, -kind.offset], mass=kind.load)
    elif isinstance(kind, Quadrotor):
        _add_rotors(tree, body, name, kind, robots, i, gravity)
    elif kind.mjcf:
        _shape_own(body, name, kind, radius, len(robots.position[i]))
    for geom in body.iter("geom"):
        write(geom, group=stage.number)
    if not isinstance(kind, Quadrotor):
        _add_motors(tree, body, stage, robots, i)


def _add_motors(tree: Element, body: Element, stage: Stage, robots: Team, i: int) -> None:
    """One motor for each axis of a stage; the joints of these measure positions in the mission."""
    part = part_of(robots.kind[i])
    axes, position = np.arange(robots.position.shape[1])[stage.axes], robots.position[i][stage.axes]
    names = axis_names(robots.position.shape[1])[stage.axes]
    joints = {joint.get("name"): joint for joint in body if joint.tag in ("joint", "freejoint")}
    for direction, name, axis, start in zip(stage.directions, names, axes, position, strict=True):
        motor = named(part, "motor", direction)
        joint = joints[f"{body.get('name')}_{motor.get('joint')}"]
        if joint.tag == "joint":
            write(joint, name=f"robot_{i + 1}_{name}", ref=start)
        limit = float(robots.force_limit[i])
        where = {"joint": joint.get("name"), "gear": motor.get("gear", "1")}
        _add_motor(tree, f"robot_{i + 1}_{name}", robots, i, axis, (-limit, limit), **where)


def _add_motor(
    tree: Element, name: str, robots: Team, i: int, number: int, limits: tuple[float, float], **where: Any
) -> None:
    """A motor with its lag and gain; what lags is told no more than the limit, or it would wind up."""
    lag = robots.actuators[i].lag
    motor = SubElement(section(tree, "actuator"), "general", name=name)
    write(motor, gainprm=robots.gains[i][number], **where)
    if lag > 0.0:
        write(motor, dyntype="filterexact", dynprm=lag)
    if np.isfinite(limits).all():
        write(motor, forcerange=limits)
        if lag > 0.0:
            write(motor, ctrlrange=limits)


def _shape_own(body: Element, name: str, kind: RobotKind, radius: float, axes: int) -> None:
    """Has a plugin shape its body.

    Raises:
        PluginError: If it raises an error, or has other coordinates than it says.
    """
    parts = {str(part.get("name")).removeprefix(f"{name}_"): part for part in body.iter() if part.get("name")}
    try:
        kind.shape(parts, radius)
    except Exception as error:
        raise PluginError(f"the kind {kind.kind}: {place_of(error, type(kind).shape)}") from None
    found = sum(4 if joint.get("type") == "ball" else 1 for joint in body.iter("joint"))
    if axes <= IN_SPACE and found != kind.coordinates(axes):
        raise PluginError(
            f"the kind {kind.kind}: its joints have {found} coordinates in {axes} axes, and coordinates() "
            f"says {kind.coordinates(axes)}"
        )


def _hang_payload(body: Element, name: str, kind: Slung, radius: float) -> None:
    """Gives the payload its length, mass and damping."""
    for axis in "xy":
        write(named(body, "joint", f"{name}_payload_swing_{axis}"), damping=kind.damping)
    end = [0.0, 0.0, -kind.cable]
    ball, cable = (named(body, "geom", f"{name}_payload_{part}") for part in ("ball", "cable"))
    write(ball, size=kind.payload_radius, pos=end, mass=kind.payload)
    write(cable, size=CABLE * radius, fromto=[0.0, 0.0, 0.0, *end])
    if kind.payload_collides:
        write(ball, contype=TOUCHABLE, conaffinity=TOUCHABLE)


def _add_rotors(
    tree: Element, body: Element, name: str, kind: Quadrotor, robots: Team, i: int, gravity: Sequence[float]
) -> None:
    """Gives a quadrotor its mass, arms, rotors, and the motors for what rotors do: turn it, and push it."""
    radius, arm = float(robots.radius[i]), kind.arm_length(float(robots.radius[i]))
    write(section(body, "inertial"), mass=robots.mass[i], diaginertia=kind.moments(robots.mass[i], radius))
    rgb = palette.robot_color(i, len(robots.mass))
    hub = named(body, "geom", f"{name}_hub")
    write(hub, size=[HUB * radius, HUB * radius, HUB * radius / 2], rgba=[*rgb, 1.0])
    write(named(body, "geom", f"{name}_body"), rgba=[*rgb, GLASS / 2])
    part, places = load_part("quadrotor"), []
    most = kind.craft(robots.mass[i], radius, gravity, 0.0).rotor_limit
    for number in range(1, ROTORS + 1):
        rotor = f"rotor_{number}"
        disc = named(body, "geom", f"{name}_{rotor}")
        places.append(np.sign(_numbers(disc, "pos")) * arm / np.sqrt(2.0))
        write(disc, pos=places[-1], size=[ROTOR * radius, 0.03 * radius], rgba=[*rgb, 1.0])
        turns = np.sign(_numbers(named(part, "motor", rotor), "gear")[5])
        gear = [0.0, 0.0, 0.0, places[-1][1], -places[-1][0], turns * kind.torque_per_thrust]
        where = {"joint": f"{name}_free", "gear": gear}
        _add_motor(tree, f"{name}_{rotor}", robots, i, number - 1, (0.0, most), **where)
    for thrust in THRUSTS:
        along = named(part, "motor", thrust).get("gear")
        motor = SubElement(section(tree, "actuator"), "motor", name=f"{name}_{thrust}")
        write(motor, joint=f"{name}_free", gear=along)
    for number, (one, other) in enumerate(((1, 3), (2, 4)), 1):
        fromto = [*places[one - 1], *places[other - 1]]
        write(named(body, "geom", f"{name}_arm_{number}"), size=0.04 * radius, fromto=fromto)


def _numbers(element: Element, attribute: str) -> Array:
    """The numbers of an attribute that is written."""
    return np.array(element.attrib[attribute].split(), dtype=float)


def _add_rail(world: Element, name: str, stage: Stage, robot: float, radius: float) -> None:
    """The column of an abacus along which a robot's body slides, only to be seen."""
    foot, top = stage.place_at(stage.low[2], robot), stage.place_at(stage.high[2], robot)
    rail = SubElement(world, "geom", name=name, type="capsule")
    write(rail, fromto=[*foot, *top], size=THIN * radius, rgba=RAIL, group=stage.number)
