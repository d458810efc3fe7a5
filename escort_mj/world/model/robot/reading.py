"""Reads a robot from MJCF: compiled once, its base and drive found, its body ready to be copied."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from xml.etree.ElementTree import Element

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj.errors import RobotError
from escort_mj.robots.drive import DriveModel
from escort_mj.robots.modeled import DriveKeys, RobotModel, Source
from escort_mj.scenario.findings import did_you_mean, listed
from escort_mj.world.model.robot.coupled import Named, check_coupled, kind_of, references
from escort_mj.world.model.robot.effects import (
    SLIDE,
    Machine,
    farthest,
    geom_outline,
    is_rigid,
    solid_geoms,
    vertical,
)
from escort_mj.world.model.robot.files import PLACE, Files, read_files
from escort_mj.world.model.robot.finding import find_drive
from escort_mj.world.model.robot.flat import make_solid, write_masses, written_out

Array = NDArray[np.float64]

SECTIONS = ("asset", "actuator", "sensor", "tendon", "equality", "contact")
OUTSIDE = ("joint", "tendon", "site", "body", "jointinparent", "cranksite")  # what actuators act on
LEAST_MASS = 1e-9  # kg
MARGIN = 1.0001  # of the hull, against rounding
LEVEL = 1e-3  # m that slides may climb in 1 m
PAIRED = 1 << 29  # contype of geoms that touch by <pair> alone; no other geom has the bit


def read_model(source: Source) -> RobotModel:
    """Return a robot as it was read.

    Raises:
        RobotError: If a file is missing or wrong, or the robot cannot be driven.
    """
    name = source.name or source.file
    files = read_files(source)
    if source.sha256 and source.sha256 != files.digest:
        raise RobotError(
            f"{name}: has changed: its sha256 is {files.digest[:12]}..., and {source.sha256[:12]}... is "
            "asked for; take the key sha256 out to use it as it is"
        )
    model, tree = compiled(files, name)
    base = _base(model, source.body, name)
    try:
        machine = Machine(model, _start(model), base, name)
        _check(machine)
        drive = find_drive(machine, DriveKeys.model_validate_json(source.drive))
        return _robot(machine, tree, files, drive)
    except mujoco.FatalError as error:
        raise RobotError(f"{name}: MuJoCo refuses it: {' '.join(str(error).split())[:300]}") from None
    except (ArithmeticError, np.linalg.LinAlgError):
        raise RobotError(
            f"{name}: its sizes, masses, gears or limits are too large or too small to compute with"
        ) from None


def compiled(files: Files, name: str) -> tuple[mujoco.MjModel, Element]:
    """Compile a robot, and return it as MuJoCo writes it, too, with its defaults written out."""
    text = ElementTree.tostring(files.root, "unicode")
    try:
        spec = mujoco.MjSpec.from_string(text, assets=files.assets)
        for number, body in enumerate(spec.bodies):
            if not body.name:
                body.name = f"unnamed_{number}"
        for pair in spec.pairs:
            for geom in (spec.geom(pair.geomname1), spec.geom(pair.geomname2)):
                if geom is not None and not geom.contype | geom.conaffinity:
                    geom.contype = PAIRED
        for number, actuator in enumerate(spec.actuators):
            if not actuator.name:
                actuator.name = f"unnamed_{number + 1}"
        model = spec.compile()
        tree = ElementTree.fromstring(spec.to_xml())
    except (ValueError, mujoco.FatalError, ElementTree.ParseError) as error:
        words = " ".join(str(error).split()).removeprefix("Error: ")
        raise RobotError(f"{name}: MuJoCo refuses it: {words[:300]}") from None
    limits = tree.find("compiler[@autolimits='false']") is not None
    tree = written_out(tree)
    for element in tree.iter() if limits else ():
        for key in ("range", "ctrlrange", "forcerange", "actrange"):
            flag = "limited" if key == "range" else key.replace("range", "limited")
            if element.get(key) and element.get(flag) is None and element.tag in ("joint", "general"):
                element.set(flag, "false")
    write_masses(tree, model)
    return model, tree


def _base(model: mujoco.MjModel, body: str, name: str) -> int:
    """The body that the law moves.

    Raises:
        RobotError: If there is none, or more than one and it is not said which.
    """
    names = [model.body(number).name for number in range(1, model.nbody)]
    if body:
        if body not in names:
            raise RobotError(
                f"{name}: has no body {body}; found {listed(names[:20])}{did_you_mean(body, names)}"
            )
        chosen = int(model.body(body).id)
        if not _moves(model, chosen):
            raise RobotError(f"{name}: the body {body} cannot move: no free joint or slides lead to it")
        return chosen
    moving = [number for number in range(1, model.nbody) if _moves(model, number)]
    roots = sorted({int(model.body_rootid[number]) for number in moving})
    if not roots:
        raise RobotError(f"{name}: has no base: no body has a free joint, or slides along two axes")
    acted_on = {_acts_on(model, actuator) for actuator in range(model.nu)}
    driven = [root for root in roots if root in acted_on] or roots
    if len(driven) > 1 and not model.nu:
        raise RobotError(f"{name}: has no actuator; expected motors or servos that move a base")
    if len(driven) > 1:
        found = " and ".join(model.body(root).name for root in driven)
        raise RobotError(
            f"{name}: found {len(driven)} bases, {found}; say which by the key body (of check-robot: --body)"
        )
    return next(number for number in moving if model.body_rootid[number] == driven[0])


def _moves(model: mujoco.MjModel, body: int) -> bool:
    """Whether joints let a body move along two axes at least."""
    axes = []
    while body:
        for joint in range(model.body_jntadr[body], model.body_jntadr[body] + model.body_jntnum[body]):
            if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE:
                return True
            if model.jnt_type[joint] == SLIDE:
                axes.append(model.jnt_axis[joint])
        body = int(model.body_parentid[body])
    return len(axes) > 1 and int(np.linalg.matrix_rank(np.array(axes), tol=1e-6)) > 1


def _acts_on(model: mujoco.MjModel, actuator: int) -> int:
    """The outermost body of what an actuator acts on; -1 where there is none."""
    kinds, target = mujoco.mjtTrn, int(model.actuator_trnid[actuator, 0])
    kind = int(model.actuator_trntype[actuator])
    if kind in (kinds.mjTRN_JOINT, kinds.mjTRN_JOINTINPARENT):
        return int(model.body_rootid[model.jnt_bodyid[target]])
    if kind in (kinds.mjTRN_SITE, kinds.mjTRN_SLIDERCRANK):
        return int(model.body_rootid[model.site_bodyid[target]])
    if kind == kinds.mjTRN_BODY:
        return int(model.body_rootid[target])
    for wrap in range(model.tendon_adr[target], model.tendon_adr[target] + model.tendon_num[target]):
        at = int(model.wrap_objid[wrap])
        if model.wrap_type[wrap] == mujoco.mjtWrap.mjWRAP_JOINT:
            return int(model.body_rootid[model.jnt_bodyid[at]])
        if model.wrap_type[wrap] == mujoco.mjtWrap.mjWRAP_SITE:
            return int(model.body_rootid[model.site_bodyid[at]])
    return -1


def _start(model: mujoco.MjModel) -> mujoco.MjData:
    """The pose of the first keyframe, or the default one."""
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
        data.qvel[:] = 0.0
    mujoco.mj_forward(model, data)
    return data


def _check(machine: Machine) -> None:
    """Look for what no drive can make good."""
    model, name = machine.model, machine.name
    root = model.body(machine.root).name
    if not model.nu:
        raise RobotError(f"{name}: has no actuator; expected motors or servos that move {root}")
    for actuator in range(model.nu):
        if (other := _acts_on(model, actuator)) != machine.root:
            what = model.body(other).name if other > 0 else "the world"
            raise RobotError(
                f"{name}: the actuator {model.actuator(actuator).name} acts on {what}, which is no part of "
                f"the robot {root}"
            )
    for flex in range(model.nflex):
        first = model.flex_vertadr[flex]
        held = model.flex_vertbodyid[first : first + model.flex_vertnum[flex]]
        if np.isin(held, machine.bodies).any():
            called = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_FLEX, flex)
            raise RobotError(f"{name}: has the flex {called}; expected bodies with geoms alone")
    if machine.mass < LEAST_MASS:
        raise RobotError(f"{name}: has no mass; give its geoms a mass, or its bodies an inertial")
    if not np.isfinite(machine.data.qacc).all() or not np.isfinite(machine.mass_matrix).all():
        raise RobotError(f"{name}: its start pose has no finite acceleration")
    if np.linalg.cond(machine.mass_matrix) > 1e14:
        raise RobotError(f"{name}: a joint of it moves no mass and no inertia")


def _robot(machine: Machine, tree: Element, files: Files, drive: DriveModel) -> RobotModel:
    """What is kept of a robot."""
    model, data = machine.model, machine.data
    name = model.body(machine.root).name
    world = tree.find("worldbody")
    assert world is not None
    root = next(body for body in world.findall("body") if body.get("name") == name)
    own = {(kind_of(each.tag), each.get("name", "")) for each in root.iter() if each.get("name")}
    check_coupled(tree, root, own, model, machine.name)
    apart = make_solid(root, model, machine.rises)
    sections, left = _sections(tree, root, own)
    sections["contact"] += [Element("exclude", {"body1": a, "body2": b}) for a, b in apart]
    base = "" if machine.base == machine.root else model.body(machine.base).name
    left += _left(tree, world, name, model)
    point = data.xpos[machine.base] + machine.rotation @ drive.point
    stands = machine.rises and not drive.lifts
    solid = solid_geoms(machine)
    points = np.vstack([geom_outline(machine, geom) for geom in solid])
    ways = (points - point)[:, : 3 if drive.lifts else 2]
    radius = float(np.linalg.norm(ways, axis=1).max()) * MARGIN
    reach = max(radius * drive.lifts, *(MARGIN * farthest(machine, geom, point) for geom in solid))
    freedoms = [dof for dof in range(model.nv) if model.dof_bodyid[dof] in machine.bodies]
    heights = [vertical(machine, geom) for geom in solid]
    low, high = min(low for low, _ in heights), max(high for _, high in heights)
    lifted = -low if stands or (low < 0.0 and not drive.lifts) else 0.0
    return RobotModel(
        root=root,
        sections=sections,
        assets=files.assets,
        text=ElementTree.tostring(files.root, "unicode").replace(f'"{PLACE}/', '"'),
        digest=files.digest,
        coordinates=_coordinates(model, freedoms),
        freedoms=len(freedoms),
        actuators=model.nu,
        mass=machine.mass,
        inertia=tuple(map(float, np.diag(machine.inertia))),
        radius=radius,
        reach=reach if is_rigid(machine) else math.inf,
        span=(low + lifted, high + lifted),
        start=tuple(map(float, point)),
        stands=stands,
        lifted=lifted,
        place=_place(machine),
        qpos=_own_coordinates(machine),
        way=_way(machine, drive, freedoms),
        ctrl=tuple(map(float, data.ctrl)),
        drive=replace(drive, base=base),
        damped=bool(model.actuator_biasprm[:, 2].any()),
        medium=(float(model.opt.density), float(model.opt.viscosity)),
        left=tuple(left),
    )


def _place(machine: Machine) -> tuple[float, ...]:
    """Place and orientation of the outermost body, those of its free joint where it has one."""
    model, root = machine.model, machine.root
    joint = model.body_jntadr[root]
    if joint >= 0 and model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE:
        first = model.jnt_qposadr[joint]
        return tuple(map(float, machine.data.qpos[first : first + 7]))
    return (*map(float, model.body_pos[root]), *map(float, model.body_quat[root]))


def _own_coordinates(machine: Machine) -> tuple[float, ...]:
    """The start pose of the robot's own joints."""
    model = machine.model
    joints = np.flatnonzero(np.isin(model.jnt_bodyid, machine.bodies))
    ends = [*model.jnt_qposadr[1:], model.nq]
    return tuple(
        float(machine.data.qpos[place]) for j in joints for place in range(model.jnt_qposadr[j], ends[j])
    )


