"""How a run can end."""

from __future__ import annotations

from enum import StrEnum


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
