"""What motors and drives do: force, its variation, energy, saturation; totals of every physics step."""

from __future__ import annotations

import math

import numpy as np

from escort_mj.metrics.measure import Measure
from escort_mj.metrics.metric import metric
from escort_mj.metrics.reading import NO_OPPONENTS, NO_TARGET, SHORT, escorts, gained, rate
from escort_mj.record.recording import Recorded, lacks


@metric(unit="N", watched=False, rank=90, every_step=True)
def force_rms(trace: Recorded) -> Measure:
    """Root mean square of a robot's force, over every physics step."""
    square = rate(trace, "effort")
    return square if square.value is None else Measure(math.sqrt(square.value))


@metric(unit="N/s", watched=False, rank=100, every_step=True)
def chattering(trace: Recorded) -> Measure:
    """Total variation of a robot's force per second, mean over robots."""
    return rate(trace, "force_variation")


@metric(unit="J", grows=True, watched=False, rank=120, every_step=True)
def energy(trace: Recorded) -> Measure:
    """Integral of |force . velocity|, sum over robots."""
    return gained(trace, "work")


@metric(unit="J", grows=True, watched=False, rank=122, every_step=True)
def target_energy(trace: Recorded) -> Measure:
    """Integral of |driving force . velocity| of the target, or the sum over all targets of teams."""
    targets = ["target"]
    if "obstacle_team" in trace:
        targets = trace["obstacle"].values[trace["obstacle_team"].values.any(axis=0)].tolist()
    return _driven(trace, targets, "no force drives the target" if escorts(trace) else NO_TARGET)


@metric(unit="J", grows=True, watched=False, rank=124, every_step=True, needs=("opponents",))
def opponents_energy(trace: Recorded) -> Measure:
    """Integral of |driving force . velocity| of opponents on their way, sum over opponents."""
    count = trace["opponent_status"].values.shape[1] if not lacks(trace, "opponent_status") else 0
    return _driven(trace, trace["obstacle"].values[trace.sizes["obstacle"] - count :].tolist(), NO_OPPONENTS)


def _driven(trace: Recorded, names: list[str], reason: str) -> Measure:
    """How much work driving forces have done on some bodies, by their names; if there is none, why."""
    its = np.isin(trace["mover"].values, names) if "mover" in trace else np.zeros(0)
    if not its.any():
        return Measure(None, reason=reason)
    if trace.sizes["time"] < 2:
        return Measure(None, reason=SHORT)
    work = trace["mover_work"].values[:, its]
    return Measure(float((work[-1] - work[0]).sum()))


@metric(unit="1", most=1.0, watched=False, rank=170, every_step=True)
def saturated_share(trace: Recorded) -> Measure:
    """Share of time with a robot's motor at its limit, mean over robots."""
    return rate(trace, "saturated_time")