def _way(machine: Machine, drive: DriveModel, freedoms: list[int]) -> tuple[tuple[float, ...], ...]:
    """Generalized velocities for a velocity of 1 of the controlled point, without turning, (freedoms, 3).

    Raises:
        RobotError: If the robot rises or sinks on its way, and cannot choose its height.
    """
    found = np.zeros((machine.model.nv, 3))
    jacobian = machine.jacobian(np.array(drive.point))
    inverse = np.linalg.pinv(jacobian[:, machine.base_freedoms], rcond=1e-9)
    found[machine.base_freedoms] = inverse[:, :3] @ machine.rotation.T
    climb = float(np.abs((machine.rotation @ jacobian[:3] @ found)[2, :2]).max())
    if climb > LEVEL and not drive.lifts:
        raise RobotError(
            f"{machine.name}: its slides are not level: 1 m along a horizontal axis moves it {climb:.3g} m "
            "up or down; a robot that cannot rise by itself stays at one height"
        )
    return tuple(tuple(map(float, row)) for row in found[freedoms])


def _coordinates(model: mujoco.MjModel, freedoms: list[int]) -> int:
    """Number of generalized positions of the joints of some velocity coordinates."""
    sizes = {0: 7, 1: 4, 2: 1, 3: 1}
    return sum(sizes[int(model.jnt_type[joint])] for joint in {int(model.dof_jntid[dof]) for dof in freedoms})


