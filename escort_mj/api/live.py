"""A mission under way, as users have it."""

from __future__ import annotations

from escort_mj.api.runs import Run
from escort_mj.mission.stepped import SteppedMission


class LiveMission(SteppedMission):
    """A mission that runs step by step, with the controller of its scenario.

    Without interventions, its run is identical, bit for bit, to that of `escort_mj.run`. Interventions
    between steps take effect from the next physics step on and are listed in `notes` and in the attribute
    `interventions` of the trace: the scenario alone does not repeat the run.

    Attributes:
        scenario: The simulated scenario, with all changes so far.
        outcome: `running` until the mission has reached its duration or failed.
        message: How the mission ended, in words; empty while it runs.
        notes: All interventions, each with its time.
    """

    def run(self) -> Run:
        """Return the mission so far as a run: trace, metrics, verdicts, figures.

        It simulates nothing: what an intervention does shows after the next `step`. A mission that has not
        ended has the outcome `interrupted`. It can continue afterwards.
        """
        return Run(self.flight())
