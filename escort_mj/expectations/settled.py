"""Every robot at the mission's radius, by some time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from escort_mj.components.parameters import Distance
from escort_mj.expectations.bound import Limits, held_against, since
from escort_mj.expectations.expectation import Deadline, Judgment, OfTeam
from escort_mj.measuring import measure
from escort_mj.metrics.metric import Need
from escort_mj.metrics.radius_error import LARGEST, RADIUS_ERROR
from escort_mj.metrics.watching import Fold, Watch, last_of
from escort_mj.record.recording import Recorded
from escort_mj.record.window import window

if TYPE_CHECKING:
    from escort_mj.record.outcome import Outcome


class SettledExpectation(OfTeam, Deadline):
    """Every robot must be at the mission's radius from a given time on."""

    kind = "settled"
    rank = 40

    settled: Distance
    """Largest deviation from the mission's radius [m]."""

    @property
    def needs(self) -> tuple[Need, ...]:
        """There is a target to be around."""
        return ("target",)

    @property
    def subject(self) -> str:
        """What is looked at, in words."""
        return self.named(self.kind)

    @property
    def of_one_team(self) -> bool:
        """It is of robots around a target."""
        return True

    @property
    def watches(self) -> tuple[Watch, ...]:
        """The largest radius error of all physics steps, and when it was last too large."""
        return self.of_own(LARGEST, self._beyond)

    @property
    def leaves_out(self) -> bool:
        """Robots that have failed are no part of the formation."""
        return True

    def judge_run(self, trace: Recorded, outcome: Outcome) -> Judgment:
        """Whether the largest radius error of the window is small enough, and since when it was."""
        trace = self.seen(trace)
        found = held_against(measure("radius_error_max", trace, *self.window), "m", [Limits(self.settled)])
        if found.value is None:
            return found
        last = last_of(window(trace, 0.0, self.before), self._beyond)
        return found._replace(words=found.words + since(last, "not settled at the end"))

    @property
    def _beyond(self) -> Watch:
        return Watch(RADIUS_ERROR, Fold.LAST, self.settled)
