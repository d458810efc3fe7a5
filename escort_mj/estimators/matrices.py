"""Matrices of beliefs, row by row, in place: corrections, mixtures."""

from __future__ import annotations

from escort_mj.knowledge.belief import LEAST_VARIANCE
from escort_mj.native.fields import Array
from escort_mj.native.kernels import inlined


@inlined
def correct(
    x: Array, covariance: Array, first: int, row: Array, place: Array, off: float, error: float, gain: Array
) -> None:
    """Correct a belief by one number.

    Args:
        x: Of the belief, shape (size,).
        covariance: Its covariance, row by row, shape (size^2,).
        first: Of the coordinates that the number depends on: 0 for the position, p for the velocity.
        row: How it depends on these, shape (p,).
        place: Where it was linearized, shape (p,).
        off: What was measured, less what was expected there.
        error: The variance of its error.
        gain: Scratch, shape (size,) or more.
    """
    p, size = row.shape[0], x.shape[0]
    variance = max(error, LEAST_VARIANCE)
    for a in range(size):
        gain[a] = 0.0
        for k in range(p):
            gain[a] += covariance[a * size + first + k] * row[k]
    for k in range(p):
        variance += row[k] * gain[first + k]
        off -= row[k] * (x[first + k] - place[k])
    for a in range(size):
        x[a] += gain[a] * off / variance
        for b in range(size):
            covariance[a * size + b] -= gain[a] * gain[b] / variance


@inlined
def mix(x: Array, a: Array, other: Array, b: Array, weight: float, inverse: Array) -> None:
    """Mix two beliefs as if they were independent, with covariances A = P_1 / w and B = P_2 / (1 - w).

    Args:
        x: Of the first belief, shape (size,); changed to that of the mixture.
        a: Its covariance, row by row, shape (size^2,); likewise.
        other: Of the second belief; changed: scratch.
        b: Its covariance; likewise.
        weight: w.
        inverse: Scratch, shape (size^2,).
    """
    size = x.shape[0]
    for k in range(size * size):
        a[k] /= weight
        inverse[k] = a[k] + b[k] / (1.0 - weight)
    invert(inverse, size)
    for k in range(size):
        other[k] -= x[k]
    for row in range(size):  # b becomes K = A (A + B)^-1
        for column in range(size):
            total = 0.0
            for k in range(size):
                total += a[row * size + k] * inverse[k * size + column]
            b[row * size + column] = total
    for k in range(size * size):
        inverse[k] = a[k]
    for row in range(size):
        for k in range(size):
            x[row] += b[row * size + k] * other[k]
        for column in range(size):
            for k in range(size):
                a[row * size + column] -= b[row * size + k] * inverse[k * size + column]
    for row in range(size):  # what rounding makes of the other half would grow
        for column in range(row):
            a[row * size + column] = a[column * size + row]


@inlined
def invert(matrix: Array, size: int) -> None:
    """Invert a positive definite matrix, row by row, in place: elimination needs no other pivots there."""
    for k in range(size):
        pivot = 1.0 / matrix[k * size + k]
        matrix[k * size + k] = 1.0
        for column in range(size):
            matrix[k * size + column] *= pivot
        for row in range(size):
            if row == k:
                continue
            factor = matrix[row * size + k]
            matrix[row * size + k] = 0.0
            for column in range(size):
                matrix[row * size + column] -= factor * matrix[k * size + column]
