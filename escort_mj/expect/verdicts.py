"""From expectations to verdicts: what was demanded, what was found, by whom, when, with what margin."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from escort_mj.record.measures import Measure
from escort_mj.record.metrics import measure
from escort_mj.record.outcome import Outcome
from escort_mj.scenario.schema import Expectation
from escort_mj.signals import METRICS

if TYPE_CHECKING:
    import xarray

NEAR = 0.05  # a margin below this share of the bound is a near miss
UNITS = {metric.name: "" if metric.unit == "1" else f" {metric.unit}" for metric in METRICS}


@dataclass(frozen=True)
class Verdict:
    """Whether one expectation held.

    Attributes:
        metric: What was looked at; `outcome` for the run's own end.
        demanded: The bound and its window in words.
        value: Worst value found, in the metric's unit; None where there was none, infinite for "never".
        unit: Unit of value and margin.
        time: When it was found [s].
        who: Who had it.
        margin: Distance from the bound, negative beyond it.
        passed: Whether the expectation held.
        near_miss: It held, but barely.
        message: All of it in one line.
    """

    metric: str
    demanded: str
    value: float | None
    unit: str
    time: float | None
    who: str
    margin: float | None
    passed: bool
    near_miss: bool
    message: str


def judge(expectations: Iterable[Expectation], trace: xarray.Dataset, outcome: Outcome) -> list[Verdict]:
    """Judges a run: its outcome first, then every expectation.

    Args:
        expectations: From the scenario.
        trace: The whole trace.
        outcome: How the run ended.
    """
    end = f"outcome completed: {outcome.value}" + ("" if outcome.good else f", {outcome.meaning}")
    first = Verdict("outcome", "completed", None, "", None, "", None, outcome.good, False, end)
    return [first, *(_judge(expectation, trace, outcome) for expectation in expectations)]


def _judge(expectation: Expectation, trace: xarray.Dataset, outcome: Outcome) -> Verdict:
    """Judges one expectation over its window."""
    name, unit = expectation.metric, UNITS[expectation.metric].strip()
    demanded = _demanded(expectation)
    reached = float(trace["time"][-1]) if trace.sizes["time"] else 0.0
    found = measure(name, trace, expectation.after, expectation.before)
    # A completed run has reached its window's end, even where its last sample falls a little short of it.
    cut = expectation.before is not None and reached < expectation.before - 1e-6 and not outcome.good
    if cut and found.value is not None:
        found = Measure(None, reason=f"the run ended at {reached:g} s, inside the window")
    if found.value is None:
        message = f"{name} {demanded}: {found.reason}"
        return Verdict(name, demanded, None, unit, None, "", None, False, False, message)
    margins = []
    if expectation.at_most is not None:
        margins.append((expectation.at_most - found.value, abs(expectation.at_most)))
    if expectation.at_least is not None:
        margins.append((found.value - expectation.at_least, abs(expectation.at_least)))
    margin, bound = min(margins)
    passed = margin >= 0.0
    near = passed and bound > 0.0 and margin < NEAR * bound
    message = f"{name} {demanded}: {_number(found, UNITS[name])}{_circumstances(found)}"
    if near:
        message += ", a near miss"
    return Verdict(name, demanded, found.value, unit, found.time, found.who, margin, passed, near, message)


def _demanded(expectation: Expectation) -> str:
    """The bound and its window in words."""
    bounds = []
    if expectation.at_least is not None:
        bounds.append(f"at least {expectation.at_least:g}")
    if expectation.at_most is not None:
        bounds.append(f"at most {expectation.at_most:g}")
    words = " and ".join(bounds) + UNITS[expectation.metric]
    if expectation.after > 0.0:
        words += f" after {expectation.after:g} s"
    if expectation.before is not None:
        words += f" before {expectation.before:g} s"
    return words


def _number(found: Measure, unit: str) -> str:
    """The value as text."""
    value = found.value
    return "never" if value is None or math.isinf(value) else f"{value:.4g}{unit}"


def _circumstances(found: Measure) -> str:
    """When and who, where known."""
    words = f" ({found.who}" if found.who else ""
    if found.time is not None:
        words += f"{' at' if words else ' (at'} {found.time:.2f} s"
    return f"{words})" if words else ""


def verdict_lines(verdicts: Iterable[Verdict]) -> list[str]:
    """The verdicts as a table for a terminal: held or not, metric, demand, and what was found."""
    judged = list(verdicts)
    name = max((len(verdict.metric) for verdict in judged), default=0)
    demand = max((len(verdict.demanded) for verdict in judged), default=0)
    return [
        f"  {'pass' if verdict.passed else 'FAIL'}  {verdict.metric:{name}}  {verdict.demanded:{demand}}  "
        + verdict.message.removeprefix(f"{verdict.metric} {verdict.demanded}: ")
        for verdict in judged
    ]
