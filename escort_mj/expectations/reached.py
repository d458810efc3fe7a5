"""Every robot at its last goal, by some time."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from pydantic import PositiveFloat

from escort_mj.expectations.bound import Limits, held_against, since
from escort_mj.expectations.expectation import Deadline, Judgment
from escort_mj.measuring import EMPTY
from escort_mj.metrics.arrival import NO_GOALS, at_goal, goal_distance
from escort_mj.metrics.reading import largest_of, robot
from escort_mj.record.window import window

if TYPE_CHECKING:
    from escort_mj.record.outcome import Outcome
    from escort_mj.record.recording import Recorded


class ReachedExpectation(Deadline):
    """Every robot must be at its last goal from a given time on."""

    kind = "reached"
    rank = 45
    in_unit = "m"

    reached: PositiveFloat
    """Largest distance to the last goal [m]."""

    def judge_run(self, trace: Recorded, outcome: Outcome) -> Judgment:
        """Whether all robots are near enough to their last goals in the window, and since when they were."""
        if "goal" not in trace:
            return Judgment(False, NO_GOALS, unit=self.in_unit)
        late = window(trace, *self.window)
        if not late.sizes["time"]:
            return Judgment(False, EMPTY, unit=self.in_unit)
        found = largest_of(late, np.where(at_goal(late, math.inf), goal_distance(late), math.inf), robot)
        if found.value == math.inf:
            return Judgment(False, f"{found.who} has waypoints left at {found.time:.2f} s", unit=self.in_unit)
        judged = held_against(found, self.in_unit, [Limits(self.reached)])
        part = window(trace, 0.0, self.before)
        there = np.asarray(at_goal(part, self.reached))
        absent = f"{np.count_nonzero(~there[-1])} of {there.shape[1]} robots not there at the end"
        return judged._replace(words=judged.words + since(part, np.any(~there, axis=1), absent))
