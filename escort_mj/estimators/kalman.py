"""A Kalman filter of the target on each robot, extended for ranges and bearings."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from pydantic import PositiveFloat

from escort_mj.estimators.estimator import Estimator
from escort_mj.knowledge.belief import LEAST_VARIANCE, Belief, carry, trace
from escort_mj.knowledge.sight import BEARING, POSITION, RANGE, VELOCITY, Look
from escort_mj.native.fields import Array
from escort_mj.native.kernels import DOUBLE, inlined, merged, stack_memory, vector_at

if TYPE_CHECKING:
    from escort_mj.memory.layout import Plan, State


class Kalman(Estimator):
    """A Kalman filter of the target on each robot (Bar-Shalom, Li, Kirubarajan 2001, sections 5.2, 10.3).

    Its model is a target of constant velocity or acceleration that white noise disturbs; ranges and bearings
    are linearized. Of what teammates believe, a robot takes over what is surer than its own belief: unlike a
    mixture of both, that stays consistent, however the two depend on each other.
    """

    estimator: Literal["kalman"] = "kalman"
    model: Literal["velocity", "acceleration"] = "velocity"
    """What the target keeps but for noise: its `velocity` or its `acceleration`."""
    noise: PositiveFloat = 0.5
    """Root of the spectral density of this noise: of the acceleration [m/s^1.5] or, for the model
    `acceleration`, of the jerk [m/s^2.5]."""

    @property
    def orders(self) -> int:
        """How many derivatives of the position a belief has, the position among them."""
        return 3 if self.model == "acceleration" else 2

    @property
    def density(self) -> float:
        """Spectral density of the noise that changes the last of them."""
        return self.noise**2

    def seen(self, belief: Belief, look: Look, time: float) -> Belief:
        """Return the belief that is corrected by all that is measured: x + K y, P - K H P."""
        now = belief.at(time, len(look.eye), self.density)
        h, y, r = linearized(now.x, look)
        gain = np.linalg.solve(h @ now.covariance @ h.T + np.diag(r), h @ now.covariance).T
        return Belief(now.x + gain @ y, now.covariance - gain @ h @ now.covariance, time, time)

    def heard(self, belief: Belief, said: Belief, time: float) -> Belief:
        """Return the surer of both beliefs."""
        axes = len(belief.x) // self.orders
        own, other = belief.at(time, axes, self.density), said.at(time, axes, self.density)
        return replace(other if other.spread(axes) < own.spread(axes) else own, fix=max(own.fix, other.fix))

    def see_kernel(self: Any, i: int, plan: Plan, state: State) -> None:
        """Correct the belief of robot i by all that is measured, one number after the other, compiled."""
        move_belief(i, self.noise * self.noise, state)
        correct(i, plan, state)
        state.belief_fix[i] = state.time[0]

    def hear_kernel(self: Any, i: int, message: int, plan: Plan, state: State) -> None:
        """Take over what is surer, compiled."""
        density, p, size = self.noise * self.noise, state.q.shape[1], state.belief.shape[1]
        move_belief(i, density, state)
        x, covariance = carried_message(message, density, state)
        if trace(covariance, p, size) < trace(state.belief_covariance[i], p, size):
            for k in range(size):
                state.belief[i, k] = x[k]
            for k in range(size * size):
                state.belief_covariance[i, k] = covariance[k]
        state.belief_fix[i] = max(state.belief_fix[i], state.sent_fix[message])


@inlined
def move_belief(i: int, density: float, state: State) -> None:
    """Move the belief of robot i on to the present time."""
    elapsed = state.time[0] - state.belief_time[i]
    carry(state.belief[i], state.belief_covariance[i], state.q.shape[1], elapsed, density)
    state.belief_time[i] = state.time[0]


@merged
def carried_message(message: int, density: float, state: State) -> tuple[Array, Array]:
    """Return state and covariance of a message at the present time; both are scratch."""
    size = state.belief.shape[1]
    x, covariance = state.belief_work[0, :size], state.belief_work[1]
    for k in range(size):
        x[k] = state.sent_belief[message, k]
    for k in range(size * size):
        covariance[k] = state.sent_covariance[message, k]
    carry(x, covariance, state.q.shape[1], state.time[0] - state.sent_belief_time[message], density)
    return x, covariance


@inlined
def correct(i: int, plan: Plan, state: State) -> None:
    """Correct the belief of robot i by its measurements: linearized once, then number by number."""
    p, variance, x = state.q.shape[1], plan.sight_variance, state.belief[i]
    memory = stack_memory()
    place, row = vector_at(memory, p), vector_at(memory + DOUBLE * p, p)
    gain, square = vector_at(memory + DOUBLE * 2 * p, state.belief.shape[1]), 0.0
    for k in range(p):
        place[k], row[k] = x[k], 0.0
        square += (x[k] - state.q_measured[i, k]) ** 2
    distance = math.sqrt(max(square, LEAST_VARIANCE))
    if variance[POSITION] >= 0.0:
        for k in range(p):
            row[k] = 1.0
            _correct_one(
                i, 0, row, place, state.seen_position[i, k] - place[k], variance[POSITION], gain, state
            )
            row[k] = 0.0
    if variance[RANGE] >= 0.0:
        for k in range(p):
            row[k] = (place[k] - state.q_measured[i, k]) / distance
        _correct_one(i, 0, row, place, state.seen_range[i] - distance, variance[RANGE], gain, state)
    if variance[BEARING] >= 0.0:
        along, error = 0.0, variance[BEARING] + plan.way_variance / (distance * distance)
        for k in range(p):
            along += state.seen_bearing[i, k] * (place[k] - state.q_measured[i, k]) / distance
        for k in range(p):
            unit = (place[k] - state.q_measured[i, k]) / distance
            for c in range(p):
                across = (1.0 if c == k else 0.0) - unit * (place[c] - state.q_measured[i, c]) / distance
                row[c] = across / distance
            off = state.seen_bearing[i, k] - along * unit
            _correct_one(i, 0, row, place, off, error, gain, state)
    if variance[VELOCITY] >= 0.0:
        for k in range(p):
            place[k], row[k] = x[p + k], 0.0
        for k in range(p):
            row[k] = 1.0
            _correct_one(
                i, p, row, place, state.seen_velocity[i, k] - place[k], variance[VELOCITY], gain, state
            )
            row[k] = 0.0


@inlined
def _correct_one(
    i: int, first: int, row: Array, place: Array, off: float, error: float, gain: Array, state: State
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
        state: The belief is changed.
    """
    p, size = row.shape[0], gain.shape[0]
    x, covariance = state.belief[i], state.belief_covariance[i]
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


