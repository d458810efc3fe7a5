"""What a study looks at in each of its runs: metrics, and whether something happened."""

from __future__ import annotations

import math
from typing import NamedTuple

from escort_mj.metrics import METRICS
from escort_mj.record.outcome import Outcome
from escort_mj.study.engine.store import Row


class Quantity(NamedTuple):
    """What is looked at in every run.

    Attributes:
        unit: SI unit, `1` for none.
        meaning: One sentence.
        more_is_better: Whether larger values are the better ones.
    """

    unit: str
    meaning: str
    more_is_better: bool = False


PASSED, COMPLETED, COLLIDED = "passed", "completed", "collided"
RATES = {
    PASSED: Quantity("1", "the run completed and every verdict holds", True),
    COMPLETED: Quantity("1", "the run reached its end", True),
    COLLIDED: Quantity("1", "something touched something (contacts > 0)"),
}
SAFETY, PRECISION, EFFORT = "clearance_least", "radius_error_mean", "energy"
CLEARANCES = tuple(metric.name for metric in METRICS if metric.name.endswith("clearance_min"))
VALUES = {
    SAFETY: Quantity("m", "least distance of a robot's surface to any other body's", True),
    **{metric.name: Quantity(metric.unit, metric.meaning, metric.more_is_better) for metric in METRICS},
}
QUANTITIES = RATES | VALUES


def quantity_of(row: Row, quantity: str) -> float:
    """A quantity of one run, infinite for never, NaN for missing."""
    if quantity == PASSED:
        return float(row.passed)
    if quantity == COMPLETED:
        return float(row.outcome == Outcome.COMPLETED.value)
    if quantity == COLLIDED:
        touches = row.metrics.get("contacts")
        return math.nan if touches is None else float(touches > 0)
    if quantity == SAFETY:
        known = [value for name in CLEARANCES if (value := row.metrics.get(name)) is not None]
        return min(known, default=math.nan)
    value = row.metrics.get(quantity)
    return math.nan if value is None else float(value)
