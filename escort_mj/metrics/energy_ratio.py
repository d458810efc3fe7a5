"""How evenly a team surrounds its target: the Coulomb energy of its directions, over the least there is."""

from __future__ import annotations

from functools import reduce

import numpy as np
from numpy.typing import NDArray

from escort_mj.metrics.measure import Measure
from escort_mj.metrics.metric import metric
from escort_mj.metrics.reading import ALONE, stretches
from escort_mj.metrics.watching import Course, Fold, Watch, nothing, simple, worst_of
from escort_mj.record.recording import Recorded

Array = NDArray[np.float64]

UNKNOWN = "the least energy of so many robots was not looked for"
LEFT_ALONE = "a single robot is left"


def energy_ratios(trace: Recorded) -> Array | None:
    """Energy of the directions of the robots that are left over the least energy of that many, shape (time,).

    1 is even; NaN where a single robot is left. None where the least energy was not looked for, or where the
    team is one robot.
    """
    least = np.atleast_1d(trace.attrs.get("least_energy", ()))
    if not len(least) or trace.sizes["robot"] < 2:
        return None
    offset = trace["q"].values - trace["target_position"].values[:, None]
    length = np.linalg.norm(offset, axis=2, keepdims=True)
    directions = np.divide(offset, length, out=np.zeros_like(offset), where=length > 0.0)
    ratios = np.full(len(offset), np.nan)
    for first, end, left in stretches(trace):
        team = directions[first:end][:, left]
        if team.shape[1] > 1:
            ratios[first:end] = _energy(team) / least[int((~left).sum())]
    return ratios


def _energy(directions: Array) -> Array:
    """Coulomb energy, shape (k,), of directions of shape (k, n, p)."""
    total = np.zeros(len(directions))
    for i in range(1, directions.shape[1]):
        apart = np.linalg.norm(directions[:, :i] - directions[:, i, None], axis=2)
        with np.errstate(divide="ignore"):
            total += reduce(np.add, (1.0 / apart).T)  # the same bits for any number of samples
    return total


def _ratios(trace: Recorded) -> Array:
    ratios = energy_ratios(trace)
    return nothing(trace.sizes["time"]) if ratios is None else ratios[:, None]


RATIO = Watch(Course("energy_ratio", ("q", "target_position", "lost"), simple(_ratios)), Fold.LARGEST)


@metric(unit="1", over="tail", least=1.0, grows=True, watched=False, rank=60, of_team=True, watches=(RATIO,))
def energy_ratio(trace: Recorded) -> Measure:
    """Largest Coulomb energy of the robots' directions, divided by the lowest known energy (1 if even)."""
    ratios = energy_ratios(trace)
    if ratios is None:
        return Measure(None, reason=ALONE if trace.sizes["robot"] == 1 else UNKNOWN)
    return Measure(None, reason=LEFT_ALONE) if np.isnan(ratios).all() else worst_of(trace, RATIO)
