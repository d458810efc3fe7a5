"""Estimators with matrices: Kalman filters, covariance intersection, consensus."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache, singledispatch

import numpy as np
from numpy.typing import NDArray

from escort_mj.estimators.belief import EstimatorView
from escort_mj.estimators.consensus import Consensus
from escort_mj.estimators.covariance_intersection import CovarianceIntersection
from escort_mj.estimators.estimator import Estimator
from escort_mj.estimators.hold import Hold
from escort_mj.estimators.kalman import Kalman
from escort_mj.knowledge.belief import LEAST_VARIANCE
from escort_mj.knowledge.sight import BEARING, POSITION, RANGE, VELOCITY

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Belief:
    """What one robot believes of the target.

    Attributes:
        x: Position, velocity and, where they are estimated, accelerations, shape (size,).
        covariance: Of these, shape (size, size).
        time: At which they hold [s].
        fix: Time of the newest measurement in it [s].
    """

    x: Array
    covariance: Array
    time: float
    fix: float

    def at(self, time: float, axes: int, density: float) -> Belief:
        """Return the belief at a later time, F x and F P F^T + Q.

        Args:
            time: [s].
            axes: p.
            density: Of the power spectrum of the noise that changes the last derivative.
        """
        step, noise = _motion(len(self.x) // axes, time - self.time, axes, density)
        covariance = step @ self.covariance @ step.T + noise
        return replace(self, x=step @ self.x, covariance=covariance, time=time)

    def spread(self, axes: int) -> float:
        """Return the sum of the variances of the position [m^2]."""
        return float(np.trace(self.covariance[:axes, :axes]))


@lru_cache(256)
def _motion(orders: int, elapsed: float, axes: int, density: float) -> tuple[Array, Array]:
    """Return F and Q."""
    powers = [elapsed**k / math.factorial(k) for k in range(orders)]
    motion = np.sum([power * np.eye(orders, k=k) for k, power in enumerate(powers)], axis=0)
    way = np.arange(orders)[::-1]
    scale = np.array([math.factorial(k) for k in way])
    total = way[:, None] + way + 1
    noise = density * elapsed**total / total / np.outer(scale, scale)
    return np.kron(motion, np.eye(axes)), np.kron(noise, np.eye(axes))


@singledispatch
def update(estimator: Estimator, view: EstimatorView, robot: int) -> None:
    """Change the belief of a robot by what it sees or hears, by its equations unless there are matrices."""
    type(estimator).evaluation(lambda function: function, estimator.equations())(estimator, view, robot)


@update.register
def _update_of_kalman(estimator: Kalman, view: EstimatorView, robot: int) -> None:
    """Correct the belief by one measured number after the other, or mix in what is heard."""
    time, p = float(view.time[0]), view.q_measured.shape[1]
    now = believed(view, robot).at(time, p, estimator.density)
    if view.message[0] < 0:
        x, covariance = now.x, now.covariance
        for h, y, r in zip(*linearized(now.x, view, robot), strict=True):
            column = covariance @ h
            variance = r + h @ column
            x = x + column * (y - h @ (x - now.x)) / variance
            covariance = covariance - np.outer(column, column) / variance
        found = Belief(x, covariance, time, time)
    else:
        said = heard(view)
        found = mixture(estimator, now, said.at(time, p, estimator.density), p)
        found = replace(found, fix=max(now.fix, said.fix))
    believe(found, view, robot)


@singledispatch
def mixture(estimator: Kalman, own: Belief, other: Belief, axes: int) -> Belief:
    """Return the surer of a robot's own belief and that of another one, both of now."""
    return other if other.spread(axes) < own.spread(axes) else own


def believed(view: EstimatorView, robot: int) -> Belief:
    """Return what a robot believes."""
    return _belief(view.belief, view.belief_covariance, view.belief_time, view.belief_fix, robot)


def heard(view: EstimatorView) -> Belief:
    """Return what the sender of the message that is heard believed."""
    row = int(view.message[0])
    return _belief(view.sent_belief, view.sent_covariance, view.sent_belief_time, view.sent_fix, row)


