"""How the controller's robots are found in MuJoCo's arrays: addresses and bodies, carried by the model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj.memory.layout import MAGIC, size_of
from escort_mj.native.fields import Array
from escort_mj.native.kernels import DOUBLE, inlined
from escort_mj.native.memory import Layout, viewer
from escort_mj.robots.addresses import Addresses
from escort_mj.robots.attitude import ROTORS, Craft
from escort_mj.robots.drive import DriveModel, Input
from escort_mj.robots.drive import RobotDrive as DriveRow
from escort_mj.robots.hydrodynamics import Vessel
from escort_mj.scenario.geometry.obstacle_body import Body
from escort_mj.scenario.geometry.placement import Placement
from escort_mj.scenario.geometry.shapes import hull, rotation_matrix
from escort_mj.world.stages import Stage

LAYOUT = Layout(MAGIC, Addresses)


class Counts(NamedTuple):
    """How many of each there are in a model, beside its robots.

    Attributes:
        movers: Bodies that move by themselves.
        geoms: Of the model.
        faces: Of all meshes together.
        parts: Geoms of robots that can touch others, where some robot is more than its hull.
        limbs: Bodies of such robots with such geoms.
    """

    movers: int
    geoms: int
    faces: int
    parts: int = 0
    limbs: int = 0


def addresses_size(team: Placement, axes: int, names: Sequence[str], counts: Counts) -> int:
    """Length of the addresses.

    Args:
        team: The robots.
        axes: Of the mission.
        names: Of the bodies that can touch, in their order: robots, target, obstacles, floor.
        counts: Of all else.
    """
    return LAYOUT.plan_size(_sizes(team, axes, names, counts))


def _sizes(team: Placement, axes: int, names: Sequence[str], counts: Counts) -> dict[str, int]:
    robots, drives = len(team.mass), [drive for drive in drives_of(team) if drive is not None]
    return {
        "n": robots,
        "seers": robots + 1,
        "m": len(names) - robots - 2,
        "p": axes,
        "flying": sum(craft is not None for craft in crafts_of(team, (0.0, 0.0, -1.0))),
        "driven": len(drives),
        "inputs": sum(len(drive.inputs) for drive in drives),
        "afloat": len(_vessels(team)),
        "spanned": robots * (counts.parts > 0),
        **counts._asdict(),
    }


def drives_of(team: Placement) -> list[DriveModel | None]:
    """The drive of each robot."""
    robots = zip(team.kind, team.mass, team.radius, strict=True)
    return [kind.drive_model(float(mass), float(radius)) for kind, mass, radius in robots]


def crafts_of(team: Placement, gravity: Sequence[float]) -> list[Craft | None]:
    """What the attitude loop of each robot knows of it; None where there is none."""
    robots, height = zip(team.kind, team.mass, team.radius, strict=True), team.height
    return [kind.craft(float(mass), float(radius), gravity, height) for kind, mass, radius in robots]


def _drives(model: mujoco.MjModel, team: Placement) -> dict[str, Array]:
    """What drives are like, and whose they are, see `Addresses`."""
    rows: list[DriveRow] = []
    inputs: list[Input] = []
    drives, owner = drives_of(team), np.full(len(team.mass), -1)
    names = [f"/{drive.base}" if drive is not None and drive.base else "" for drive in drives]
    bases = [model.body(f"robot_{i + 1}{name}").id for i, name in enumerate(names)]
    for i, drive in enumerate(drives):
        if drive is None:
            continue
        owner[i] = len(rows)
        root = model.body(f"robot_{i + 1}").id
        rows.append(drive.row(bases[i], root, len(inputs), team.position[i]))
        inputs += drive.inputs
    return {
        "base": np.array(bases, float),
        "drive": owner,
        "drives": np.array(rows, float).reshape(len(rows), len(DriveRow._fields)),
        "inputs": np.array(inputs, float).reshape(len(inputs), len(Input._fields)),
    }


def _first_joints(model: mujoco.MjModel, robots: int) -> NDArray[np.int64]:
    """The first joint of each robot, wherever in it."""
    roots = model.body_rootid[model.jnt_bodyid]
    first = {int(root): joint for joint, root in reversed(list(enumerate(roots)))}
    return np.array([first[model.body(f"robot_{i + 1}").id] for i in range(robots)])


def _vessels(team: Placement) -> dict[int, Vessel]:
    """What the water does to robots that float, by their numbers from 0."""
    robots = enumerate(zip(team.kind, team.mass, team.radius, strict=True))
    found = {i: kind.vessel(float(mass), float(radius)) for i, (kind, mass, radius) in robots}
    return {i: vessel for i, vessel in found.items() if vessel is not None}


def find_addresses(
    model: mujoco.MjModel,
    team: Placement,
    gravity: Sequence[float],
    stages: Sequence[Stage],
    names: Sequence[str],
    faces: Array,
    parts: Mapping[str, Array],
) -> Array:
    """The addresses of a compiled model as one flat vector, found by names.

    Args:
        model: A compiled model with bodies `robot_1` ..., `target` and their shadows.
        team: Its robots.
        gravity: World frame, shape (3,) [m/s^2].
        stages: Where the axes of the mission are.
        names: Of the bodies that can touch, in their order: robots, target, obstacles, floor.
        faces: Of meshes, see `faces_of`.
        parts: What of the robots can touch others, see `touching.parts_of`.
    """
    robots = len(team.mass)
    target = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, "target_body")
    joints = _first_joints(model, robots)
    dofs = model.jnt_dofadr[joints]
    trees = model.dof_treeid[dofs]
    ends = model.tree_dofadr[trees] + model.tree_dofnum[trees]
    mocap = [int(model.body(f"target{stage.suffix}").mocapid[0]) for stage in stages]
    places = [
        3 * place_of + place if place_of >= 0 else -1  # a target with mass is not led
        for place_of, stage in zip(mocap, stages, strict=True)
        for place in stage.places
    ]
    obstacles = names[robots + 1 : -1]
    slides = [model.body(name).jntadr[0] for name in (*obstacles, "target") if model.body(name).jntnum[0]]
    offsets = [stage.origin[place] for stage in stages for place in stage.places]
    lift, pilot = np.zeros((robots, 3)), np.full(robots, -1)
    crafts: list[Craft] = []
    for i, (kind, mass, craft) in enumerate(zip(team.kind, team.mass, crafts_of(team, gravity), strict=True)):
        lift[i] = kind.lift(mass, gravity)
        if craft is not None:
            pilot[i] = len(crafts)
            crafts.append(craft)
    flying = np.flatnonzero(pilot >= 0)
    driven = _drives(model, team)
    vessels = _vessels(team)
    motors = [kind.actuators(len(places)) for kind in team.kind]
    addresses = model.jnt_qposadr[joints], dofs, np.cumsum([0, *motors[:-1]])
    dead_zone = [actuators.dead_zone for actuators in team.actuators]
    in_row = all((each == len(places) * np.arange(robots)).all() for each in addresses)
    counts = Counts(len(slides), model.ngeom, len(faces), len(parts["parts"]), len(parts["limbs"]))
    return LAYOUT.pack(
        _sizes(team, len(places), names, counts),
        {
            **parts,
            "qpos_address": model.jnt_qposadr[joints],
            "dof_address": dofs,
            "tree_end": ends,
            "target_address": places,
            "target_offset": offsets,
            "target_radius": model.geom_size[target, 0] if target >= 0 else 0.0,
            "motor_address": addresses[2],
            "dead_zone": dead_zone,
            "in_row": in_row
            and not any(dead_zone)
            and not crafts
            and not lift.any()
            and (driven["drive"] < 0).all(),
            "lift": lift,
            "pilot": pilot,
            "crafts": np.reshape(crafts, (len(crafts), len(Craft._fields))),
            **driven,
            "rotor_gain": _rotor_gains(team, flying),
            "rotor_state": model.actuator_actadr[addresses[2][flying]],
            "vessel_robot": list(vessels),
            "vessels": np.reshape(list(vessels.values()), (len(vessels), len(Vessel._fields))),
            "geom_body": geom_bodies(model, names),
            "robot_geom": [*(model.geom(f"{name}_body").id for name in names[:robots]), target],
            "obstacle_geom": [model.geom(f"{name}_body").id for name in obstacles],
            "faces": _in_geoms(model, [model.geom(f"{name}_body").id for name in obstacles], faces),
            "mover_qpos": model.jnt_qposadr[slides],
            "mover_dof": model.jnt_dofadr[slides],
        },
    )


def _rotor_gains(team: Placement, flying: NDArray[np.int64]) -> Array:
    """Gain of the motor of each rotor, of kinds with four alike."""
    gains = np.ones((len(flying), ROTORS))
    for row, i in zip(gains, flying, strict=True):
        if not team.kind[i].driven:
            row[: len(team.gains[i])] = team.gains[i]
    return gains


def faces_of(bodies: Sequence[Body]) -> Array:
    """The faces of obstacles that are meshes, as they stand in the mission.

    Returns:
        One row each: number of the obstacle from 0, outward unit normal in the world's axes, and minus the
        distance from the obstacle's center along it [m], shape (faces, 5).
    """
    found = [np.zeros((0, 5))]
    for number, body in enumerate(bodies):
        if body.shape == "mesh":
            planes = hull(tuple(map(tuple, body.vertices)))[1]
            normals = planes[:, :3] @ rotation_matrix(body.orientation).T
            found.append(np.column_stack([np.full(len(planes), number), normals, planes[:, 3]]))
    return np.vstack(found)


def _in_geoms(model: mujoco.MjModel, geoms: Sequence[int], faces: Array) -> Array:
    """The same in the axes of their geoms: MuJoCo turns and moves meshes to their principal axes."""
    found, turn = faces.copy(), np.empty(9)
    for row in found:
        geom = geoms[int(row[0])]
        mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
        row[4] += row[1:4] @ model.geom_pos[geom]
        row[1:4] = row[1:4] @ turn.reshape(3, 3)
    return found


def geom_bodies(model: mujoco.MjModel, names: Sequence[str]) -> NDArray[np.int64]:
    """Which body each geom belongs to, with all that hangs on it, shape (ngeom,); -1 for none of these.

    Args:
        model: A compiled model.
        names: Of bodies that hang on the world, or of geoms that are part of it.
    """
    places = {name: place for place, name in enumerate(names)}
    found = np.full(model.ngeom, -1)
    for geom, body in enumerate(model.geom_bodyid):
        thing = model.geom(geom) if body == 0 else model.body(model.body_rootid[body])
        found[geom] = places.get(thing.name, -1)
    return found


def thickness(model: mujoco.MjModel, names: Sequence[str]) -> Array:
    """Least extent of each body, that of its thinnest solid geom, shape (bodies,) [m]; inf for planes."""
    found = np.full(len(names), np.inf)
    solid = (model.geom_contype | model.geom_conaffinity) > 0
    for geom, body in enumerate(geom_bodies(model, names)):
        plane = model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE
        if body >= 0 and not plane and (solid[geom] or not solid.any()):  # nothing is beyond three axes
            found[body] = min(found[body], 2.0 * model.geom_aabb[geom, 3:].min())
    return found


@inlined
def behind(plan: int) -> int:
    """Address of the addresses, which stands behind the plan at an address."""
    return plan + DOUBLE * size_of(plan)


def unpack_addresses(address: int, axes: int) -> Addresses:
    """Views the addresses at an address; nothing is copied, nothing owned."""
    addresses: Addresses = LAYOUT.read(Addresses, address, address)
    return addresses


viewer(lambda: (LAYOUT, Addresses), unpack_addresses)
