"""Reads the mass matrix where MuJoCo keeps it: the lower triangle, row by row, without its zeros."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from escort_mj.native.kernels import DOUBLE, double_at, inlined, int_at, vector_at
from escort_mj.native.lanes import WIDTH, everywhere, load, total

INT = 4  # bytes


@inlined
def kinetic_energy(
    mass: int, row_sizes: int, row_starts: int, columns: int, velocities: int, count: int, entries: int
) -> float:
    """Kinetic energy v M v / 2 of all degrees of freedom [J].

    Args:
        mass: Address of `mjData.M`, the entries.
        row_sizes: Address of `mjModel.M_rownnz`, entries in each row.
        row_starts: Address of `mjModel.M_rowadr`, first entry of each row.
        columns: Address of `mjModel.M_colind`, column of each entry.
        velocities: Address of `mjData.qvel`.
        count: Number of degrees of freedom.
        entries: Number of entries of the mass matrix.
    """
    if entries == count:
        return _energy_apart(vector_at(mass, count), vector_at(velocities, count))
    energy = 0.0
    for row in range(count):
        momentum = 0.0
        start = int_at(row_starts + INT * row)
        for entry in range(start, start + int_at(row_sizes + INT * row)):
            column = int_at(columns + INT * entry)
            share = 0.5 if column == row else 1.0
            momentum += share * double_at(mass + DOUBLE * entry) * double_at(velocities + DOUBLE * column)
        energy += momentum * double_at(velocities + DOUBLE * row)
    return energy


@inlined
def _energy_apart(mass: NDArray[np.float64], velocities: NDArray[np.float64]) -> float:
    """Kinetic energy where the mass matrix is diagonal [J]."""
    count, energies = mass.shape[0], everywhere(0.0)
    whole = count - count % WIDTH
    for at in range(0, whole, WIDTH):
        v = load(velocities, at)
        energies = energies + load(mass, at) * v * v
    energy = total(energies)
    for dof in range(whole, count):
        energy += mass[dof] * velocities[dof] * velocities[dof]
    return 0.5 * energy


@inlined
def mass_block(
    mass: int,
    row_sizes: int,
    row_starts: int,
    columns: int,
    first: int,
    count: int,
    block: NDArray[np.float64],
) -> None:
    """The square block of the mass matrix that belongs to consecutive degrees of freedom.

    Args:
        mass: Address of `mjData.M`, the entries.
        row_sizes: Address of `mjModel.M_rownnz`, entries in each row.
        row_starts: Address of `mjModel.M_rowadr`, first entry of each row.
        columns: Address of `mjModel.M_colind`, column of each entry.
        first: First degree of freedom of the block.
        count: Number of them.
        block: Result, row by row, shape (count * count,).
    """
    for a in range(count * count):
        block[a] = 0.0
    for a in range(count):
        start = int_at(row_starts + INT * (first + a))
        for entry in range(start, start + int_at(row_sizes + INT * (first + a))):
            b = int_at(columns + INT * entry) - first
            if b >= 0:
                value = double_at(mass + DOUBLE * entry)
                block[a * count + b] = value
                block[b * count + a] = value
