"""What an expectation is, shipped or a plugin's: parameters, what they demand, how a run is judged."""

import math
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, NamedTuple

from pydantic import Field, NonNegativeFloat, PositiveFloat

from escort_mj.components.parameters import TEXT, Member
from escort_mj.measuring import EMPTY
from escort_mj.metrics.metric import Need, flag, moment_in, names, number, text
from escort_mj.metrics.watching import Watch
from escort_mj.record.recording import Recorded, is_log, sealed
from escort_mj.record.team import of_team
from escort_mj.record.window import end_of, when, window

if TYPE_CHECKING:
    from escort_mj.record.outcome import Outcome

Sides = tuple[str, str]
Fault = tuple[tuple[str, ...], str]


class Judgment(NamedTuple):
    """What an expectation found.

    Attributes:
        held: Whether what it demands held.
        words: What was found, in words.
        value: Worst value; None where there was none.
        unit: Its unit, empty for none.
        time: When it was found [s].
        bodies: Names of the bodies that had it, such as `robot_1`.
        margin: Distance from the bound, negative beyond it.
        near_miss: It held, but barely.
        skip: What a log lacks to judge it; empty where it was judged, as every run is.
        unknown: There was nothing to judge, such as no value. It does not hold; neither is it a failure that
            `xfail` can expect.
    """

    held: bool
    words: str
    value: float | None = None
    unit: str = ""
    time: float | None = None
    bodies: tuple[str, ...] = ()
    margin: float | None = None
    near_miss: bool = False
    skip: str = ""
    unknown: bool = False


def checked(found: Any, trace: Recorded) -> Judgment:
    """Return what was judged of a trace, if it is a judgment that agrees with itself.

    Raises:
        TypeError: If it, or a part of it, is of another kind.
        ValueError: If a number is none, the time none of the run, the margin's sign says something else than
            `held`, or a run was not judged, of which all is known.
    """
    if not isinstance(found, Judgment):
        raise TypeError(f"judge returned {type(found).__name__}; expected a Judgment")
    judged = Judgment(
        flag(found.held, "held"),
        text(found.words, "words"),
        None if found.value is None else number(found.value, "value"),
        text(found.unit, "unit"),
        None if found.time is None else moment_in(found.time, trace),
        names(found.bodies, trace),
        None if found.margin is None else number(found.margin, "margin"),
        flag(found.near_miss, "near_miss"),
        text(found.skip, "skip"),
        flag(found.unknown, "unknown"),
    )
    if not judged.words:
        raise ValueError("words: found none; expected what was found, in words")
    if judged.margin is not None and judged.held != (judged.margin >= 0.0):
        raise ValueError(
            f"held is {judged.held} and the margin {judged.margin:g}: negative is what did not hold"
        )
    if judged.skip and not is_log(trace):
        raise ValueError(
            f"skip: found {judged.skip!r:.80}; expected none: a scenario says what is skipped, "
            "and unknown=True that there was nothing to judge"
        )
    if judged.unknown and judged.held:
        raise ValueError("unknown and held are True: nothing that was not judged held")
    if judged.near_miss and not judged.held:
        raise ValueError("near_miss is True, and held is False: a near miss held, but barely")
    return judged


def not_judged(why: str) -> Judgment:
    """A finding that is none: neither passed nor failed."""
    return Judgment(True, f"not judged: {why}", skip=why)


def nothing_found(why: str, unit: str = "") -> Judgment:
    """A finding where there was nothing to judge, which is no pass."""
    return Judgment(False, why, unit=unit, unknown=True)


