"""What robots know by themselves: the tables `knowledge` and `communication`."""

import math
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import Discriminator, Field, NonNegativeFloat, PositiveFloat, Tag

from escort_mj.components.parameters import Parameters
from escort_mj.estimators import ESTIMATORS, Predict
from escort_mj.estimators import Estimator as AnyEstimator
from escort_mj.knowledge.links import Radio, Silence
from escort_mj.knowledge.sight import MEASURES, NOT_MEASURED, Sight
from escort_mj.scenario.schema.fields import one_of_kinds

if TYPE_CHECKING:
    Estimator: TypeAlias = AnyEstimator
else:
    Estimator = one_of_kinds(ESTIMATORS, "estimator", "predict")

DERIVATIVES = ("position", "velocity", "acceleration")
ALL_HEARD = 16  # teammates of a complete graph up to whom a robot has a slot for each
HEARD = 8  # teammates that a robot of a larger team listens to, if nothing else is said
Share = Annotated[float, Field(ge=0.0, lt=1.0)]
RobotNumber = Annotated[int, Field(ge=1)]
Robots: TypeAlias = Annotated[tuple[RobotNumber, ...], Field(min_length=1)]


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


class TargetSight(Parameters):
    """How robots measure the target."""

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
    noise: SightNoise = SightNoise()
    """Normally distributed errors of the measurements, added to those of `sensing.target_position` and
    `sensing.target_velocity`."""
    dropout: Share = 0.0
    """Probability that a look yields no measurement [1]."""
    outliers: Outliers | None = None
    """Measurements that are wrong by more than the noise; null: none."""


class InitialKnowledge(Parameters):
    """Standard deviations of the errors in each robot's initial knowledge of the target."""

    position: NonNegativeFloat = 0.0
    """Standard deviation of the position, per axis [m]."""
    velocity: NonNegativeFloat = 0.0
    """Standard deviation of the velocity, per axis [m/s]."""
    acceleration: NonNegativeFloat = 0.0
    """Standard deviation of the acceleration, per axis [m/s^2]; for estimators whose model contains an
    acceleration."""


class Knowledge(Parameters):
    """What robots know about the target: what they see and, with `communication`, what they hear."""

    target: TargetSight = TargetSight()
    """How robots measure the target."""
    estimator: Estimator = Predict()
    """How each robot estimates the target from what it sees and hears: a name, or a table with parameters."""
    initial: InitialKnowledge = InitialKnowledge()
    """Accuracy of what robots know of the target at the start, or when they change teams."""


class Loss(Parameters):
    """Loss of messages in bursts: a Markov chain with a good and a bad state on each link."""

    mean: Annotated[float, Field(gt=0.0, lt=1.0)]
    """Share of lost messages [1]."""
    burst: Annotated[float, Field(ge=1.0)]
    """Mean number of messages lost in a row."""


class Nearest(Parameters):
    """Each robot hears the robots nearest to it."""

    nearest: Annotated[int, Field(ge=1, le=64)]
    """Number of teammates that a robot hears."""


class Edges(Parameters):
    """The two robots of each listed pair hear each other."""

    edges: Annotated[tuple[tuple[RobotNumber, RobotNumber], ...], Field(min_length=1)]
    """Pairs of robot numbers."""


class Blackout(Parameters):
    """A period in which some messages do not get through.

    If neither `robots` nor `groups` is set, no message gets through.
    """

    after: NonNegativeFloat = 0.0
    """Start [s]."""
    before: PositiveFloat | None = None
    """End [s]; null: the end of the run."""
    robots: Robots | None = None
    """Robots whose radio fails: they neither hear other robots nor are heard."""
    groups: Annotated[tuple[Robots, ...], Field(min_length=2)] | None = None
    """Groups of robots that hear each other but not other groups; the robots not listed form one more group.
    """


def _graph_of(value: Any) -> str | None:
    """Tell how a graph is given."""
    if isinstance(value, Nearest) or (isinstance(value, dict) and "nearest" in value):
        return "nearest"
    if isinstance(value, Edges) or (isinstance(value, dict) and "edges" in value):
        return "edges"
    return "name" if value in ("complete", "ring") else None


def _loss_of(value: Any) -> str:
    """Tell a share from bursts."""
    return "bursts" if isinstance(value, dict | Loss) else "share"


def _delay_of(value: Any) -> str:
    """Tell one delay from the bounds of many."""
    return "bounds" if isinstance(value, list | tuple) else "one"


Graph = Annotated[
    Annotated[Literal["complete", "ring"], Tag("name")]
    | Annotated[Nearest, Tag("nearest")]
    | Annotated[Edges, Tag("edges")],
    Discriminator(
        _graph_of,
        custom_error_type="graph",
        custom_error_message="complete, ring, a table with nearest or a table with edges",
    ),
]
AnyLoss = Annotated[Annotated[Share, Tag("share")] | Annotated[Loss, Tag("bursts")], Discriminator(_loss_of)]
Delay = Annotated[
    Annotated[NonNegativeFloat, Tag("one")]
    | Annotated[tuple[NonNegativeFloat, NonNegativeFloat], Tag("bounds")],
    Discriminator(_delay_of),
]


