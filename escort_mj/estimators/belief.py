"""What estimators are handed: a robot that sees, hears and believes; and beliefs, which they return.

A belief is a value: each method returns another one. Its matrices, up to 27 by 27, fit into no registers:
they lie in memory, of which each call has room for MADE.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from escort_mj.estimators.matrices import correct, mix
from escort_mj.knowledge.belief import MADE, carry, trace
from escort_mj.knowledge.sight import BEARING, POSITION, RANGE, VELOCITY
from escort_mj.native.fields import Array
from escort_mj.native.kernels import DOUBLE, inlined, stack_memory, vector_at
from escort_mj.native.lanes import copy_numbers
from escort_mj.native.values import Computed, maker_of
from escort_mj.native.vectors import Vec, numbers_at, numbers_from, set_numbers


class EstimatorView(NamedTuple):
    """What an estimator sees of all robots, and what it writes: the belief of one; n robots, p axes.

    A belief has k numbers: the target's position, its velocity and, for an estimator of it, acceleration.
    """

    timestep: float  # [s]
    way_variance: float  # of the way to the target, per axis; for a bearing, over the squared range [m^2]
    time: Annotated[Array, 1]  # [s]
    message: Annotated[Array, 1]  # row of `sent_...` that the robot hears; -1 while it sees the target
    q: Annotated[Array, "n", "p"]  # true position, for its shape [m]
    q_measured: Annotated[Array, "n", "p"]  # measured position [m]
    v_measured: Annotated[Array, "n", "p"]  # measured velocity [m/s]
    seen_position: Annotated[Array, "estimating", "p"]  # measured position of the target [m]
    seen_velocity: Annotated[Array, "estimating", "p"]  # likewise [m/s]
    seen_range: Annotated[Array, "estimating"]  # likewise: distance of the centers [m]
    seen_bearing: Annotated[Array, "estimating", "p"]  # likewise: direction, a unit vector
    sight_variance: Annotated[Array, 4]  # of these four, per axis; -1 for what is not measured
    sent_belief: Annotated[Array, "hearing*depth", "believed"]  # of the sender, when it sent the message
    sent_covariance: Annotated[Array, "hearing*depth", "believed*believed"]
    sent_belief_time: Annotated[Array, "hearing*depth"]  # at which that held [s]
    sent_fix: Annotated[Array, "hearing*depth"]  # time of the newest measurement in it [s]
    belief: Annotated[Array, "estimating", "believed"]  # written [m, m/s, m/s^2]
    belief_covariance: Annotated[Array, "estimating", "believed*believed"]  # written: of these, row by row
    belief_time: Annotated[Array, "estimating"]  # written: at which they hold [s]
    belief_fix: Annotated[Array, "estimating"]  # written: time of the newest measurement in it [s]
    belief_made: Annotated[Array, "made", "believed"]  # scratch
    covariance_made: Annotated[Array, "made", "believed*believed"]  # scratch
    beliefs_made: Annotated[Array, 1]  # how many of these are in use
    belief_work: Annotated[Array, 2, "believed*believed"]  # scratch


class Belief(Computed):
    """What a robot believes of the target at a time; SI units, world frame."""

    x: Array
    covariance: Array
    time: float
    fix: float
    seen: EstimatorView

    @property
    def position(self) -> Vec:
        """Position of the target [m]."""
        return numbers_from(self.seen, self.x, 0)

    @property
    def velocity(self) -> Vec:
        """Its velocity [m/s]."""
        return numbers_from(self.seen, self.x, self.seen.q.shape[1])

    @property
    def acceleration(self) -> Vec:
        """Its acceleration; 0 where none is estimated [m/s^2]."""
        p = self.seen.q.shape[1]
        if self.x.shape[0] > 2 * p:
            return numbers_from(self.seen, self.x, 2 * p)
        return 0.0 * self.velocity

    @property
    def spread(self) -> float:
        """Sum of the variances of the position [m^2]."""
        return trace(self.covariance, self.seen.q.shape[1], self.x.shape[0])

    def with_fix(self, fix: float) -> Belief:
        """Return it with another time of its newest measurement [s]."""
        return belief_of(self.x, self.covariance, self.time, fix, self.seen)

    def at(self, time: float, density: float) -> Belief:
        """Return it moved on to a time.

        Args:
            time: Not before its own [s].
            density: Of the power spectrum of the noise that changes the last derivative.
        """
        made = copied(self)
        carry(made.x, made.covariance, self.seen.q.shape[1], time - self.time, density)
        return belief_of(made.x, made.covariance, time, self.fix, self.seen)

    def with_position(self, measured: Vec, variance: float) -> Belief:
        """Return it corrected by a measured position, whose errors have a variance per axis [m^2]."""
        return corrected(self, 0, 0.0 * measured, 1.0, measured - self.position, variance, self.position)

    def with_velocity(self, measured: Vec, variance: float) -> Belief:
        """Return it corrected by a measured velocity likewise [m^2/s^2]."""
        p = self.seen.q.shape[1]
        return corrected(self, p, 0.0 * measured, 1.0, measured - self.velocity, variance, self.velocity)

    def with_range(self, unit: Vec, off: float, variance: float, about: Vec) -> Belief:
        """Return it corrected by a number that grows with the position along a unit vector.

        Args:
            unit: The vector.
            off: What was measured, less what was expected [m].
            variance: Of its error [m^2].
            about: The position for which it was expected [m].
        """
        made, p, memory = copied(self), self.seen.q.shape[1], stack_memory()
        row, place = vector_at(memory, p), vector_at(memory + DOUBLE * p, p)
        set_numbers(row, 0, unit)
        set_numbers(place, 0, about)
        correct(made.x, made.covariance, 0, row, place, off, variance, self.seen.belief_work[1])
        return made

    def with_bearing(self, unit: Vec, far: float, off: Vec, variance: float, about: Vec) -> Belief:
        """Return it corrected by a direction, which changes with the position across itself.

        Args:
            unit: The direction that was expected, a unit vector.
            far: The distance [m].
            off: What was measured, less what was expected.
            variance: Of its error, per axis [rad^2].
            about: The position for which it was expected [m].
        """
        return corrected(self, 0, unit, far, off, variance, about)

    def mixed(self, other: Belief, weight: float) -> Belief:
        """Return the mixture with another one: P^-1 = w P_1^-1 + (1 - w) P_2^-1.

        Args:
            other: Of the same time.
            weight: w, of its own.
        """
        made, spare = copied(self), copied(other)
        mix(made.x, made.covariance, spare.x, spare.covariance, weight, self.seen.belief_work[0])
        return made.with_fix(max(self.fix, other.fix))


belief_of = maker_of(Belief)


@inlined
def copied(belief: Belief) -> Belief:
    """Return a copy of a belief in memory of its own; without numbers where there is no more room."""
    seen = belief.seen
    slot = int(seen.beliefs_made[0])
    seen.beliefs_made[0] += 1.0
    x, covariance = seen.belief_made[min(slot, MADE - 1)], seen.covariance_made[min(slot, MADE - 1)]
    copy_numbers(belief.x, x, x.shape[0])
    copy_numbers(belief.covariance, covariance, covariance.shape[0])
    if slot >= MADE:
        x[:] = math.nan
    return belief_of(x, covariance, belief.time, belief.fix, seen)


@inlined
def corrected(
    belief: Belief, first: int, unit: Vec, far: float, off: Vec, variance: float, about: Vec
) -> Belief:  # fmt: skip
    """Return a belief corrected by numbers that depend on coordinates from one on as (1 - u u^T) / far."""
    made, p, work = copied(belief), belief.seen.q.shape[1], belief.seen.belief_work
    memory = stack_memory()
    across, place = vector_at(memory, p), vector_at(memory + DOUBLE * p, p)
    offs = vector_at(memory + DOUBLE * 2 * p, p)
    set_numbers(across, 0, unit)
    set_numbers(place, 0, about)
    set_numbers(offs, 0, off)
    for k in range(p):
        for c in range(p):
            work[0, c] = ((1.0 if c == k else 0.0) - across[k] * across[c]) / far
        correct(made.x, made.covariance, first, work[0, :p], place, offs[k], variance, work[1])
    return made


class Witness(Computed):
    """A robot that sees the target or hears a teammate, and what it believes; SI units, world frame."""

    i: int
    seen: EstimatorView

    @property
    def q(self) -> Vec:
        """Its measured position [m]."""
        return numbers_at(self.seen, self.seen.q_measured, self.i)

    @property
    def v(self) -> Vec:
        """Its measured velocity [m/s]."""
        return numbers_at(self.seen, self.seen.v_measured, self.i)

    @property
    def seen_position(self) -> Vec:
        """Measured position of the target [m]."""
        return numbers_at(self.seen, self.seen.seen_position, self.i)

    @property
    def seen_velocity(self) -> Vec:
        """Its measured velocity [m/s]."""
        return numbers_at(self.seen, self.seen.seen_velocity, self.i)

    @property
    def seen_range(self) -> float:
        """Measured distance between the centers [m]."""
        return self.seen.seen_range[self.i]

    @property
    def seen_bearing(self) -> Vec:
        """Measured direction of the target, a unit vector."""
        return numbers_at(self.seen, self.seen.seen_bearing, self.i)

    @property
    def position_variance(self) -> float:
        """Variance of a measured position, per axis; -1 where none is measured [m^2]."""
        return self.seen.sight_variance[POSITION]

    @property
    def velocity_variance(self) -> float:
        """Of a velocity, likewise [m^2/s^2]."""
        return self.seen.sight_variance[VELOCITY]

    @property
    def range_variance(self) -> float:
        """Of a distance, likewise [m^2]."""
        return self.seen.sight_variance[RANGE]

    @property
    def bearing_variance(self) -> float:
        """Of a direction, likewise, but for errors of the way [rad^2]."""
        return self.seen.sight_variance[BEARING]

    @property
    def way_variance(self) -> float:
        """Variance of the way to the target, per axis [m^2]."""
        return self.seen.way_variance

    @property
    def time(self) -> float:
        """Time of the mission [s]."""
        return self.seen.time[0]

    @property
    def timestep(self) -> float:
        """Physics step [s]."""
        return self.seen.timestep

    @property
    def belief(self) -> Belief:
        """What the robot believes."""
        seen, i = self.seen, self.i
        times = seen.belief_time[i], seen.belief_fix[i]
        return belief_of(seen.belief[i], seen.belief_covariance[i], times[0], times[1], seen)

    @property
    def heard(self) -> Belief:
        """What the sender of the message believed, when it sent it."""
        seen, row = self.seen, int(self.seen.message[0])
        times = seen.sent_belief_time[row], seen.sent_fix[row]
        return belief_of(seen.sent_belief[row], seen.sent_covariance[row], times[0], times[1], seen)

    def believe(self, position: Vec, velocity: Vec) -> Belief:
        """Return the belief that the target is at a place now, and moves so; all else stays as it was."""
        made = copied(self.belief)
        set_numbers(made.x, 0, position)
        set_numbers(made.x, self.seen.q.shape[1], velocity)
        return belief_of(made.x, made.covariance, self.time, self.time, self.seen)


witness_of = maker_of(Witness)
