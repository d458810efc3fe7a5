"""A mission under way, as users have it."""

from __future__ import annotations

from escort_mj.api.runs import Run
from escort_mj.mission.stepped import SteppedMission


class LiveMission(SteppedMission):
    """A mission that runs as far as it is asked to, with the controller of its scenario.

    Without interventions, it is the run that `escort_mj.run` makes, bit for bit. What is done between steps
    acts from the next physics step on and is listed in `notes` and in the attribute `interventions` of the
    trace: the scenario alone does not repeat the run.

    Attributes:
        scenario: What is simulated, with all changes so far.
        outcome: `running` until the mission has reached its duration or failed.
        message: How it ended, in words; empty while it runs.
        notes: What was done from outside, with the time of each intervention.
    """

    def run(self) -> Run:
        """Return the mission so far as a run: trace, metrics, verdicts, figures.

        A mission that has not ended has the outcome `interrupted`. It can go on afterwards.
        """
        return Run(self.flight())