class Expectation(Member):
    """Base of every expectation; those of a window of time have `Windowed` as theirs, and so have plugins.

    A subclass has a name, `kind`, a key of that name, which tells it from other expectations, and `judge`.
    """

    plural: ClassVar[str] = "expectations"
    method: ClassVar[str] = "judge"
    kind: ClassVar[str]
    """The key that names it."""
    rank: ClassVar[float] = math.inf
    """Its place among all kinds, in ascending order."""
    window_key: ClassVar[str] = "after"
    """The key that says where its window begins."""
    in_unit: ClassVar[str] = ""
    """Unit of what it finds where there is no sample, empty for none."""
    of_floor: ClassVar[bool] = True
    """Whether the floor can be one of its sides."""

    xfail: Annotated[str, Field(min_length=1, max_length=300, pattern=TEXT)] | None = None
    """Reason for an expected failure: the entry passes if the condition does not hold, and fails if it
    does."""
    skip: Annotated[str, Field(min_length=1, max_length=300, pattern=TEXT)] | None = None
    """Reason for skipping: the entry is not evaluated and counts as passed; null: it is evaluated."""

    @classmethod
    def own_name(cls) -> str | None:
        """Return the key that names it; None for a base class."""
        return getattr(cls, "kind", None)

    def judge(self, trace: Any) -> Judgment:
        """Whether it holds.

        Args:
            trace: The recorded signals within its window (`trace["q"].values`, `trace.attrs`, `trace.sizes`).
        """
        raise NotImplementedError

    def judge_run(self, trace: "Recorded", outcome: "Outcome") -> Judgment:
        """Whether it holds of a run: what `judge` says of its window, and that there is a sample in it.

        Args:
            trace: The whole trace.
            outcome: How the run ended.
        """
        part = window(trace, *self.window_in(end_of(trace)))
        return self.judge(sealed(part)) if part.sizes["time"] else nothing_found(EMPTY, self.in_unit)

    @property
    def needs(self) -> tuple[Need, ...]:
        """What a mission must have for there to be something to look at."""
        return ()

    @property
    def subject(self) -> str:
        """What is looked at, in words."""
        return self.kind

    @property
    def demanded(self) -> str:
        """What it demands, in words, without its window."""
        given = self.model_dump(exclude={"xfail", "skip", "after", "before"}, exclude_none=True)
        bound = str(given.pop(self.kind))
        return ", ".join([bound, *(f"{key} {value}" for key, value in given.items())])

    @property
    def window(self) -> tuple[float, float | None]:
        """Start and end of the time that it looks at [s], both included; None is the end of the run."""
        return 0.0, None

    def window_in(self, end: float) -> tuple[float, float | None]:
        """Return start and end of the time that it looks at in a run that ends at a time [s]."""
        return self.window

    @property
    def when(self) -> str:
        """Its window in words."""
        return when(*self.window)

    @property
    def watched(self) -> bool:
        """Whether it reads what is watched between samples, such as clearances."""
        return False

    @property
    def watches(self) -> tuple[Watch, ...]:
        """What it asks about every physics step."""
        return ()

    @property
    def reads_samples(self) -> bool:
        """Whether it does not see what happens between samples, unless all that it asks was watched."""
        return True

    @property
    def leaves_out(self) -> bool:
        """Whether robots that have failed are no part of it."""
        return False

    @property
    def sampled_at_ends(self) -> bool:
        """Whether it holds only of runs that have samples at the ends of its window."""
        return self.watched

    @property
    def lasting(self) -> bool:
        """Whether what does not hold of a part of the window, or of some bodies, does not hold of all."""
        return False

    @property
    def of_end(self) -> bool:
        """Whether its window is a part of the run that only a whole run has."""
        return False

    @property
    def of_one_team(self) -> bool:
        """Whether it is of robots around a target: of one team, where there are several."""
        return False

    @property
    def named_sides(self) -> Sides | None:
        """The two groups or bodies that it names; None where it is of no pair."""
        return None

    @property
    def watched_sides(self) -> Sides | None:
        """The two groups or bodies whose clearance it needs; None where it needs none."""
        return None

    def exact_distances(self) -> Iterator[float]:
        """Distances to obstacles that have to be told apart exactly [m]."""
        yield from ()

    def robot_distances(self) -> Iterator[float]:
        """Clearances of robots that have to be told apart exactly [m]."""
        yield from self.exact_distances()

    def faults(self) -> Iterator[Fault]:
        """What is wrong with its bounds, and at which key."""
        yield from ()


def watches_of(expectations: Iterable[Expectation]) -> tuple[Watch, ...]:
    """Return what some expectations ask about every physics step, each question once."""
    asked = (watch for one in expectations if one.skip is None for watch in one.watches)
    return tuple({watch.label: watch for watch in asked}.values())


class OfTeam(Expectation):
    """An expectation that can be of one team."""

    team: str | None = None
    """Name of the team, in scenarios with `teams`; null: all robots."""

    def judge_run(self, trace: "Recorded", outcome: "Outcome") -> Judgment:
        """Whether it holds of a run, as `judge` says of its window of what is its team's."""
        return super().judge_run(self.seen(trace), outcome)

    def of_own(self, *watches: Watch) -> tuple[Watch, ...]:
        """Return watches as those of its team."""
        return tuple(watch._replace(team=self.team or "") for watch in watches)

    def seen(self, trace: "Recorded") -> "Recorded":
        """Return what its team has of a trace."""
        return trace if self.team is None else of_team(trace, self.team)

    def named(self, subject: str) -> str:
        """Return a subject with the name of the team, as metrics.json has it."""
        return subject if self.team is None else f"{self.team}.{subject}"


class Windowed(Expectation):
    """An expectation of a window of time."""

    after: NonNegativeFloat = 0.0
    """Start of the window [s], exact to the physics step."""
    before: PositiveFloat | None = None
    """End of the window [s], exact to the physics step; null: the end of the run."""

    @property
    def window(self) -> tuple[float, float | None]:
        """Start and end of the time that it looks at [s]; None is the end of the run."""
        return self.after, self.before

    @property
    def watched(self) -> bool:
        """Whether it reads what is watched between samples, such as clearances."""
        return True


class Deadline(Expectation):
    """An expectation of a distance that holds from some time on."""

    window_key = "by"

    by: NonNegativeFloat
    """Latest time from which the condition must hold [s]."""
    before: PositiveFloat | None = None
    """End of the window [s]; null: the end of the run."""

    @property
    def demanded(self) -> str:
        """The bound in words."""
        return f"within {getattr(self, self.kind):g} m"

    @property
    def window(self) -> tuple[float, float | None]:
        """Start and end of the time that it looks at [s]; None is the end of the run."""
        return self.by, self.before

    @property
    def when(self) -> str:
        """Its window in words."""
        return f" by {self.by:g} s{when(0.0, self.before)}"
