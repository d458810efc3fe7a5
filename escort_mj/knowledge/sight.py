"""Who sees the target, and what is measured then (docs/knowledge.md).

A robot looks at a rate of its own. What it looks at is the target as the sensors of `sensing` show it; each
measurement has normal noise. Sometimes nothing comes of a look, and sometimes an outlier.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, NonNegativeFloat, PositiveFloat

from escort_mj.components.component import Component, Derived, block_at, reader
from escort_mj.components.found import shipped
from escort_mj.components.parameters import Parameters
from escort_mj.components.rays import is_between, mate_between
from escort_mj.components.setup import MissionSetup
from escort_mj.knowledge.belief import target_shown, target_speed_shown
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import inlined, stack_memory, vector_at
from escort_mj.native.on_demand import on_demand_unrolled
from escort_mj.native.vectors import Vec, dot, norm, numbers_at, numbers_from, set_numbers_at
from escort_mj.numerics.gaussian import SIGHT, fractions, normals
from escort_mj.plan import Plan, State
from escort_mj.radios.radio import Robots, Share

MEASURES = ("position", "velocity", "range", "bearing")
POSITION, VELOCITY, RANGE, BEARING = range(4)
NOT_MEASURED = -1.0
NORMALS, OUTLIERS = 2, 64  # blocks of a stream where these begin


class SightNoise(Parameters):
    """Standard deviations of the normally distributed errors with which robots measure the target."""

    position: NonNegativeFloat = 0.0
    """Standard deviation of the position, per axis [m]."""
    velocity: NonNegativeFloat = 0.0
    """Standard deviation of the velocity, per axis [m/s]."""
    range: NonNegativeFloat = 0.0
    """Standard deviation of the distance [m]."""
    bearing: Annotated[float, Field(ge=0.0, le=0.5)] = 0.0
    """Standard deviation of the direction [rad]."""


class Outliers(Parameters):
    """Measurements that are wrong by more than the noise."""

    share: Share
    """Probability of an outlier [1]."""
    size: PositiveFloat
    """Largest additional error of the distance, and of the position per axis [m]."""


class TargetSight(Component):
    """How robots measure the target."""

    python_only: ClassVar[frozenset[str]] = Component.python_only | {
        "robots",
        "field_of_view",
        "measures",
        "noise",
        "outliers",
    }

    robots: Robots | None = None
    """Robots, by number, that can see the target (with `teams`: all targets of their team); null: all
    robots."""
    range: PositiveFloat | None = None
    """Distance up to which robots see the target, surface to surface [m]; null: any."""
    field_of_view: Annotated[float, Field(gt=0.0, lt=2.0 * math.pi)] | None = None
    """Opening angle of the cone around a robot's heading in which the robot sees the target [rad]; null: all
    around."""
    hidden: bool = False
    """Whether obstacles and walls hide the target."""
    hidden_by_teammates: bool = False
    """Whether teammates hide the target."""
    rate: PositiveFloat | None = None
    """Looks per second [1/s], a whole number of physics steps apart; null: at every step."""
    measures: Annotated[
        tuple[Literal["position", "velocity", "range", "bearing"], ...], Field(min_length=1)
    ] = (
        "position",
        "velocity",
    )
    """Measured quantities: `position` and `velocity` in the world frame, `range` and `bearing` from the
    robot."""
    noise: SightNoise = SightNoise.model_construct()
    """Normally distributed errors of the measurements, added to those of `sensing.target_position` and
    `sensing.target_velocity`."""
    dropout: Share = 0.0
    """Probability that a look yields no measurement [1]."""
    outliers: Outliers | None = None
    """Measurements that are wrong by more than the noise; null: none."""

    def deviation(self, quantity: str) -> float:
        """Return the standard deviation of one of MEASURES [m, m/s, m, rad]; -1 for what is not measured."""
        return float(getattr(self.noise, quantity)) if quantity in self.measures else NOT_MEASURED

    position_deviation = Derived(lambda sight: sight.deviation("position"))
    velocity_deviation = Derived(lambda sight: sight.deviation("velocity"))
    range_deviation = Derived(lambda sight: sight.deviation("range"))
    bearing_deviation = Derived(lambda sight: sight.deviation("bearing"))

    @Derived
    def outlier_share(self) -> float:
        """Return the probability of an outlier."""
        return self.outliers.share if self.outliers else 0.0

    @Derived
    def outlier_size(self) -> float:
        """Return the largest error of one, per axis [m]."""
        return self.outliers.size if self.outliers else 0.0

    @Derived
    def cosine(self) -> float:
        """Return the least cosine of the angle between a robot's heading and its way to the target."""
        return -1.0 if self.field_of_view is None else math.cos(0.5 * self.field_of_view)


class SightParameters(Fields):
    """Who sees the target; how, `TargetSight` says."""

    sight: Annotated[Array, "looking", Value("1", "1 for robots that can see it")]
    sight_place: Annotated[int, Value("1", "where its block in `parameters` begins")]
    sight_variance: Annotated[
        Array,
        4,
        Value(
            "m^2, m^2/s^2, m^2, rad^2",
            "of MEASURES, with the errors of `sensing`; -1 for what is not measured",
        ),
    ]
    way_variance: Annotated[
        float,
        Value("m^2", "of the way to the target, per axis; of a bearing, divided by the squared distance"),
    ]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        sight: TargetSight = setup.sight or TargetSight.model_construct()
        looking = range(1, setup.count + 1) if setup.estimating else ()
        variance, of_way = variances(sight, setup)
        return {
            "sight_place": setup.sight or 0,
            "sight": [sight.robots is None or robot in sight.robots for robot in looking],
            "sight_variance": variance,
            "way_variance": of_way,
        }


