"""Metrics of plugins: functions of a trace that say their unit."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, TypeVar

from escort_mj.signals import Metric

F = TypeVar("F", bound=Callable[..., Any])
_MARK = "__escort_mj_metric__"


def metric(
    *, unit: str, tail: bool = False, least: float = 0.0, most: float = math.inf, grows: bool = False
) -> Callable[[F], F]:
    """Makes a function of a trace a metric: in metrics.json, and in expectations, by the function's name.

    The function's text in triple quotes is its meaning. It gets the recorded signals (xarray) within a
    window, and returns a number, a `Measure` that says when and who, or None where it says nothing of a run.

    Args:
        unit: SI unit, `1` for none.
        tail: Whether the run's own summary looks at its last fifth only (steady state).
        least: No value is below this.
        most: No value is above this.
        grows: Whether it can only grow as its window does, as a largest value does.
    """

    def mark(function: F) -> F:
        meaning = " ".join((function.__doc__ or "").split("\n\n")[0].split()).rstrip(".")
        setattr(function, _MARK, Metric(function.__name__, unit, meaning, tail, least, most, function, grows))
        return function

    return mark


def metric_of(function: Any) -> Metric | None:
    """The metric that a function was made; None for anything else."""
    found = getattr(function, _MARK, None) if callable(function) else None
    return found if isinstance(found, Metric) else None