class Communication(Parameters):
    """How robots communicate. Each sends its position, its velocity and its estimate of the target."""

    graph: Graph = "complete"
    """Which robots can hear each other: `complete`, `ring` in the order of the robots' numbers, `{nearest:
    k}` or `{edges: [[1, 2], ...]}`."""
    range: PositiveFloat | None = None
    """Largest distance between robots that hear each other [m]; null: any."""
    measure: Literal["center", "surface"] = "center"
    """Whether `range` is measured between centers or surfaces."""
    blocked: bool = False
    """Whether obstacles and walls between two robots block their messages."""
    rate: PositiveFloat | None = None
    """Messages per second of each robot [1/s], a whole number of physics steps apart; null: at every
    step."""
    delay: Delay = 0.0
    """Time that a message takes [s]: one number, or the bounds of a uniform distribution."""
    jitter: NonNegativeFloat = 0.0
    """Largest random delay before a message is sent [s]; the delay is uniformly distributed."""
    loss: AnyLoss = 0.0
    """Share of messages that are lost [1]: a number if losses are independent, `{mean: 0.2, burst: 5}` for
    bursts."""
    timeout: PositiveFloat | None = 1.0
    """Age beyond which a robot disregards what it has heard from a teammate [s]; null: never."""
    neighbors: Annotated[int, Field(ge=1, le=64)] | None = None
    """Largest number of teammates that a robot hears at once; null: all in a team of up to 17, else 8."""
    blackouts: Annotated[tuple[Blackout, ...], Field(max_length=64)] = ()
    """Periods in which some messages do not get through."""


def sight_of(knowledge: Knowledge, timestep: float, count: int) -> Sight:
    """Return how robots see the target, in the controller's numbers.

    Args:
        knowledge: The table.
        timestep: Physics step [s].
        count: Number of robots.
    """
    target = knowledge.target
    noise = [getattr(target.noise, name) if name in target.measures else NOT_MEASURED for name in MEASURES]
    outliers = target.outliers
    return Sight(
        tuple(target.robots is None or robot in target.robots for robot in range(1, count + 1)),
        np.inf if target.range is None else target.range,
        steps_of(target.rate, timestep),
        tuple(noise),
        target.dropout,
        outliers.share if outliers else 0.0,
        outliers.size if outliers else 0.0,
        target.hidden,
        target.hidden_by_teammates,
        np.inf if target.field_of_view is None else target.field_of_view,
    )


def radio_of(communication: Communication, timestep: float, count: int) -> Radio:
    """Return how robots communicate, in the controller's numbers.

    Args:
        communication: The table.
        timestep: Physics step [s].
        count: Number of robots.
    """
    delay, loss = communication.delay, communication.loss
    least, most = delay if isinstance(delay, tuple) else (delay, delay)
    fail, recover = (loss, 1.0 - loss) if isinstance(loss, float) else _chain(loss)
    return Radio(
        senders_of(communication, count),
        steps_of(communication.rate, timestep),
        round(communication.jitter / timestep),
        (round(least / timestep), round(most / timestep)),
        np.inf if communication.range is None else communication.range,
        communication.measure == "surface",
        fail,
        recover,
        np.inf if communication.timeout is None else communication.timeout,
        tuple(_silence(each, count) for each in communication.blackouts),
        communication.blocked,
    )


def steps_of(rate: float | None, timestep: float) -> int:
    """Return how many physics steps apart events of a rate are; null stands for every step."""
    return 1 if rate is None else max(round(1.0 / (rate * timestep)), 1)


def _chain(loss: Loss) -> tuple[float, float]:
    """Return with which probabilities a link fails and recovers: mean = fail / (fail + recover)."""
    recover = 1.0 / loss.burst
    return recover * loss.mean / (1.0 - loss.mean), recover


def _silence(blackout: Blackout, count: int) -> Silence:
    """Return the parts of a team during a blackout: robots alone have numbers of their own."""
    part = list(range(1, count + 1)) if blackout.robots is None and blackout.groups is None else [0] * count
    for number, group in enumerate(blackout.groups or (), count + 1):
        for robot in group:
            part[robot - 1] = number
    for robot in blackout.robots or ():
        part[robot - 1] = robot
    return Silence(blackout.after, np.inf if blackout.before is None else blackout.before, tuple(part))


def senders_of(communication: Communication, count: int) -> NDArray[np.int64]:
    """Return whom each robot hears in each slot, from 0, -1 for anybody, shape (n, slots)."""
    graph, robots = communication.graph, np.arange(count)
    if isinstance(graph, Edges):
        pairs = {pair for edge in graph.edges for pair in (edge, edge[::-1])}
        heard = [sorted({a - 1 for a, b in pairs if b == robot + 1 and a != b}) for robot in robots]
    elif graph == "ring":
        heard = [sorted({(i - 1) % count, (i + 1) % count} - {i}) for i in range(count)]
    else:
        few = communication.neighbors or (ALL_HEARD if count <= ALL_HEARD + 1 else HEARD)
        few = min(graph.nearest if isinstance(graph, Nearest) else few, count - 1)
        if few < count - 1 or count == 1:
            return np.full((count, few), -1, dtype=np.int64)
        heard = [[j for j in range(count) if j != i] for i in range(count)]
    slots = max(map(len, heard))
    return np.array([row + [-2] * (slots - len(row)) for row in heard], dtype=np.int64).reshape(count, slots)
