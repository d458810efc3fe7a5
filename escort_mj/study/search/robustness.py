"""How far a run is from breaking a verdict, as one number that a search can follow."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

from escort_mj.record.outcome import Verdict
from escort_mj.study.engine.store import Row

BEST, WORST = 1.0, -2.0


class Robustness(NamedTuple):
    """The verdict that is nearest to breaking, or broken worst.

    Attributes:
        value: Its margin by its own scale, from -2 to 1; negative if and only if it is broken.
        verdict: What it looks at and demands, in words.
    """

    value: float
    verdict: str


def robustness(row: Row, duration: float) -> Robustness:
    """The least margin of all verdicts of a run.

    A verdict's margin is divided by the sum of its size and of the value's, which makes it a number from -1
    to 1 of the same sign whatever its unit. Verdicts without a margin, and those that hold with none to spare
    because nothing happened (no contact where none may be), say nothing as long as they hold, and -1 once
    they fail. A run that broke off has from -2 to -1, the less the sooner.

    Args:
        row: The run.
        duration: How long it was to be [s].
    """
    if not row.passed and row.simulated_time < duration - 1e-6:
        return Robustness(WORST + row.simulated_time / duration, f"outcome completed: {row.outcome}")
    least = min((Robustness(_scaled(v), v.title) for v in row.verdicts), default=Robustness(BEST, "none"))
    return least if row.passed or least.value < 0.0 else Robustness(-1.0, f"outcome completed: {row.outcome}")


def broken_by(rows: Iterable[Row], duration: float) -> set[str]:
    """What several runs break, in the words of `robustness`."""
    words = {title for row in rows for title in row.failed}
    return words | {weakest.verdict for row in rows if (weakest := robustness(row, duration)).value < 0.0}


def _scaled(verdict: Verdict) -> float:
    """A verdict's margin by its own scale."""
    margin, value, passed = verdict.margin, verdict.value, verdict.passed
    if margin is None or value is None or passed != (margin >= 0.0):  # or it was known to fail
        return BEST if passed else -1.0
    if math.isinf(margin):
        return math.copysign(1.0, margin)
    size = abs(margin) + abs(value)
    return margin / size if margin else BEST
