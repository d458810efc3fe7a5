"""What must hold for a run to pass: one table per kind of expectation, told apart by the key naming it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    ClassVar,
    Literal,
    NamedTuple,
    TypeAlias,
    Union,
    get_args,
)

from pydantic import (
    BeforeValidator,
    Discriminator,
    Field,
    NonNegativeFloat,
    NonNegativeInt,
    PlainValidator,
    PositiveFloat,
    Tag,
    WithJsonSchema,
)
from pydantic_core import PydanticCustomError

from escort_mj.components.parameters import Parameters
from escort_mj.metrics import METRIC_NAMES, METRICS
from escort_mj.metrics.metric import Metric
from escort_mj.scenario.schema.fields import TEXT

_SIDE = "a group (robots, target, obstacles, walls, floor) or the name of a body"
Sides = tuple[str, str]


def _sides(*words: str) -> Any:
    """Type of a pair of groups or bodies, or of one of the words that stand for many pairs."""
    wanted = ", ".join((*words, f"{'or ' if words else ''}a list of two, each {_SIDE}"))
    choices: list[dict[str, Any]] = [{"enum": list(words)}] if words else []
    pair = {"type": "array", "items": {"type": "string"}, "minItems": 2, "maxItems": 2}

    def read(value: Any) -> str | Sides:
        if isinstance(value, str) and value in words:
            return value
        if isinstance(value, list | tuple) and len(value) == 2 and all(isinstance(x, str) for x in value):
            return value[0], value[1]
        raise PydanticCustomError("choice", "{wanted}", {"wanted": wanted})

    return Annotated[
        Literal[words] | Sides if words else Sides,
        PlainValidator(read),
        WithJsonSchema({"anyOf": [*choices, pair]}),
    ]


class Demand(Parameters):
    """What every expectation has."""

    kind: ClassVar[str]
    """The key that names it."""

    xfail: Annotated[str, Field(min_length=1, max_length=300, pattern=TEXT)] | None = None
    """Why it is known to fail: it passes as long as it does not hold, and fails as soon as it does."""

    @property
    def subject(self) -> str:
        """What is looked at, in words."""
        return self.kind

    @property
    def window(self) -> tuple[float, float | None]:
        """Start and end of the time that it looks at [s], both included; None is the end of the run."""
        return 0.0, None

    @property
    def watched(self) -> bool:
        """Whether it reads what is watched between samples, such as clearances."""
        return False


class Windowed(Demand):
    """An expectation of a window of time."""

    after: NonNegativeFloat = 0.0
    """Start of the window [s], to the physics step."""
    before: PositiveFloat | None = None
    """End of the window [s], to the physics step; null: the end of the run."""

    @property
    def window(self) -> tuple[float, float | None]:
        """Start and end of the time that it looks at [s]; None is the end of the run."""
        return self.after, self.before


class MetricExpectation(Windowed):
    """A bound on one metric."""

    kind = "metric"

    definitions: ClassVar[Mapping[str, Metric]] = {metric.name: metric for metric in METRICS}
    """All metrics by name."""

    metric: Literal[METRIC_NAMES]  # type: ignore[valid-type]
    """Which metric."""
    at_most: float | None = None
    """Upper bound, in the metric's unit."""
    at_least: float | None = None
    """Lower bound, in the metric's unit."""

    @property
    def subject(self) -> str:
        """What is looked at, in words."""
        return self.metric

    @property
    def definition(self) -> Metric:
        """What it is a bound on."""
        return self.definitions[self.metric]

    @property
    def watched(self) -> bool:
        """Whether it reads what is watched between samples, such as clearances."""
        return self.definition.watched


class ContactExpectation(Windowed):
    """Bounds on touches between two sides; without any bound: that there are none."""

    kind = "contacts"

    contacts: _sides("none", "any")  # type: ignore[valid-type]
    """Two groups or bodies; `any`: of any two bodies, but for the floor; `none`: of those there is none."""
    at_most: NonNegativeInt | None = None
    """Most touches; one is an unbroken touch of two bodies; null: 0 where there is no other bound."""
    at_least: NonNegativeInt | None = None
    """Fewest touches."""
    touch_time: NonNegativeFloat | None = None
    """Longest that one touch may last [s]."""
    peak_force: NonNegativeFloat | None = None
    """Largest normal force of a touch [N]."""
    impulse: NonNegativeFloat | None = None
    """Largest impulse of one touch, the integral of its normal force [N s]."""
    penetration: NonNegativeFloat | None = None
    """Largest depth to which a touch may go [m]."""

    @property
    def watched(self) -> bool:
        """Whether it reads what is watched between samples, such as clearances."""
        return True

    @property
    def pair(self) -> Sides | None:
        """The two sides; None for any two bodies but the floor."""
        return None if isinstance(self.contacts, str) else self.contacts

    @property
    def subject(self) -> str:
        """What is looked at, in words."""
        return "contacts" if self.pair is None else f"contacts {'/'.join(self.pair)}"

    @property
    def upper_bounds(self) -> dict[str, float]:
        """The upper bounds that are given, by key; where there is none at all, of no touch."""
        keys = ("at_most", "touch_time", "peak_force", "impulse", "penetration")
        given = {key: float(bound) for key in keys if (bound := getattr(self, key)) is not None}
        return given if given or self.at_least is not None else {"at_most": 0.0}


