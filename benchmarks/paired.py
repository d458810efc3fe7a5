"""Things that take turns, round by round, so that a machine whose speed drifts treats them alike."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

Times = dict[str, NDArray[np.float64]]


def seconds(function: Callable[[], object]) -> float:
    """Wall time of one call [s]."""
    start = time.perf_counter()
    function()
    return time.perf_counter() - start


def effort(function: Callable[[], object]) -> float:
    """Processor time of this thread in one call [s]: what others take from the machine is not counted."""
    start = time.thread_time()
    function()
    return time.thread_time() - start


def alternate(loops: Mapping[str, Callable[[], float]], rounds: int) -> Times:
    """Lets loops take turns; who comes first changes from round to round.

    Args:
        loops: By name; each does one round and says what it cost.
        rounds: How many.

    Returns:
        What each round of each loop cost.
    """
    times: dict[str, list[float]] = {name: [] for name in loops}
    for turn in range(rounds):
        for name in list(loops) if turn % 2 else reversed(list(loops)):
            times[name].append(loops[name]())
    return {name: np.array(values) for name, values in times.items()}


def medians(times: Times, base: str) -> dict[str, float]:
    """Medians over rounds of costs in [s], in [us], and of their paired ratios to one, as `name/base`."""
    ratios = {f"{name}/{base}": paired(times, name, base) for name in times if name != base}
    return {name: 1e6 * float(np.median(values)) for name, values in times.items()} | ratios


def paired(times: Times, one: str, other: str) -> float:
    """Median over rounds of the ratio of two costs."""
    return float(np.median(times[one] / times[other]))