# The same in plain NumPy.


def linearized(x: Array, look: Look) -> tuple[Array, Array, Array]:
    """Return the measurements as linear functions of the state near x.

    Args:
        x: Position, velocity and, where they are estimated, accelerations, shape (size,).
        look: What was measured.

    Returns:
        H, shape (k, size), what was measured less what was expected, shape (k,), and variances, shape (k,).
    """
    p = len(look.eye)
    way = x[:p] - look.eye
    distance = max(float(np.linalg.norm(way)), math.sqrt(LEAST_VARIANCE))
    unit, none = way / distance, np.zeros((p, len(x) - p))
    moving = np.eye(p, len(x), k=p)
    across = np.eye(p) - np.outer(unit, unit)
    parts = {
        POSITION: (np.hstack([np.eye(p), none]), look.position - x[:p]),
        VELOCITY: (moving, look.velocity - moving @ x),
        RANGE: (np.hstack([unit, none[0]])[None], np.array([look.range - distance])),
        BEARING: (np.hstack([across / distance, none]), across @ look.bearing),
    }
    errors = list(look.variance)
    errors[BEARING] += look.way_variance / distance**2
    used = [(h, y, max(errors[k], LEAST_VARIANCE)) for k, (h, y) in parts.items() if look.variance[k] >= 0.0]
    rows = [np.full(len(y), r) for _, y, r in used]
    return np.vstack([h for h, _, _ in used]), np.concatenate([y for _, y, _ in used]), np.concatenate(rows)
