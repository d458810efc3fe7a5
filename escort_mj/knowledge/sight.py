"""Who sees the target, and what is measured then (docs/knowledge.md).

A robot looks at a rate of its own. What it looks at is the target as the sensors of `sensing` show it; each
measurement has normal noise. Sometimes nothing comes of a look, and sometimes an outlier.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

from escort_mj.components.rays import is_between, mate_between
from escort_mj.components.setup import MissionSetup
from escort_mj.knowledge.belief import target_shown, target_speed_shown
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import inlined, stack_memory, vector_at
from escort_mj.native.on_demand import on_demand
from escort_mj.numerics.gaussian import SIGHT, fractions, normals
from escort_mj.plan import Plan, State

MEASURES = ("position", "velocity", "range", "bearing")
POSITION, VELOCITY, RANGE, BEARING = range(4)
NOT_MEASURED = -1.0
NORMALS, OUTLIERS = 2, 64  # blocks of a stream where these begin


class Sight(NamedTuple):
    """How robots see the target.

    Attributes:
        robots: Which of them can, shape (n,).
        reach: How far, surface to surface [m].
        every: Physics steps between two looks.
        noise: Standard deviation of each of MEASURES [m, m/s, m, rad]; -1 for what is not measured.
        dropout: Probability that nothing comes of a look.
        outliers: Probability of an outlier.
        outlier: Largest error of one, per axis [m].
        opaque: Whether obstacles hide the target.
        behind_mates: Whether teammates hide it.
        field: Opening angle of the cone around a robot's heading in which it sees [rad]; inf for all around.
    """

    robots: tuple[bool, ...]
    reach: float = math.inf
    every: int = 1
    noise: tuple[float, ...] = (0.0, 0.0, NOT_MEASURED, NOT_MEASURED)
    dropout: float = 0.0
    outliers: float = 0.0
    outlier: float = 0.0
    opaque: bool = False
    behind_mates: bool = False
    field: float = math.inf


class SightParameters(Fields):
    """How robots see the target."""

    sight: Annotated[Array, "looking", Value("1", "1 for robots that can see it")]
    sight_reach: Annotated[float, Value("m", "how far, surface to surface")]
    sight_target: Annotated[float, Value("m", "the target's radius")]
    sight_every: Annotated[int, Value("1", "physics steps between two looks")]
    sight_noise: Annotated[
        Array, 4, Value("m, m/s, m, rad", "standard deviations of MEASURES; -1 for what is not measured")
    ]
    sight_variance: Annotated[
        Array, 4, Value("m^2, m^2/s^2, m^2, rad^2", "of MEASURES, with the errors of `sensing`; -1 likewise")
    ]
    way_variance: Annotated[
        float,
        Value("m^2", "of the way to the target, per axis; of a bearing, divided by the squared distance"),
    ]
    sight_dropout: Annotated[float, Value("1", "probability that nothing comes of a look")]
    sight_outliers: Annotated[float, Value("1", "probability of an outlier")]
    sight_outlier: Annotated[float, Value("m", "largest error of one, per axis")]
    sight_opaque: Annotated[bool, Value("1", "whether obstacles hide the target")]
    sight_behind_mates: Annotated[bool, Value("1", "whether teammates hide it")]
    sight_cosine: Annotated[float, Value("1", "least cosine of the angle between heading and way to it")]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        sight = setup.sight or Sight(())
        variance, of_way = variances(sight, setup)
        return {
            "sight": [float(can) for can in sight.robots],
            "sight_reach": sight.reach,
            "sight_target": setup.target_radius or 0.0,
            "sight_every": sight.every,
            "sight_noise": sight.noise,
            "sight_variance": variance,
            "way_variance": of_way,
            "sight_dropout": sight.dropout,
            "sight_outliers": sight.outliers,
            "sight_outlier": sight.outlier,
            "sight_opaque": sight.opaque,
            "sight_behind_mates": sight.behind_mates,
            "sight_cosine": math.cos(0.5 * min(sight.field, 2.0 * math.pi)),
        }


def variances(sight: Sight, setup: MissionSetup) -> tuple[tuple[float, ...], float]:
    """Return the variances that an estimator expects, with the noise and rounding of `sensing`.

    Ranges and bearings are measured from where a robot is to where `sensing` shows the target, and evaluated
    from where it measures itself to be.

    Returns:
        Of each of MEASURES [m^2, m^2/s^2, m^2, rad^2], -1 for what is not measured; and of the way to the
        target, per axis [m^2]: that of the range contains it, and a bearing's is larger by it, divided by the
        squared distance.
    """
    own, place, rate = (
        sensor.variance(setup.axes)
        for sensor in (setup.sensing.position, setup.sensing.target_position, setup.sensing.target_velocity)
    )
    found = tuple(
        NOT_MEASURED if noise < 0.0 else noise * noise + more
        for noise, more in zip(sight.noise, (place, rate, own + place, 0.0), strict=True)
    )
    return found, own + place


class SightState(Fields):
    """The last measurements of the target, and which way robots look."""

    heading: Annotated[
        Array, "facing", "p", Value("1", "x axis of each body, as far as it lies in the mission's axes")
    ]
    seen_position: Annotated[Array, "informed", "p", Value("m", "measured position")]
    seen_velocity: Annotated[Array, "informed", "p", Value("m/s", "measured velocity")]
    seen_range: Annotated[Array, "informed", Value("m", "measured distance of the centers")]
    seen_bearing: Annotated[Array, "informed", "p", Value("1", "measured direction, a unit vector")]


@on_demand
def sight_target(plan: Plan, state: State) -> None:
    """Measures the target for all robots that see it: `target_seen`, `seen_...`."""
    step = int(state.step[0])
    for i in range(plan.sight.shape[0]):
        state.target_seen[i] = 0.0
        if plan.sight[i] == 0.0 or state.lost[i] != 0.0 or not in_view(i, plan, state):
            continue
        missed, odd, _, _ = fractions(plan.seed, 1, SIGHT, i, step)
        if missed < plan.sight_dropout:
            continue
        state.target_seen[i] = 1.0
        _measure(i, odd < plan.sight_outliers, step, plan, state)


@inlined
def in_view(i: int, plan: Plan, state: State) -> bool:
    """Whether a robot sees its target, with teams all of its targets: only then it knows their middle."""
    targets = plan.target_team.shape[0]
    for place in range(max(targets, 1)):
        point, radius, j = state.target_position, plan.sight_target, -1
        if targets > 0:
            j = int(plan.target_obstacle[place])
            if state.obstacle_team[j] != state.member_of[i]:
                continue
            point, radius = state.obstacle_position[j], plan.obstacle_radius[j]
        if not _sees(i, point, radius, j, plan, state):
            return False
    return True


@inlined
def _sees(i: int, point: Array, radius: float, j: int, plan: Plan, state: State) -> bool:
    """Whether a target is near enough to a robot and in its field of view, and nothing hides it.

    Args:
        i: The robot.
        point: Where the target is, shape (p,) [m].
        radius: Of the target [m].
        j: Which obstacle it is, from 0; -1 for none.
        plan: Gives the sight.
        state: Gives where everything is.
    """
    p, square = state.q.shape[1], 0.0
    way = vector_at(stack_memory(), p)
    for k in range(p):
        way[k] = point[k] - state.q[i, k]
        square += way[k] * way[k]
    if math.sqrt(square) - plan.robot_radius[i] - radius > plan.sight_reach:
        return False
    if state.heading.shape[0] > 0:
        ahead, length = 0.0, 0.0
        for k in range(p):
            ahead += way[k] * state.heading[i, k]
            length += state.heading[i, k] ** 2
        if ahead < plan.sight_cosine * math.sqrt(square * length):
            return False
    if plan.sight_opaque and is_between(state.q[i], way, j, plan, state):
        return False
    return not (plan.sight_behind_mates and mate_between(i, state.q[i], way, plan, state))


@inlined
def _measure(i: int, odd: bool, step: int, plan: Plan, state: State) -> None:
    """Measures the target for one robot."""
    p, noise, square, aside = state.q.shape[1], plan.sight_noise, 0.0, 0.0
    memory = stack_memory()
    drawn = vector_at(memory, 3 * p + 1)
    c, c_dot = target_shown(i, plan, state), target_speed_shown(i, plan, state)
    normals(3 * p + 1, plan.seed, NORMALS, SIGHT, i, step, drawn)
    error = 2.0 * plan.sight_outlier if odd else 0.0
    for k in range(p):
        state.seen_position[i, k] = c[k] + noise[POSITION] * drawn[k]
        state.seen_velocity[i, k] = c_dot[k] + noise[VELOCITY] * drawn[p + k]
        if odd:
            amiss, _, _, _ = fractions(plan.seed, OUTLIERS + k, SIGHT, i, step)
            state.seen_position[i, k] += error * (amiss - 0.5)
        way = c[k] - state.q[i, k]
        square += way * way
    distance = math.sqrt(square)
    state.seen_range[i] = distance + noise[RANGE] * drawn[3 * p]
    if odd:
        amiss, _, _, _ = fractions(plan.seed, OUTLIERS + p, SIGHT, i, step)
        state.seen_range[i] += error * (amiss - 0.5)
    for k in range(p):
        way = (c[k] - state.q[i, k]) / max(distance, 1e-300)
        state.seen_bearing[i, k] = way
        aside += way * drawn[2 * p + k]
    length = 0.0
    for k in range(p):
        way = state.seen_bearing[i, k]
        state.seen_bearing[i, k] += noise[BEARING] * (drawn[2 * p + k] - aside * way)
        length += state.seen_bearing[i, k] ** 2
    for k in range(p):
        state.seen_bearing[i, k] /= math.sqrt(max(length, 1e-300))
