"""A Kalman filter of the target on each robot, extended for ranges and bearings."""

import math
from typing import Any, Literal

from pydantic import PositiveFloat

from escort_mj.estimators.estimator import Estimator, EstimatorView
from escort_mj.knowledge.belief import LEAST_VARIANCE, carry, trace
from escort_mj.knowledge.sight import BEARING, POSITION, RANGE, VELOCITY
from escort_mj.native.fields import Array
from escort_mj.native.kernels import DOUBLE, inlined, merged, stack_memory, vector_at


class Kalman(Estimator):
    """A Kalman filter of the target on each robot (Bar-Shalom, Li, Kirubarajan 2001, sections 5.2, 10.3).

    The model is a target of constant velocity or acceleration, disturbed by white noise; measurements of
    range and bearing are linearized. A robot adopts a teammate's belief that is more certain than its own.
    The adopted belief, unlike a mixture of the two, is consistent however they are correlated.
    """

    estimator: Literal["kalman"] = "kalman"
    model: Literal["velocity", "acceleration"] = "velocity"
    """Motion model of the target: constant `velocity` or constant `acceleration`, except for noise."""
    noise: PositiveFloat = 0.5
    """Square root of the spectral density of the model's noise, in the acceleration [m/s^1.5] or, for the
    model `acceleration`, in the jerk [m/s^2.5]."""

    @property
    def orders(self) -> int:
        """How many derivatives of the position a belief has, the position among them."""
        return 3 if self.model == "acceleration" else 2

    @property
    def density(self) -> float:
        """Spectral density of the noise that changes the last of them."""
        return self.noise**2

    def update(self: Any, view: EstimatorView, robot: int) -> None:
        """Correct the belief by one measured number after the other, or take over what is surer, compiled."""
        density, p, size = self.noise * self.noise, view.q_measured.shape[1], view.belief.shape[1]
        if view.message[0] < 0:
            see(robot, density, view)
            return
        x, covariance = hear(robot, density, view)
        if trace(covariance, p, size) < trace(view.belief_covariance[robot], p, size):
            for k in range(size):
                view.belief[robot, k] = x[k]
            for k in range(size * size):
                view.belief_covariance[robot, k] = covariance[k]


@inlined
def see(i: int, density: float, view: EstimatorView) -> None:
    """Move the belief of robot i on to the present time, and correct it by all that is measured."""
    elapsed = view.time[0] - view.belief_time[i]
    carry(view.belief[i], view.belief_covariance[i], view.q_measured.shape[1], elapsed, density)
    correct(i, view)
    view.belief_time[i] = view.belief_fix[i] = view.time[0]


@merged
def hear(i: int, density: float, view: EstimatorView) -> tuple[Array, Array]:
    """Move the belief of robot i on to the present time; return what it hears at that time, in scratch.

    Returns:
        State and covariance, row by row, of the message.
    """
    p, size, message = view.q_measured.shape[1], view.belief.shape[1], int(view.message[0])
    elapsed = view.time[0] - view.belief_time[i]
    carry(view.belief[i], view.belief_covariance[i], p, elapsed, density)
    view.belief_time[i] = view.time[0]
    view.belief_fix[i] = max(view.belief_fix[i], view.sent_fix[message])
    x, covariance = view.belief_work[0, :size], view.belief_work[1]
    for k in range(size):
        x[k] = view.sent_belief[message, k]
    for k in range(size * size):
        covariance[k] = view.sent_covariance[message, k]
    carry(x, covariance, p, view.time[0] - view.sent_belief_time[message], density)
    return x, covariance


@inlined
def correct(i: int, view: EstimatorView) -> None:
    """Correct the belief of robot i by its measurements: linearized once, then number by number."""
    p, variance, x = view.q_measured.shape[1], view.sight_variance, view.belief[i]
    memory = stack_memory()
    place, row = vector_at(memory, p), vector_at(memory + DOUBLE * p, p)
    gain, square = vector_at(memory + DOUBLE * 2 * p, view.belief.shape[1]), 0.0
    for k in range(p):
        place[k], row[k] = x[k], 0.0
        square += (x[k] - view.q_measured[i, k]) ** 2
    distance = math.sqrt(max(square, LEAST_VARIANCE))
    if variance[POSITION] >= 0.0:
        for k in range(p):
            row[k] = 1.0
            _correct_one(
                i, 0, row, place, view.seen_position[i, k] - place[k], variance[POSITION], gain, view
            )
            row[k] = 0.0
    if variance[RANGE] >= 0.0:
        for k in range(p):
            row[k] = (place[k] - view.q_measured[i, k]) / distance
        _correct_one(i, 0, row, place, view.seen_range[i] - distance, variance[RANGE], gain, view)
    if variance[BEARING] >= 0.0:
        along, error = 0.0, variance[BEARING] + view.way_variance / (distance * distance)
        for k in range(p):
            along += view.seen_bearing[i, k] * (place[k] - view.q_measured[i, k]) / distance
        for k in range(p):
            unit = (place[k] - view.q_measured[i, k]) / distance
            for c in range(p):
                across = (1.0 if c == k else 0.0) - unit * (place[c] - view.q_measured[i, c]) / distance
                row[c] = across / distance
            off = view.seen_bearing[i, k] - along * unit
            _correct_one(i, 0, row, place, off, error, gain, view)
    if variance[VELOCITY] >= 0.0:
        for k in range(p):
            place[k], row[k] = x[p + k], 0.0
        for k in range(p):
            row[k] = 1.0
            _correct_one(
                i, p, row, place, view.seen_velocity[i, k] - place[k], variance[VELOCITY], gain, view
            )
            row[k] = 0.0


@inlined
def _correct_one(
    i: int, first: int, row: Array, place: Array, off: float, error: float, gain: Array, view: EstimatorView
) -> None:
    """Correct the belief of robot i by one number.

    Args:
        i: The robot.
        first: Of the coordinates that the number depends on: 0 for the position, p for the velocity.
        row: How it depends on these, shape (p,).
        place: Where it was linearized, shape (p,).
        off: What was measured, less what was expected there.
        error: The variance of its error.
        gain: Scratch, shape (size,).
        view: The belief is changed.
    """
    p, size = row.shape[0], gain.shape[0]
    x, covariance = view.belief[i], view.belief_covariance[i]
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
