"""Base of radios: who can hear whom, when each robot sends, and what becomes of its messages."""

import math
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import Discriminator, Field, NonNegativeFloat, PositiveFloat, Tag

from escort_mj.components.component import Derived
from escort_mj.components.dispatch import in_turn
from escort_mj.components.equations import NUMBER, Answer, Call, Equations, Memory
from escort_mj.components.facts import Facts, Misfit, robots_known
from escort_mj.components.parameters import Parameters
from escort_mj.native.fields import Array
from escort_mj.native.values import Names, Values, reader_of

ALL_HEARD = 16  # teammates of a complete graph up to whom a robot has a slot for each
HEARD = 8  # teammates that a robot of a larger team listens to, if nothing else is said
SENDS, PASSES = 0, 1
"""What a radio is asked: when a robot sends next, and what becomes of a message on its way to another."""

Share = Annotated[float, Field(ge=0.0, lt=1.0)]
RobotNumber = Annotated[int, Field(ge=1)]
Robots: TypeAlias = Annotated[tuple[RobotNumber, ...], Field(min_length=1)]


class Loss(Parameters):
    """Loss of messages in bursts: a Markov chain with a good and a bad state on each link."""

    mean: Annotated[float, Field(gt=0.0, lt=1.0)]
    """Share of lost messages [1]."""
    burst: Annotated[float, Field(ge=1.0)]
    """Mean number of messages lost in a row."""

    def misfits(self) -> Iterator[Misfit]:
        """Yield bursts that are too short for so many losses."""
        least = self.mean / (1.0 - self.mean)
        if self.burst < least * (1.0 - 1e-9):
            words = (
                f"found {self.burst:g}; expected at least {least:.4g}, as a share of {self.mean:g} is lost"
            )
            yield Misfit(words, ("loss", "burst"), (("communication", "loss", "mean"),))


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

    def misfits(self, count: int) -> Iterator[Misfit]:
        """Yield an end before the start, and robots that there are not."""
        if self.before is not None and self.before <= self.after:
            words = f"found {self.before:g} s; expected more than after, {self.after:g} s"
            yield Misfit(words, ("before",))
        if self.robots is not None and self.groups is not None:
            yield Misfit("found robots and groups; expected one of them", ())
        yield from robots_known(self.robots or (), count, "robots")
        members = [robot for group in self.groups or () for robot in group]
        for number, group in enumerate(self.groups or ()):
            yield from robots_known(group, count, "groups", number)
        if twice := sorted({robot for robot in members if members.count(robot) > 1}):
            yield Misfit(f"found robot {twice[0]} in two groups; expected one", ("groups",))

    def parts(self, count: int) -> list[int]:
        """Return the number of each robot's part of the team: robots alone have numbers of their own."""
        together = self.robots is not None or self.groups is not None
        part = [0] * count if together else list(range(1, count + 1))
        for number, group in enumerate(self.groups or (), count + 1):
            for robot in group:
                part[robot - 1] = number
        for robot in self.robots or ():
            part[robot - 1] = robot
        return part


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


class RadioView(NamedTuple):
    """What a radio sees of one message of one robot to another, and what it writes."""

    timestep: float  # [s]
    robots: int  # how many there are
    time: Annotated[Array, 1]  # [s]
    message_sender: Annotated[Array, 1]  # from 0
    message_receiver: Annotated[Array, 1]  # from 0; the sender where the message is not on its way yet
    message_number: Annotated[Array, 1]  # of the sender's messages, from 0
    message_distance: Annotated[Array, 1]  # of the two, as `measure` says [m]
    message_draws: Annotated[Array, 2]  # random numbers, uniform in [0, 1)
    link_memory: Annotated[Array, "link_memories"]  # the radio's own numbers for the link; at first 0
    link_memory_next: Annotated[Array, "link_memories"]  # written: what becomes of these
    message_due: Annotated[Array, 1]  # written: when it is sent [s]
    message_lost: Annotated[Array, 1]  # written: 1 if it is lost, else 0
    message_delay: Annotated[Array, 1]  # written: how long it is on its way [s]


NAMES = (
    *(("timestep", "timestep"), ("time", "time"), ("robots", "robots"), ("sender", "message_sender")),
    *(("receiver", "message_receiver"), ("number", "message_number"), ("distance", "message_distance")),
)
"""What a radio can read, and the fields of `RadioView` that have it."""
DRAWS = ("draw", "second_draw")


