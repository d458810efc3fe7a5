"""What a robot believes of the target: its position and derivatives of it, with their covariance.

Between two measurements the belief follows the model of a constant velocity that white acceleration disturbs,
or of a constant acceleration that white jerk disturbs (Bar-Shalom, Li, Kirubarajan, Estimation with
Applications to Tracking and Navigation, 2001, sections 6.2.2 and 6.2.3).
"""

from __future__ import annotations

from typing import Annotated, Any

from escort_mj.components.setup import MissionSetup
from escort_mj.components.teams import of_teams
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import inlined
from escort_mj.native.vectors import Vec, numbers_at, numbers_from, one_row, rows_at
from escort_mj.plan import Plan, State

MADE = 16  # beliefs that an estimator can make in one call
LEAST_VARIANCE = 1e-12  # of what is known exactly [m^2 or m^2/s^2]


class BeliefParameters(Fields):
    """Whether robots know only what they see and hear, and what they know at the start."""

    estimating: Annotated[bool, Value("1", "whether each robot has an estimate of its own")]
    start_deviation: Annotated[
        Array, 3, Value("m, m/s, m/s^2", "standard deviations of what robots know of the target at the start")
    ]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        return {"estimating": setup.estimating, "start_deviation": setup.start_deviation}


class BeliefState(Fields):
    """The belief of each robot."""

    belief: Annotated[
        Array, "estimating", "believed", Value("m, m/s, m/s^2", "position of the target and its derivatives")
    ]
    belief_covariance: Annotated[Array, "estimating", "believed*believed", Value("1", "of these, row by row")]
    belief_time: Annotated[Array, "estimating", Value("s", "at which they hold")]
    belief_fix: Annotated[Array, "estimating", Value("s", "time of the newest measurement in it")]
    message: Annotated[Array, 1, Value("1", "row of `sent_...` that is being heard; -1 while robots look")]
    belief_made: Annotated[Array, "made", "believed", Value("1", "beliefs under way, scratch")]
    covariance_made: Annotated[Array, "made", "believed*believed", Value("1", "likewise")]
    beliefs_made: Annotated[Array, 1, Value("1", "how many of these are in use")]
    belief_work: Annotated[Array, 2, "believed*believed", Value("1", "scratch: two such matrices")]


@inlined
def target_of(i: int, plan: Plan, state: State) -> Vec:
    """Return where robots i to i + 7 believe the target to be [m]."""
    return _believed(i, state.target_position_measured, state.target_estimate, state.team_center, plan, state)


@inlined
def target_velocity_of(i: int, plan: Plan, state: State) -> Vec:
    """Return how fast robots i to i + 7 believe the target to move [m/s]."""
    return _believed(
        i, state.target_velocity_measured, state.target_velocity_estimate, state.team_velocity, plan, state
    )  # fmt: skip


@inlined
def _believed(i: int, measured: Array, estimates: Array, of_team: Array, plan: Plan, state: State) -> Vec:
    """Return what robots believe: what the sensors show all of them, their estimates, or their team's."""
    if not plan.apart:
        return one_row(state, measured)
    if plan.estimating:
        return rows_at(state, estimates, i)
    return of_teams(i, of_team, state)


@inlined
def target_place(robot: int, plan: Plan, state: State) -> Vec:
    """Return where a robot believes the target to be [m]."""
    if plan.estimating:
        return numbers_at(state, state.target_estimate, robot)
    return target_shown(robot, plan, state)


@inlined
def target_speed(robot: int, plan: Plan, state: State) -> Vec:
    """Return how fast a robot believes the target to move [m/s]."""
    if plan.estimating:
        return numbers_at(state, state.target_velocity_estimate, robot)
    return target_speed_shown(robot, plan, state)


@inlined
def target_shown(robot: int, plan: Plan, state: State) -> Vec:
    """Return where the sensors show a robot's target to be, with teams the middle of its targets [m]."""
    if plan.team_radius.shape[0] > 0:
        return numbers_at(state, state.team_center, int(state.member_of[robot]) - 1)
    return numbers_from(state, state.target_position_measured, 0)


@inlined
def target_speed_shown(robot: int, plan: Plan, state: State) -> Vec:
    """Return how fast the sensors show it to move [m/s]."""
    if plan.team_radius.shape[0] > 0:
        return numbers_at(state, state.team_velocity, int(state.member_of[robot]) - 1)
    return numbers_from(state, state.target_velocity_measured, 0)


@inlined
def carry(x: Array, covariance: Array, p: int, elapsed: float, density: float) -> None:
    """Move a belief on by a time, in place: P becomes F P F^T + Q.

    Args:
        x: Position, velocity and, where they are estimated, accelerations, shape (size,).
        covariance: Theirs, row by row, shape (size^2,).
        p: Number of axes.
        elapsed: The time, not negative [s].
        density: Of the power spectrum of the noise that changes the last derivative.
    """
    size, half = x.shape[0], 0.5 * elapsed * elapsed
    far = 2 * p if size > 2 * p else 0  # from a coordinate to its second derivative
    for k in range(size - p):
        x[k] += elapsed * x[k + p] + (half * x[k + far] if far > 0 and k < p else 0.0)
    for a in range(size - p):
        for b in range(size):
            more = half * covariance[(a + far) * size + b] if far > 0 and a < p else 0.0
            covariance[a * size + b] += elapsed * covariance[(a + p) * size + b] + more
    for a in range(size):
        for b in range(size - p):
            more = half * covariance[a * size + b + far] if far > 0 and b < p else 0.0
            covariance[a * size + b] += elapsed * covariance[a * size + b + p] + more
    orders = size // p
    for c in range(orders):
        for d in range(orders):
            noise = density * white_noise(orders - 1 - c, orders - 1 - d, elapsed)
            for k in range(p):
                covariance[(c * p + k) * size + d * p + k] += noise


@inlined
def white_noise(c: int, d: int, elapsed: float) -> float:
    """Return the integral of (t^c / c!) (t^d / d!) over a time, for c and d up to 2."""
    power = elapsed
    for _ in range(c + d):
        power *= elapsed
    return power / ((c + d + 1.0) * (2.0 if c == 2 else 1.0) * (2.0 if d == 2 else 1.0))


@inlined
def trace(covariance: Array, p: int, size: int) -> float:
    """Return the sum of the variances of the position, of a covariance row by row [m^2]."""
    total = 0.0
    for k in range(p):
        total += covariance[k * size + k]
    return total
