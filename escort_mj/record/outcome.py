"""How a run can end, and whether what was expected of it held."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated

from pydantic import AfterValidator


class Outcome(StrEnum):
    """Outcome of a run, equal to its name; only `completed` is good."""

    COMPLETED = "completed"
    DIVERGED = "diverged"
    UNSTABLE = "unstable"
    INTERRUPTED = "interrupted"
    KILLED = "killed"
    FAILED = "failed"
    RUNNING = "running"

    @property
    def good(self) -> bool:
        """Whether the run completed."""
        return self is Outcome.COMPLETED

    @property
    def meaning(self) -> str:
        """Description of the outcome in one sentence."""
        return _MEANINGS[self]

    def told(self, message: str) -> str:
        """The message of a run with this outcome; that of a completed run says so itself."""
        return message if self.good else f"{self.value}: {message}"


_MEANINGS = {
    Outcome.COMPLETED: "the run reached the end of its duration",
    Outcome.DIVERGED: "a robot moved far away from the mission, or the state is no longer finite",
    Outcome.UNSTABLE: "MuJoCo issued a warning about the simulation",
    Outcome.INTERRUPTED: "the run was stopped before its end",
    Outcome.KILLED: "the process died before the end of the run; the trace is recovered from its journal",
    Outcome.FAILED: "an internal error or an error in a plugin",
    Outcome.RUNNING: "the run is in progress",
}


FINAL = (Outcome.COMPLETED.value, Outcome.DIVERGED.value, Outcome.UNSTABLE.value)
"""How a run ends that the same scenario would end in again."""

LARGEST = 1e300  # number of a run: sums of squares of larger ones are no numbers


def _known(value: float) -> float:
    if not (abs(value) <= LARGEST or math.isinf(value)):
        raise ValueError
    return value


Number = Annotated[float, AfterValidator(_known)]
"""A number of results: within `LARGEST`, or infinite for "never"."""


@dataclass(frozen=True)
class Verdict:
    """Whether one expectation held.

    Attributes:
        metric: What was looked at: a metric, `contacts` or `clearance` of two sides, `settled`, `sanity`;
            `outcome` for the run's own end.
        demanded: The bound and its window in words.
        value: Worst value found; None where there was none, infinite for "never".
        unit: Unit of value and margin.
        time: When it was found [s].
        who: Who had it, in words.
        margin: Distance from the bound, negative beyond it.
        passed: Whether it counts as passed: it held, or it failed as expected.
        near_miss: It held, but barely.
        message: All of it in one line.
        bodies: Names of the bodies that had the worst value.
        held: Whether what was demanded held.
        xfail: Reason for an expected failure; empty for none.
        expectation: Its place in the scenario's list, from 0; None for the outcome that was not written down.
        broken: A plugin raised an error instead of judging.
        skip: Why it was not judged; empty where it was.
    """

    metric: str
    demanded: str
    value: Number | None
    unit: str
    time: Number | None
    who: str
    margin: Number | None
    passed: bool
    near_miss: bool
    message: str
    bodies: tuple[str, ...] = ()
    held: bool = True
    xfail: str = ""
    expectation: int | None = None
    broken: bool = False
    skip: str = ""

    @property
    def title(self) -> str:
        """What was expected."""
        return f"{self.metric} {self.demanded}"

    @property
    def found(self) -> str:
        """What was found, without what was demanded."""
        return self.message.removeprefix(f"{self.title}: ")