class Radio(Equations):
    """How robots communicate: who can hear whom, when each of them sends, and what becomes of messages.

    A subclass has a key `radio` with its name, parameters, and the method `sends`; it may have others for
    `loses` and `delays`. Each is handed the values of one message, and returns a number. What a radio keeps
    of its own, it keeps for each link, and moves on when a message passes there.
    """

    plural: ClassVar[str] = "radios"
    named_by: ClassVar[str] = "radio"
    default_name: ClassVar[str | None] = "periodic"
    method: ClassVar[str] = "sends"
    view: ClassVar[type] = RadioView
    outputs: ClassVar[tuple[str, ...]] = ("message_due", "message_lost", "message_delay", "link_memory_next")
    scratch: ClassVar[tuple[str, ...]] = ("link_memory",)
    answers: ClassVar[str | None] = ""
    gives: ClassVar[str] = "a message of robot {} a time"
    asks: ClassVar[tuple[str, ...]] = ("sends", "loses", "delays")
    reads: ClassVar[tuple[tuple[str, str], ...]] = NAMES
    keeps: ClassVar[str] = "link_memory"
    python_only: ClassVar[frozenset[str]] = Equations.python_only | {
        "graph",
        "neighbors",
        "blackouts",
        "delay",
        "loss",
    }
    rates: ClassVar[tuple[str, ...]] = ()
    """Keys with rates of which a whole number of physics steps is one period."""
    times: ClassVar[tuple[str, ...]] = ()
    """Keys with times that are whole numbers of physics steps."""
    bad: ClassVar[Memory] = Memory("1", "1 while the link loses messages, else 0")

    radio: str
    graph: Graph = "complete"
    """Which robots can hear each other: `complete`, `ring` in the order of the robots' numbers, `{nearest:
    k}` or `{edges: [[1, 2], ...]}`."""
    range: PositiveFloat | None = None
    """Largest distance between robots that hear each other [m]; null: any."""
    measure: Literal["center", "surface"] = "center"
    """Whether `range` is measured between centers or surfaces."""
    blocked: bool = False
    """Whether obstacles and walls between two robots block their messages."""
    delay: Delay = 0.0
    """Time that a message takes [s]: one number, or the bounds of a uniform distribution."""
    loss: AnyLoss = 0.0
    """Share of messages that are lost [1]: a number if losses are independent, `{mean: 0.2, burst: 5}` for
    bursts."""
    timeout: PositiveFloat | None = 1.0
    """Age beyond which a robot disregards what it has heard from a teammate [s]; null: never."""
    neighbors: Annotated[int, Field(ge=1, le=64)] | None = None
    """Largest number of teammates that a robot hears at once; null: all in a team of up to 17, else 8."""
    blackouts: Annotated[tuple[Blackout, ...], Field(max_length=64)] = ()
    """Periods in which some messages do not get through."""

    def misfits_of_kind(self, mission: Facts) -> Iterator[Misfit]:
        """Yield robots that there are not, and bounds that contradict each other."""
        count, graph = mission.robots, self.graph
        if isinstance(graph, Edges):
            for index, edge in enumerate(graph.edges):
                yield from robots_known(edge, count, "graph", "edges", index)
        if isinstance(graph, Nearest) and graph.nearest >= count:
            words = f"found {graph.nearest}; expected at most {count - 1}, the teammates of a robot"
            yield Misfit(words, ("graph", "nearest"), (("robots", "count"),))
        if self.most_delay < self.least_delay:
            words = f"found {self.least_delay:g} to {self.most_delay:g} s; expected the least one first"
            yield Misfit(words, "delay")
        if isinstance(self.loss, Loss):
            yield from self.loss.misfits()
        for index, blackout in enumerate(self.blackouts):
            for words, key, because in blackout.misfits(count):
                yield Misfit(words, ("blackouts", index, *key), because)

    def sends(self, r: Values) -> Any:
        """Return the time at which message `r.number` of robot `r.sender` is sent [s]; then it goes to all.

        Args:
            r: Values: `number`, `sender`, `robots`, `timestep` and more, see `NAMES`.
        """
        raise NotImplementedError

    def bad_next(self, r: Values) -> Any:
        """Return whether a link loses messages now: a chain of two states (Gilbert 1960, Elliott 1963)."""
        if r.bad != 0.0:
            return 1.0 if r.draw >= self.recovers else 0.0
        return 1.0 if r.draw < self.fails else 0.0

    def loses(self, r: Values) -> Any:
        """Return whether a message to robot `r.receiver` is lost."""
        return r.bad

    def delays(self, r: Values) -> Any:
        """Return the time that a message takes [s]: uniform between the bounds, in whole steps."""
        least = round(self.least_delay / r.timestep)
        most = round(self.most_delay / r.timestep)
        return r.timestep * (least + math.floor(r.second_draw * (most - least + 1.0)))

    @classmethod
    def wrong(cls, view: Any, number: int) -> str:
        """Say what of a message cannot be used: a time, whether it is lost, or the time that it takes."""
        due, lost, taken = (float(getattr(view, name)[0]) for name in cls.outputs[:3])
        message = f"message {int(view.message_number[0])} of robot {number}"
        if not np.isfinite([due, lost, taken, *view.link_memory]).all():
            return super().wrong(view, number)
        if lost not in (0.0, 1.0):
            return f"{message} the loss {lost:g}; expected True or False"
        if taken < 0.0:
            return f"{message} a delay of {taken:g} s; expected 0 or more"
        return f"{message} the time {due:g} s, no later than that of the message before"

    def period(self, timestep: float, robots: int) -> float:
        """Return the mean time between two messages of a robot [s]; by default, one goes in every step.

        Args:
            timestep: Physics step [s].
            robots: How many there are.
        """
        return timestep

    @property
    def longest(self) -> float:
        """Return the longest time from when a message is due to its arrival [s]: later ones are lost."""
        return self.most_delay

    @Derived
    def least_delay(self) -> float:
        """Return the least time that a message takes [s]."""
        return self.delay[0] if isinstance(self.delay, tuple) else self.delay

    @Derived
    def most_delay(self) -> float:
        """Return the most time that a message takes [s]."""
        return self.delay[1] if isinstance(self.delay, tuple) else self.delay

    @Derived
    def fails(self) -> float:
        """Return the probability that a good link loses the next message."""
        if isinstance(self.loss, float):
            return self.loss
        return self.recovers * self.loss.mean / (1.0 - self.loss.mean)  # mean = fails / (fails + recovers)

    @Derived
    def recovers(self) -> float:
        """Return the probability that a bad link passes the next message."""
        return 1.0 - self.loss if isinstance(self.loss, float) else 1.0 / self.loss.burst

    @classmethod
    def answer_of(cls, name: str) -> Answer:
        """Return what an equation is to return: one number, as it is asked of one message."""
        return NUMBER[0], "a number"

    @classmethod
    def names(cls) -> Names:
        """Return by what names it reads values."""
        found = super().names()
        draws = tuple((name, "message_draws", row) for row, name in enumerate(DRAWS))
        return found._replace(rows=(*found.rows, *draws))

    def longest_steps(self, timestep: float) -> int:
        """Return the most physics steps from when a message is due to its arrival."""
        return int(self.longest / timestep + 1.0)

    def depth(self, timestep: float, robots: int) -> int:
        """Return how many messages of one robot may be on their way, and one more."""
        every = max(round(self.period(timestep, robots) / timestep), 1)
        return self.longest_steps(timestep) // every + 2

    def senders(self, count: int) -> NDArray[np.int64]:
        """Return whom each robot hears in each slot, from 0, -1 for anybody, shape (n, slots)."""
        graph, robots = self.graph, np.arange(count)
        if isinstance(graph, Edges):
            pairs = {pair for edge in graph.edges for pair in (edge, edge[::-1])}
            heard = [sorted({a - 1 for a, b in pairs if b == robot + 1 and a != b}) for robot in robots]
        elif graph == "ring":
            heard = [sorted({(i - 1) % count, (i + 1) % count} - {i}) for i in range(count)]
        else:
            few = self.neighbors or (ALL_HEARD if count <= ALL_HEARD + 1 else HEARD)
            few = min(graph.nearest if isinstance(graph, Nearest) else few, count - 1)
            if few < count - 1 or count == 1:
                return np.full((count, few), -1, dtype=np.int64)
            heard = [[j for j in range(count) if j != i] for i in range(count)]
        slots = max(map(len, heard))
        return np.array([row + [-2] * (slots - len(row)) for row in heard], dtype=np.int64).reshape(
            count, slots
        )

    @classmethod
    def evaluation(cls, made: Call, equations: Mapping[str, Call]) -> Call:
        """Return what answers a question about a message: `(parameters, view, question)`."""
        values_at = reader_of(cls.names())
        sends, loses, delays = (equations[name] for name in cls.asks)

        def writer(row: int, following: Call) -> Call:
            def write(parameters: Any, view: Any) -> None:
                view.link_memory_next[row] = following(parameters, values_at(view, 0))

            return made(write)

        follow = (writer(row, equations[name + cls.moves]) for row, name in enumerate(cls.memories()))
        move = in_turn(made, follow)

        def answer(parameters: Any, view: Any, question: int) -> None:
            if question == SENDS:
                view.message_due[0] = sends(parameters, values_at(view, 0))
                return
            move(parameters, view)
            for row in range(view.link_memory.shape[0]):
                view.link_memory[row] = view.link_memory_next[row]
            view.message_lost[0] = loses(parameters, values_at(view, 0))
            view.message_delay[0] = delays(parameters, values_at(view, 0))

        return answer
