"""Every robot at its last goal, by some time."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from escort_mj.components.parameters import Distance
from escort_mj.expectations.bound import Limits, held_against, since
from escort_mj.expectations.expectation import Deadline, Judgment, nothing_found
from escort_mj.measuring import EMPTY
from escort_mj.metrics.arrival import NO_GOALS, WAY_LEFT
from escort_mj.metrics.metric import Need
from escort_mj.metrics.watching import Fold, Watch, last_of, worst_of
from escort_mj.record.recording import Recorded
from escort_mj.record.window import window

if TYPE_CHECKING:
    from escort_mj.record.outcome import Outcome


FARTHEST = Watch(WAY_LEFT, Fold.LARGEST)


class ReachedExpectation(Deadline):
    """Every robot must be at its last goal from a given time on."""

    kind = "reached"
    rank = 45
    in_unit = "m"

    reached: Distance
    """Largest distance to the last goal [m]."""

    @property
    def needs(self) -> tuple[Need, ...]:
        """Robots that have goals."""
        return ("goals",)

    @property
    def watches(self) -> tuple[Watch, ...]:
        """The longest way left of all physics steps, and when it was last too long."""
        return FARTHEST, self._beyond

    def judge_run(self, trace: Recorded, outcome: Outcome) -> Judgment:
        """Whether all robots are near enough to their last goals in the window, and since when they were."""
        if "goal" not in trace:
            return nothing_found(NO_GOALS, self.in_unit)
        late = window(trace, *self.window)
        if not late.sizes["time"]:
            return nothing_found(EMPTY, self.in_unit)
        found = worst_of(late, FARTHEST)
        if found.value == math.inf:
            return Judgment(False, f"{found.who} has waypoints left at {found.time:.2f} s", unit=self.in_unit)
        judged = held_against(found, self.in_unit, [Limits(self.reached)])
        last = last_of(window(trace, 0.0, self.before), self._beyond)
        absent = f"{len(last.bodies)} of {trace.sizes['robot']} robots not there at the end"
        return judged._replace(words=judged.words + since(last, absent))

    @property
    def _beyond(self) -> Watch:
        return Watch(WAY_LEFT, Fold.LAST, self.reached)
