"""How the controller's robots are found in MuJoCo's arrays: addresses and groups, carried by the model."""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj.control.plan import SCALARS
from escort_mj.kernels import DOUBLE, shared, vector_at
from escort_mj.world.stages import SHADOW, Stage

Array = NDArray[np.float64]


PLAN_SIZE = SCALARS - 1  # place in the plan of its own length: the wiring stands behind it


class Group(IntEnum):
    """What a geom belongs to, for the contact watch."""

    NONE = 0  # the floor and anything else whose touch is no event
    ROBOT = 1
    OBSTACLE = 2
    TARGET = 3


class Wiring(NamedTuple):
    """Where things are in MuJoCo's arrays.

    Attributes:
        qpos_address: First position coordinate of each robot, shape (n,).
        dof_address: First velocity coordinate of each robot, shape (n,).
        tree_end: One past the last velocity coordinate of each robot's kinematic tree, shape (n,).
        target_address: Where each of the target's coordinates is in `mocap_pos`, shape (p,).
        target_offset: What is added to it there, shape (p,) [m].
        target_radius: Radius of the target, shape (1,) [m].
        geom_group: `Group` of each geom, shape (ngeom,).
    """

    qpos_address: Array
    dof_address: Array
    tree_end: Array
    target_address: Array
    target_offset: Array
    target_radius: Array
    geom_group: Array


def wire(model: mujoco.MjModel, robots: int, stages: Sequence[Stage]) -> Array:
    """The wiring of a compiled model as one flat vector, found by names.

    Args:
        model: A compiled model with bodies `robot_1` ..., `target` and their shadows; of other non-world
            bodies those without a shadow's name are obstacles.
        robots: Number of robots.
        stages: Where the axes of the mission are.
    """
    bodies = [model.body(f"robot_{i + 1}") for i in range(robots)]
    joints = [body.jntadr[0] for body in bodies]
    groups = np.zeros(model.ngeom)
    target = model.body("target").id
    ids = {body.id for body in bodies}
    for geom, body_id in enumerate(model.geom_bodyid):
        if body_id in ids:
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
    radius = model.geom("target_body").size[:1]
    return np.concatenate(
        [
            [robots, len(places), model.ngeom],
            model.jnt_qposadr[joints], dofs, ends, places, offsets, radius, groups,
        ]
    ).astype(float)  # fmt: skip


@shared
def wiring_behind(plan: int) -> Wiring:
    """Views the wiring that stands behind the plan at an address."""
    return unpack_wiring(plan + DOUBLE * int(vector_at(plan, SCALARS)[PLAN_SIZE]))


@shared
def unpack_wiring(address: int) -> Wiring:
    """Views the wiring at an address; nothing is copied, nothing owned."""
    sizes = vector_at(address, 3)
    n, p, geoms = int(sizes[0]), int(sizes[1]), int(sizes[2])
    robots = address + 3 * DOUBLE
    target = robots + DOUBLE * 3 * n
    return Wiring(
        vector_at(robots, n),
        vector_at(robots + DOUBLE * n, n),
        vector_at(robots + DOUBLE * 2 * n, n),
        vector_at(target, p),
        vector_at(target + DOUBLE * p, p),
        vector_at(target + DOUBLE * 2 * p, 1),
        vector_at(target + DOUBLE * (2 * p + 1), geoms),
    )
