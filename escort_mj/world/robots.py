"""The robots of a world: bodies and motors of every kind, from the hand-written parts in `models/`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj import palette
from escort_mj.scenario.kinds import ROTORS, Loaded, Quadrotor, Slung
from escort_mj.scenario.placement import Team
from escort_mj.signals import axis_names
from escort_mj.world.parts import graft, load_part
from escort_mj.world.stages import THIN, Stage, robot_steps

Array = NDArray[np.float64]

RAIL = [0.72, 0.74, 0.77, 1.0]
GLASS = 0.3  # alpha of a hull that something is to be seen in
LOAD, CABLE, HUB, ROTOR = 0.3, 0.06, 0.3, 0.28  # sizes of what is seen of a robot, of its radius
TOUCHABLE = 1  # contype of what robots, obstacles and target are


def add_robots(root: Any, robots: Team, gravity: Sequence[float], stages: list[Stage], radius: float) -> None:
    """The bodies of each robot, one for each stage, and its motors.

    Args:
        root: MJCF tree that receives them.
        robots: What they are.
        gravity: World frame, shape (3,) [m/s^2].
        stages: Where the axes of the mission are.
        radius: Distance to keep from the target [m].
    """
    count = len(robots.mass)
    for i, (steps, position) in enumerate(zip(robot_steps(count), robots.position, strict=True)):
        for stage in stages:
            _add_body(root, robots, i, stage, stage.place(position, steps), gravity)
            if stage.is_abacus:
                _add_rail(root, f"robot_{i + 1}_rail", stage, steps, radius)


def add_start(root: Any, model: mujoco.MjModel, robots: Team, gravity: Sequence[float]) -> None:
    """A keyframe with what does not start at rest: robots that move, and rotors that lag and already turn.

    Args:
        root: MJCF tree that receives it.
        model: Compiled from it.
        robots: What they are.
        gravity: World frame, shape (3,) [m/s^2].
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
    if speeds.any() or activations.any():
        root.keyframe.add("key", name="start", qpos=model.qpos0, qvel=speeds, act=activations)


def _add_body(root: Any, robots: Team, i: int, stage: Stage, place: Array, gravity: Sequence[float]) -> None:
    """One body of a robot with its motors; every body has all of the robot's mass."""
    kind, radius = robots.kind[i], float(robots.radius[i])
    part, name = load_part(kind.kind), f"robot_{i + 1}{stage.suffix}"
    unused = tuple(set("xyz") - set(stage.directions))
    body = graft(part.find("body", "robot"), root.worldbody, name, skip=unused)
    body.pos = [*place[:2], radius] if kind.rolls else place
    rgba = np.array([*palette.robot_color(i, len(robots.mass)), 1.0])
    hull = body.find("geom", f"{name}_body")
    hull.set_attributes(size=[radius], rgba=rgba)
    if not isinstance(kind, Quadrotor):
        hull.mass = robots.mass[i]
    if isinstance(kind, Slung):
        _hang_payload(body, name, kind, radius)
    elif isinstance(kind, Loaded):
        hull.rgba = [*rgba[:3], GLASS]
        load = body.find("geom", f"{name}_load")
        load.set_attributes(size=[LOAD * radius], pos=[0.0, 0.0, -kind.offset], mass=kind.load)
    elif isinstance(kind, Quadrotor):
        _add_rotors(root, body, name, kind, robots, i, gravity)
    for geom in body.find_all("geom"):
        geom.group = stage.number
    if not isinstance(kind, Quadrotor):
        _add_motors(root, body, part, stage, robots, i)


def _add_motors(root: Any, body: Any, part: Any, stage: Stage, robots: Team, i: int) -> None:
    """One motor for each axis of a stage; the joints of these measure positions in the mission."""
    axes, position = np.arange(robots.position.shape[1])[stage.axes], robots.position[i][stage.axes]
    names = axis_names(robots.position.shape[1])[stage.axes]
    for direction, name, axis, start in zip(stage.directions, names, axes, position, strict=True):
        motor = part.find("actuator", direction)
        joint = body.find("joint", f"{body.name}_{motor.joint.name}")
        if joint.tag == "joint":
            joint.name = f"robot_{i + 1}_{name}"
            joint.ref = start
        limit = float(robots.force_limit[i])
        where = {"joint": joint.name, "gear": motor.gear}
        _add_motor(root, f"robot_{i + 1}_{name}", robots, i, axis, (-limit, limit), **where)