def _sections(tree: Element, root: Element, own: set[Named]) -> tuple[dict[str, list[Element]], list[str]]:
    """What of the file's sections belongs to the robot, and what does not."""
    found: dict[str, list[Element]] = {tag: [] for tag in SECTIONS}
    left = []
    known = {*own}
    for tag in ("asset", "tendon", "actuator", "equality", "contact", "sensor"):
        for section in tree.findall(tag):
            for element in section:
                if tag == "asset":
                    if element.get("type") != "skybox":
                        found[tag].append(element)
                    continue
                if set(references(element)) <= known:  # all that it names is the robot's
                    found[tag].append(element)
                    known.add((kind_of(tag), element.get("name", "")))
                else:
                    left.append(f"<{element.tag}> {element.get('name', '')}".strip())
    used = {value for each in root.iter() for key, value in each.items() if key in ("mesh", "material")}
    used |= {each.get("material", "") for each in found["tendon"]}
    kept = [each for each in found["asset"] if each.tag == "texture" or each.get("name") in used]
    textures = {each.get("texture") for each in kept} | {
        layer.get("texture") for each in kept for layer in each.findall("layer")
    }
    found["asset"] = [each for each in kept if each.tag != "texture" or each.get("name") in textures]
    return found, left


def _left(tree: Element, world: Element, root: str, model: mujoco.MjModel) -> list[str]:
    """What is not taken, in words."""
    found = [f"body {body.get('name')}" for body in world.findall("body") if body.get("name") != root]
    others = [child.tag for child in world if child.tag != "body"]
    found += [
        f"{others.count(tag)} {tag}{'s' * (others.count(tag) > 1)} of the world"
        for tag in dict.fromkeys(others)
    ]
    options = {} if (option := tree.find("option")) is None else option.attrib
    found += [f"option {key}" for key in options if key not in ("density", "viscosity")]
    if model.nkey > 1:
        found.append(f"{model.nkey - 1} keyframes after the first")
    return found
