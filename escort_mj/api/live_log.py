"""A log of real robots under way, as users have it."""

from __future__ import annotations

from escort_mj.api.runs import Run
from escort_mj.judging.judge import Replay


class LiveLog(Replay):
    """A log of real robots as a mission that runs step by step: as `LiveMission`, but it stays as it was.

    `step` goes on, `state` is what was measured and what the scenario's behaviors demand there, and
    `snapshot` and `restore` go back and forth. What would change anything is an error.

    Attributes:
        scenario: What the log is judged against.
        outcome: `running` until the log has reached its end or a plugin failed.
        length: How much of the log the mission covers [s].
    """

    def run(self) -> Run:
        """Return what was replayed so far, judged; before the log's end, the outcome is `interrupted`."""
        return Run(self.flight())
