"""Properties of the equations of motion, checked on MuJoCo's own mass matrix by differences of it.

MuJoCo has no Coriolis matrix: only the bias force C v + g. The Christoffel symbols of the mass matrix give C.
"""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

DIFFERENCE = 1e-4  # of a coordinate [m or rad]: rounding and truncation of a central difference are small


class Residuals(NamedTuple):
    """How far a tree of bodies is from what mechanics says.

    Attributes:
        skew: Largest entry of the symmetric part of dM/dt - 2 C, shape (trees,) [kg/s and the like].
        coriolis: Largest of |C v + g - bias|, shape (trees,) [N or N m].
    """

    skew: Array
    coriolis: Array


class MassProperties:
    """Differences of a model's mass matrix, all kinematic trees at once.

    Coordinates are those of slides and hinges. Of a free joint only the translations take part: they move the
    whole tree, whose mass matrix does not depend on them. So what is checked is the motion without turning.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        self.model = model
        self.scratch = mujoco.MjData(model)
        joints = [
            (int(model.jnt_qposadr[j]) + k, int(model.jnt_dofadr[j]) + k)
            for j in range(model.njnt)
            for k in range(_straight_coordinates(model.jnt_type[j]))
        ]
        self.qpos, self.dofs = np.array(joints, dtype=int).reshape(-1, 2).T
        self.trees = model.dof_treeid[self.dofs]
        starts = np.searchsorted(self.trees, np.arange(model.ntree))
        self.places = np.arange(len(self.dofs)) - starts[self.trees]  # of each coordinate in its tree
        self.width = int(self.places.max(initial=-1)) + 1
        known = np.full(model.nv, -1)
        known[self.dofs] = np.arange(len(self.dofs))
        rows = np.repeat(np.arange(model.nv), model.M_rownnz)
        entries = np.concatenate(
            [start + np.arange(size) for start, size in zip(model.M_rowadr, model.M_rownnz, strict=True)]
        ).astype(int)
        columns = model.M_colind[entries]
        inside = (known[rows] >= 0) & (known[columns] >= 0)
        self.entries = entries[inside]
        self.row, self.column = known[rows[inside]], known[columns[inside]]

    def mass_matrices(self, qpos: Array) -> Array:
        """Mass matrix of every tree at a configuration, padded with zeros, shape (trees, width, width)."""
        self.scratch.qpos[:] = qpos
        mujoco.mj_kinematics(self.model, self.scratch)
        mujoco.mj_comPos(self.model, self.scratch)
        mujoco.mj_makeM(self.model, self.scratch)
        matrices = np.zeros((self.model.ntree, self.width, self.width))
        tree, row, column = self.trees[self.row], self.places[self.row], self.places[self.column]
        matrices[tree, row, column] = self.scratch.M[self.entries]
        matrices[tree, column, row] = self.scratch.M[self.entries]
        return matrices

    def bias(self, qpos: Array, qvel: Array) -> Array:
        """MuJoCo's bias force of every tree, padded with zeros, shape (trees, width)."""
        self.scratch.qpos[:], self.scratch.qvel[:] = qpos, qvel
        mujoco.mj_kinematics(self.model, self.scratch)
        mujoco.mj_comPos(self.model, self.scratch)
        mujoco.mj_comVel(self.model, self.scratch)
        force = np.zeros(self.model.nv)
        mujoco.mj_rne(self.model, self.scratch, 0, force)
        return self._by_tree(force)

    def _by_tree(self, values: Array) -> Array:
        """Values per velocity coordinate as rows per tree, shape (trees, width)."""
        rows = np.zeros((self.model.ntree, self.width))
        rows[self.trees, self.places] = values[self.dofs]
        return rows

    def _along(self, qpos: Array, velocity: Array) -> Array:
        """Rate of the mass matrices while every tree's coordinates move so, shape (trees, width, width)."""
        speed = max(float(np.abs(velocity).max(initial=0.0)), 1e-300)
        step = np.zeros(self.model.nq)
        step[self.qpos] = DIFFERENCE / speed * velocity[self.trees, self.places]
        ahead, behind = self.mass_matrices(qpos + step), self.mass_matrices(qpos - step)
        return (ahead - behind) * speed / (2.0 * DIFFERENCE)

    def coriolis(self, qpos: Array, qvel: Array) -> Array:
        """C of every tree from Christoffel symbols, shape (trees, width, width).

        C_ij = sum_k (dM_ij/dq_k + dM_ik/dq_j - dM_jk/dq_i) v_k / 2.
        """
        velocity = self._by_tree(qvel)
        slopes = np.stack(
            [self._along(qpos, np.eye(self.width)[[k] * self.model.ntree]) for k in range(self.width)],
            axis=-1,
        )  # (trees, i, j, k): dM_ij / dq_k
        symbols = slopes + slopes.swapaxes(2, 3) - np.moveaxis(slopes, 3, 1)
        return 0.5 * np.einsum("tijk,tk->tij", symbols, velocity)

    def residuals(self, qpos: Array, qvel: Array) -> Residuals:
        """Checks property 2, and C itself against MuJoCo's bias force.

        dM/dt is a difference along the motion, C one along each coordinate: two ways to the same end.

        Args:
            qpos: Configuration, shape (nq,).
            qvel: Velocity, shape (nv,).
        """
        if self.width == 0:
            return Residuals(np.zeros(self.model.ntree), np.zeros(self.model.ntree))
        velocity = self._by_tree(qvel)
        coriolis = self.coriolis(qpos, qvel)
        twice = self._along(qpos, velocity) - 2.0 * coriolis
        skew = np.abs(0.5 * (twice + twice.swapaxes(1, 2))).max(axis=(1, 2))
        force = np.einsum("tij,tj->ti", coriolis, velocity)
        moving = np.zeros(self.model.nv)
        moving[self.dofs] = qvel[self.dofs]
        gravity = self.bias(qpos, np.zeros(self.model.nv))
        return Residuals(skew, np.abs(force + gravity - self.bias(qpos, moving)).max(axis=1))


def _straight_coordinates(joint: int) -> int:
    """How many of a joint's coordinates are numbers that may simply be added to, and come first."""
    kinds = mujoco.mjtJoint
    return {kinds.mjJNT_FREE: 3, kinds.mjJNT_BALL: 0, kinds.mjJNT_SLIDE: 1, kinds.mjJNT_HINGE: 1}[
        kinds(joint)
    ]
