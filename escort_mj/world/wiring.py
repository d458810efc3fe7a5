"""How the controller's robots are found in MuJoCo's arrays: addresses and groups, carried by the model."""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum
from typing import Annotated, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj.control.attitude import Craft
from escort_mj.control.plan import MAGIC, size_of
from escort_mj.kernels import DOUBLE, shared
from escort_mj.memory import Layout, viewer
from escort_mj.scenario.kinds import Quadrotor
from escort_mj.scenario.placement import Team
from escort_mj.world.stages import SHADOW, Stage

Array = NDArray[np.float64]


class Group(IntEnum):
    """What a geom belongs to, for the contact watch."""

    NONE = 0  # the floor and anything else whose touch is no event
    ROBOT = 1
    OBSTACLE = 2
    TARGET = 3


class Wiring(NamedTuple):
    """Where things are in MuJoCo's arrays, for n robots, p axes and so many geoms."""

    qpos_address: Annotated[Array, "n"]  # first position coordinate of each robot
    dof_address: Annotated[Array, "n"]  # first velocity coordinate of each robot
    tree_end: Annotated[Array, "n"]  # one past the last velocity coordinate of each robot's kinematic tree
    target_address: Annotated[Array, "p"]  # where each of the target's coordinates is in `mocap_pos`
    target_offset: Annotated[Array, "p"]  # what is added to it there [m]
    target_radius: float  # [m]
    motor_address: Annotated[Array, "n"]  # first motor of each robot
    dead_zone: Annotated[Array, "n"]  # force that each command loses [N]
    lift: Annotated[
        Array, "n", 3
    ]  # force that is fed forward against a flying robot's weight, world frame [N]
    pilot: Annotated[Array, "n"]  # row in `crafts` of each robot that flies, else -1
    crafts: Annotated[Array, "flying", len(Craft._fields)]  # see `attitude`
    geom_group: Annotated[Array, "geoms"]  # `Group` of each geom


LAYOUT = Layout(MAGIC, Wiring)


def wire(model: mujoco.MjModel, team: Team, gravity: Sequence[float], stages: Sequence[Stage]) -> Array:
    """The wiring of a compiled model as one flat vector, found by names.

    Args:
        model: A compiled model with bodies `robot_1` ..., `target` and their shadows; of other non-world
            bodies those without a shadow's name are obstacles.
        team: Its robots.
        gravity: World frame, shape (3,) [m/s^2].
        stages: Where the axes of the mission are.
    """
    robots = len(team.mass)
    bodies = [model.body(f"robot_{i + 1}") for i in range(robots)]
    joints = [body.jntadr[0] for body in bodies]
    groups = np.zeros(model.ngeom)
    target = model.body("target").id
    ids = {body.id for body in bodies}
    for geom, body_id in enumerate(model.geom_bodyid):
        if model.body_rootid[body_id] in ids:  # with what hangs on it
            groups[geom] = Group.ROBOT
        elif body_id == target:
            groups[geom] = Group.TARGET
        elif body_id != 0 and SHADOW not in model.body(body_id).name:
            groups[geom] = Group.OBSTACLE
    dofs = model.jnt_dofadr[joints]
    trees = model.dof_treeid[dofs]
    ends = model.tree_dofadr[trees] + model.tree_dofnum[trees]
    places = [
        3 * model.body(f"target{stage.suffix}").mocapid[0] + place
        for stage in stages
        for place in stage.places
    ]
    offsets = [stage.origin[place] for stage in stages for place in stage.places]
    lift, pilot = np.zeros((robots, 3)), np.full(robots, -1)
    crafts: list[Craft] = []
    for i, (kind, mass, radius) in enumerate(zip(team.kind, team.mass, team.radius, strict=True)):
        if isinstance(kind, Quadrotor):
            lift[i], pilot[i] = kind.lift(mass, gravity), len(crafts)
            crafts.append(kind.craft(mass, radius, gravity, team.height))
    motors = [kind.motors(len(places)) for kind in team.kind]
    return LAYOUT.pack(
        {"n": robots, "p": len(places), "flying": len(crafts), "geoms": model.ngeom},
        {
            "qpos_address": model.jnt_qposadr[joints],
            "dof_address": dofs,
            "tree_end": ends,
            "target_address": places,
            "target_offset": offsets,
            "target_radius": model.geom("target_body").size[0],
            "motor_address": np.cumsum([0, *motors[:-1]]),
            "dead_zone": [actuators.dead_zone for actuators in team.actuators],
            "lift": lift,
            "pilot": pilot,
            "crafts": np.reshape(crafts, (len(crafts), len(Craft._fields))),
            "geom_group": groups,
        },
    )


@shared
def behind(plan: int) -> int:
    """Address of the wiring, which stands behind the plan at an address."""
    return plan + DOUBLE * size_of(plan)


def unpack_wiring(address: int, axes: int) -> Wiring:
    """Views the wiring at an address; nothing is copied, nothing owned."""
    wiring: Wiring = LAYOUT.read(Wiring, address, address)
    return wiring


viewer(LAYOUT, Wiring, unpack_wiring)
