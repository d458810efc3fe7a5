"""What motors do: force, its variation, energy, saturation; from totals of every physics step."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from escort_mj.metrics.metric import Measure, metric
from escort_mj.metrics.reading import gained, rate

if TYPE_CHECKING:
    from escort_mj.record.recording import Recorded


@metric(unit="N", tail=True, watched=False, rank=90)
def force_rms(trace: Recorded) -> Measure:
    """Root mean square of a robot's force, over every physics step."""
    square = rate(trace, "effort")
    return square if square.value is None else Measure(math.sqrt(square.value))


@metric(unit="N/s", tail=True, watched=False, rank=100)
def chattering(trace: Recorded) -> Measure:
    """Total variation of a robot's force per second, mean over robots."""
    return rate(trace, "force_variation")


@metric(unit="J", grows=True, watched=False, rank=120)
def energy(trace: Recorded) -> Measure:
    """Integral of |force . velocity|, sum over robots."""
    return gained(trace, "work")


@metric(unit="1", most=1.0, watched=False, rank=170)
def saturated_share(trace: Recorded) -> Measure:
    """Share of time with a robot's motor at its limit, mean over robots."""
    return rate(trace, "saturated_time")