def _add_motor(
    root: Any, name: str, robots: Team, i: int, number: int, limits: tuple[float, float], **where: Any
) -> None:
    """A motor with its lag and gain; what lags is told no more than the limit, or it would wind up."""
    lag = robots.actuators[i].lag
    motor = root.actuator.add("general", name=name, gainprm=[robots.gains[i][number]], **where)
    if lag > 0.0:
        motor.set_attributes(dyntype="filterexact", dynprm=[lag])
    if np.isfinite(limits).all():
        motor.forcerange = limits
        if lag > 0.0:
            motor.ctrlrange = limits


def _hang_payload(body: Any, name: str, kind: Slung, radius: float) -> None:
    """Gives the payload its length, mass and damping."""
    for axis in "xy":
        body.find("joint", f"{name}_payload_swing_{axis}").damping = kind.damping
    end = [0.0, 0.0, -kind.cable]
    ball, cable = (body.find("geom", f"{name}_payload_{part}") for part in ("ball", "cable"))
    ball.set_attributes(size=[kind.payload_radius], pos=end, mass=kind.payload)
    cable.set_attributes(size=[CABLE * radius], fromto=[0.0, 0.0, 0.0, *end])
    if kind.payload_collides:
        ball.contype = ball.conaffinity = TOUCHABLE


def _add_rotors(
    root: Any, body: Any, name: str, kind: Quadrotor, robots: Team, i: int, gravity: Sequence[float]
) -> None:
    """Gives a quadrotor its mass, arms and rotors; a rotor's motor pushes and turns at a site of its own."""
    radius, arm = float(robots.radius[i]), kind.arm_length(float(robots.radius[i]))
    body.inertial.set_attributes(mass=robots.mass[i], diaginertia=kind.moments(robots.mass[i], radius))
    hull, hub = body.find("geom", f"{name}_body"), body.find("geom", f"{name}_hub")
    hub.set_attributes(size=[HUB * radius, HUB * radius, HUB * radius / 2], rgba=[*hull.rgba[:3], 1.0])
    hull.rgba = [*hull.rgba[:3], GLASS / 2]
    part = load_part("quadrotor")
    most = kind.craft(robots.mass[i], radius, gravity, 0.0).rotor_limit
    for number in range(1, ROTORS + 1):
        rotor = f"rotor_{number}"
        site, disc = body.find("site", f"{name}_{rotor}"), body.find("geom", f"{name}_{rotor}")
        site.pos = disc.pos = np.sign(disc.pos) * arm / np.sqrt(2.0)
        disc.set_attributes(size=[ROTOR * radius, 0.03 * radius], rgba=[*hull.rgba[:3], 1.0])
        gear = np.sign(part.find("actuator", rotor).gear)
        gear[5] *= kind.torque_per_thrust
        _add_motor(root, f"{name}_{rotor}", robots, i, number - 1, (0.0, most), site=site.name, gear=gear)
    for number, ends in enumerate(((1, 3), (2, 4)), 1):
        geom = body.find("geom", f"{name}_arm_{number}")
        fromto = np.concatenate([body.find("site", f"{name}_rotor_{end}").pos for end in ends])
        geom.set_attributes(size=[0.04 * radius], fromto=fromto)


def _add_rail(root: Any, name: str, stage: Stage, robot: float, radius: float) -> None:
    """The column of an abacus along which a robot's body slides, only to be seen."""
    foot, top = stage.place_at(stage.low[2], robot), stage.place_at(stage.high[2], robot)
    root.worldbody.add(
        "geom", name=name, type="capsule", fromto=[*foot, *top], size=[THIN * radius], rgba=RAIL,
        group=stage.number,
    )  # fmt: skip