class ClearanceExpectation(Windowed):
    """The least distance between two sides, surface to surface."""

    kind = "clearance"

    clearance: _sides()  # type: ignore[valid-type]
    """Two groups or bodies, but for the floor; at least one side are robots or the target."""
    at_least: NonNegativeFloat
    """Least distance, at every physics step [m]."""

    @property
    def subject(self) -> str:
        """What is looked at, in words."""
        return f"clearance {'/'.join(self.clearance)}"

    @property
    def watched(self) -> bool:
        """Whether it reads what is watched between samples, such as clearances."""
        return True


class SettledExpectation(Demand):
    """Every robot has come to the mission's radius by some time, and stays."""

    kind = "settled"

    settled: PositiveFloat
    """How far from the mission's radius a robot may be, either way [m]."""
    by: NonNegativeFloat
    """From when on [s]."""
    before: PositiveFloat | None = None
    """Until when [s]; null: the end of the run."""

    @property
    def window(self) -> tuple[float, float | None]:
        """Start and end of the time that it looks at [s]; None is the end of the run."""
        return self.by, self.before


SanityCheck = Literal["warnings", "finite", "energy", "tunneling"]
SANITY: tuple[SanityCheck, ...] = get_args(SanityCheck)


def _all_checks(value: Any) -> Any:
    """All checks for the word, a list as it is."""
    if isinstance(value, str) and value != "all":
        raise PydanticCustomError("choice", "{wanted}", {"wanted": f"all, or a list of {', '.join(SANITY)}"})
    return SANITY if value == "all" else value


class SanityExpectation(Windowed):
    """The simulation itself can be trusted."""

    kind = "sanity"

    sanity: Annotated[
        tuple[SanityCheck, ...],
        Field(min_length=1),
        BeforeValidator(_all_checks, json_schema_input_type=Literal["all"] | tuple[SanityCheck, ...]),
    ]
    """`all`, or some of: no `warnings` of MuJoCo, every number `finite`, no `energy` out of nothing, and no
    `tunneling`: possible where two bodies come nearer in one step than the thinnest body is thick."""

    @property
    def watched(self) -> bool:
        """Whether it reads what is watched between samples, such as clearances."""
        return True


class OutcomeExpectation(Demand):
    """How the run ends; where nothing is said, it is to be completed."""

    kind = "outcome"

    outcome: Literal["completed", "diverged", "unstable"]
    """`diverged`: a robot left for good, or a number is none; `unstable`: MuJoCo warned."""


class Judgment(NamedTuple):
    """What a plugin's expectation found.

    Attributes:
        held: Whether what it demands held.
        words: What was found, in words.
        value: Worst value; None where there was none.
        unit: Its unit, empty for none.
        time: When it was found [s].
        bodies: Names of the bodies that had it, such as `robot_1`.
        margin: Distance from the bound, negative beyond it.
    """

    held: bool
    words: str
    value: float | None = None
    unit: str = ""
    time: float | None = None
    bodies: tuple[str, ...] = ()
    margin: float | None = None


class OwnExpectation(Windowed):
    """Base of a plugin's expectation.

    A subclass has a name, `kind`, a key of that name, which tells it from other expectations, and `judge`.
    """

    def judge(self, trace: Any) -> Judgment:
        """Whether it holds.

        Args:
            trace: The recorded signals (xarray) within its window.
        """
        raise NotImplementedError

    @property
    def watched(self) -> bool:
        """Whether it reads what is watched between samples, such as clearances."""
        return True

    @property
    def demanded(self) -> str:
        """What it demands, in words."""
        given = self.model_dump(exclude={"xfail", "after", "before"}, exclude_none=True)
        bound = str(given.pop(self.kind))
        return ", ".join([bound, *(f"{key} {value}" for key, value in given.items())])


KINDS: tuple[type[Demand], ...] = (
    MetricExpectation,
    ContactExpectation,
    ClearanceExpectation,
    SettledExpectation,
    SanityExpectation,
    OutcomeExpectation,
)


def tag_of_kind(kind: str) -> str:
    """What messages call the expectations of a kind."""
    return f"{kind} expectations"


def expectation_of(kinds: Sequence[type[Demand]]) -> Any:
    """Type of an expectation that is one of several kinds, told by the first key of all kinds that it has."""

    def kind_of(value: Any) -> str | None:
        if isinstance(value, Demand):
            return tag_of_kind(value.kind)
        names = (kind.kind for kind in kinds) if isinstance(value, dict) else ()
        return next((tag_of_kind(name) for name in names if name in value), None)

    tagged = [Annotated[kind, Tag(tag_of_kind(kind.kind))] for kind in kinds]
    one: Any = Union[tuple(tagged)]  # noqa: UP007 - of types that are known at run time only
    asked = Discriminator(kind_of, custom_error_type="kind", custom_error_message="an expectation")
    return Annotated[one, asked]


if TYPE_CHECKING:
    Expectation: TypeAlias = Demand
else:
    Expectation = expectation_of(KINDS)
