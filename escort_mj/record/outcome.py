"""How a run can end."""

from __future__ import annotations

from enum import StrEnum


class Outcome(StrEnum):
    """How a run ended, equal to its name; only `completed` is good."""

    COMPLETED = "completed"
    DIVERGED = "diverged"
    UNSTABLE = "unstable"
    INTERRUPTED = "interrupted"
    KILLED = "killed"
    FAILED = "failed"
    RUNNING = "running"

    @property
    def good(self) -> bool:
        """Whether the run reached its end in good order."""
        return self is Outcome.COMPLETED

    @property
    def meaning(self) -> str:
        """One sentence for reports and docs."""
        return _MEANINGS[self]


_MEANINGS = {
    Outcome.COMPLETED: "the run reached the end of its duration",
    Outcome.DIVERGED: "a robot left the mission for good, or the state is no longer a number",
    Outcome.UNSTABLE: "MuJoCo warned about the simulation",
    Outcome.INTERRUPTED: "the run was stopped by Ctrl-C or a polite kill, and ended in order",
    Outcome.KILLED: "the process died without ending the run; the trace goes as far as its journal",
    Outcome.FAILED: "the program itself broke, or a plugin",
    Outcome.RUNNING: "the run is still going on",
}


FINAL = (Outcome.COMPLETED.value, Outcome.DIVERGED.value, Outcome.UNSTABLE.value)
"""How a run ends that the same scenario would end in again."""