shipped.add(TargetSight)
read_sight = reader(TargetSight)


@inlined
def sight_of(plan: Plan) -> Any:
    """Return how robots see the target."""
    return read_sight(block_at(plan.sight_place, plan), 0)


def variances(sight: TargetSight, setup: MissionSetup) -> tuple[tuple[float, ...], float]:
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
        for noise, more in zip(map(sight.deviation, MEASURES), (place, rate, own + place, 0.0), strict=True)
    )
    return found, own + place


class SightState(Fields):
    """The last measurements of the target, and which way robots look."""

    heading: Annotated[
        Array, "facing", "p", Value("1", "x axis of each body, as far as it lies in the mission's axes")
    ]
    seen_position: Annotated[Array, "estimating", "p", Value("m", "measured position")]
    seen_velocity: Annotated[Array, "estimating", "p", Value("m/s", "measured velocity")]
    seen_range: Annotated[Array, "estimating", Value("m", "measured distance of the centers")]
    seen_bearing: Annotated[Array, "estimating", "p", Value("1", "measured direction, a unit vector")]


@on_demand_unrolled
def sight_target(plan: Plan, state: State) -> None:
    """Measures the target for all robots that see it: `target_seen`, `seen_...`."""
    step, sight = int(state.step[0]), sight_of(plan)
    for i in range(plan.sight.shape[0]):
        state.target_seen[i] = 0.0
        if plan.sight[i] == 0.0 or state.lost[i] != 0.0 or not in_view(i, plan, state):
            continue
        missed, odd, _, _ = fractions(plan.seed, 1, SIGHT, i, step)
        if missed < sight.dropout:
            continue
        state.target_seen[i] = 1.0
        _measure(i, odd < sight.outlier_share, step, plan, state)


@inlined
def in_view(i: int, plan: Plan, state: State) -> bool:
    """Whether a robot sees its target, with teams all of its targets: only then it knows their middle."""
    targets = plan.target_team.shape[0]
    for place in range(max(targets, 1)):
        point, radius, j = numbers_from(state, state.target_position, 0), plan.target_radius, -1
        if targets > 0:
            j = int(plan.target_obstacle[place])
            if state.obstacle_team[j] != state.member_of[i]:
                continue
            point, radius = numbers_at(state, state.obstacle_position, j), plan.obstacle_radius[j]
        if not _sees(i, point, radius, j, plan, state):
            return False
    return True


@inlined
def _sees(i: int, point: Vec, radius: float, j: int, plan: Plan, state: State) -> bool:
    """Whether a target is near enough to a robot and in its field of view, and nothing hides it.

    Args:
        i: The robot.
        point: Where the target is [m].
        radius: Of the target [m].
        j: Which obstacle it is, from 0; -1 for none.
        plan: Gives the sight.
        state: Gives where everything is.
    """
    q, sight = numbers_at(state, state.q, i), sight_of(plan)
    way = point - q
    if norm(way) - plan.robot_radius[i] - radius > sight.range:
        return False
    if state.heading.shape[0] > 0:
        heading = numbers_at(state, state.heading, i)
        if dot(way, heading) < sight.cosine * math.sqrt(dot(way, way) * dot(heading, heading)):
            return False
    if sight.hidden and is_between(q, way, j, plan, state):
        return False
    return not (sight.hidden_by_teammates and mate_between(i, q, way, plan, state))


@inlined
def _measure(i: int, odd: bool, step: int, plan: Plan, state: State) -> None:
    """Measures the target for one robot."""
    p, sight = state.q.shape[1], sight_of(plan)
    drawn = vector_at(stack_memory(), 3 * p + 1)
    normals(3 * p + 1, plan.seed, NORMALS, SIGHT, i, step, drawn)
    c, c_dot = target_shown(i, plan, state), target_speed_shown(i, plan, state)
    position = c + sight.position_deviation * numbers_from(state, drawn, 0)
    set_numbers_at(state.seen_position, i, position)
    velocity = c_dot + sight.velocity_deviation * numbers_from(state, drawn, p)
    set_numbers_at(state.seen_velocity, i, velocity)
    error = 2.0 * sight.outlier_size if odd else 0.0
    for k in range(p if odd else 0):
        amiss, _, _, _ = fractions(plan.seed, OUTLIERS + k, SIGHT, i, step)
        state.seen_position[i, k] += error * (amiss - 0.5)
    way = c - numbers_at(state, state.q, i)
    distance = norm(way)
    state.seen_range[i] = distance + sight.range_deviation * drawn[3 * p]
    if odd:
        amiss, _, _, _ = fractions(plan.seed, OUTLIERS + p, SIGHT, i, step)
        state.seen_range[i] += error * (amiss - 0.5)
    bearing, turns = way / max(distance, 1e-300), numbers_from(state, drawn, 2 * p)
    bearing = bearing + sight.bearing_deviation * (turns - dot(bearing, turns) * bearing)
    set_numbers_at(state.seen_bearing, i, bearing / math.sqrt(max(dot(bearing, bearing), 1e-300)))