def _belief(x: Array, covariance: Array, time: Array, fix: Array, row: int) -> Belief:
    """Return the belief in one row."""
    size = x.shape[1]
    return Belief(
        x[row].copy(), covariance[row].reshape(size, size).copy(), float(time[row]), float(fix[row])
    )


def believe(belief: Belief, view: EstimatorView, robot: int) -> None:
    """Write what a robot believes."""
    view.belief[robot], view.belief_covariance[robot] = belief.x, belief.covariance.ravel()
    view.belief_time[robot], view.belief_fix[robot] = belief.time, belief.fix


def linearized(x: Array, view: EstimatorView, robot: int) -> tuple[Array, Array, Array]:
    """Return the measurements as linear functions of the state near x.

    Args:
        x: Position, velocity and, where they are estimated, accelerations, shape (size,).
        view: What was measured.
        robot: By whom.

    Returns:
        H, shape (k, size), what was measured less what was expected, shape (k,), and variances, shape (k,).
    """
    p = view.q_measured.shape[1]
    way = x[:p] - view.q_measured[robot]
    distance = max(float(np.linalg.norm(way)), math.sqrt(LEAST_VARIANCE))
    unit, none = way / distance, np.zeros((p, len(x) - p))
    moving = np.eye(p, len(x), k=p)
    across = np.eye(p) - np.outer(unit, unit)
    parts = {
        POSITION: (np.hstack([np.eye(p), none]), view.seen_position[robot] - x[:p]),
        RANGE: (np.hstack([unit, none[0]])[None], np.array([view.seen_range[robot] - distance])),
        BEARING: (np.hstack([across / distance, none]), across @ view.seen_bearing[robot]),
        VELOCITY: (moving, view.seen_velocity[robot] - moving @ x),
    }
    errors = list(view.sight_variance)
    errors[BEARING] += view.way_variance / distance**2
    used = [
        (h, y, max(errors[k], LEAST_VARIANCE)) for k, (h, y) in parts.items() if view.sight_variance[k] >= 0.0
    ]
    rows = [np.full(len(y), r) for _, y, r in used]
    return np.vstack([h for h, _, _ in used]), np.concatenate([y for _, y, _ in used]), np.concatenate(rows)


@mixture.register
def _mixture_of_covariance_intersection(
    estimator: CovarianceIntersection, own: Belief, other: Belief, axes: int
) -> Belief:
    """Return the mixture of both beliefs."""
    share = weight(estimator, own, other, axes)
    first, second = np.linalg.inv(own.covariance), np.linalg.inv(other.covariance)
    covariance = np.linalg.inv(share * first + (1.0 - share) * second)
    x = covariance @ (share * first @ own.x + (1.0 - share) * second @ other.x)
    return replace(own, x=x, covariance=covariance)


@singledispatch
def weight(estimator: CovarianceIntersection, own: Belief, other: Belief, axes: int) -> float:
    """Return the weight of a robot's own belief."""
    return other.spread(axes) / (own.spread(axes) + other.spread(axes))


@weight.register
def _weight_of_consensus(estimator: Consensus, own: Belief, other: Belief, axes: int) -> float:
    """Return the weight of a robot's own belief."""
    return 1.0 - estimator.share


@update.register
def _update_of_hold(estimator: Hold, view: EstimatorView, robot: int) -> None:
    """Take over what is measured, or heard and newer."""
    heard = int(view.message[0])
    if heard < 0:
        view.belief[robot] = np.concatenate([view.seen_position[robot], view.seen_velocity[robot]])
        view.belief_time[robot] = view.belief_fix[robot] = view.time[0]
    elif view.sent_fix[heard] > view.belief_fix[robot]:
        view.belief[robot] = view.sent_belief[heard]
        view.belief_time[robot] = view.sent_belief_time[heard]
        view.belief_fix[robot] = view.sent_fix[heard]
