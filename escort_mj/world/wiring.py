"""How the controller's robots are found in MuJoCo's arrays: addresses and groups, carried by the model."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj.control.plan import SCALARS
from escort_mj.kernels import DOUBLE, shared, vector_at

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
        geom_group: `Group` of each geom, shape (ngeom,).
    """

    qpos_address: Array
    dof_address: Array
    tree_end: Array
    geom_group: Array


def wire(model: mujoco.MjModel, robots: int) -> Array:
    """The wiring of a compiled model as one flat vector, found by names.

    Args:
        model: A compiled model with bodies `robot_1` ..., `target`; other non-world bodies are obstacles.
        robots: Number of robots.
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
        elif body_id != 0:
            groups[geom] = Group.OBSTACLE
    dofs = model.jnt_dofadr[joints]
    trees = model.dof_treeid[dofs]
    ends = model.tree_dofadr[trees] + model.tree_dofnum[trees]
    return np.concatenate([[robots, model.ngeom], model.jnt_qposadr[joints], dofs, ends, groups]).astype(
        float
    )


@shared
def wiring_behind(plan: int) -> Wiring:
    """Views the wiring that stands behind the plan at an address."""
    return unpack_wiring(plan + DOUBLE * int(vector_at(plan, SCALARS)[PLAN_SIZE]))


@shared
def unpack_wiring(address: int) -> Wiring:
    """Views the wiring at an address; nothing is copied, nothing owned."""
    sizes = vector_at(address, 2)
    n, geoms = int(sizes[0]), int(sizes[1])
    at = address + 2 * DOUBLE
    block = DOUBLE * n
    return Wiring(
        vector_at(at, n),
        vector_at(at + block, n),
        vector_at(at + 2 * block, n),
        vector_at(at + 3 * block, geoms),
    )
