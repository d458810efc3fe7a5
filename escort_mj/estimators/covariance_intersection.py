"""A Kalman filter on each robot, and what teammates believe mixed in by covariance intersection."""

from typing import Any, Literal

from escort_mj.estimators.estimator import EstimatorView
from escort_mj.estimators.kalman import Kalman, hear, see
from escort_mj.knowledge.belief import trace
from escort_mj.native.fields import Array
from escort_mj.native.kernels import inlined


class CovarianceIntersection(Kalman):
    """A Kalman filter on each robot, and covariance intersection of beliefs (Julier, Uhlmann 1997).

    Two beliefs with the covariances P_1 and P_2 are fused into one with the covariance P, where P^-1 = w
    P_1^-1 + (1 - w) P_2^-1. P is consistent whatever information the two beliefs share; w follows from the
    traces of P_1 and P_2 (Niehsen 2002).
    """

    estimator: Literal["covariance_intersection"] = "covariance_intersection"  # type: ignore[assignment]

    def update(self: Any, view: EstimatorView, robot: int) -> None:
        """Correct the belief by what is measured, or mix it with a message, compiled."""
        density, p, size = self.noise * self.noise, view.q_measured.shape[1], view.belief.shape[1]
        if view.message[0] < 0:
            see(robot, density, view)
            return
        x, covariance = hear(robot, density, view)
        own, other = trace(view.belief_covariance[robot], p, size), trace(covariance, p, size)
        weight, spare = other / (own + other), view.belief_work[2]
        mix(view.belief[robot], view.belief_covariance[robot], x, covariance, weight, spare)


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
