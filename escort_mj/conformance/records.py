"""What is asked of metrics and expectations, on recorded runs."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from functools import cache
from typing import Any

from escort_mj.conformance.stand import CheckResult
from escort_mj.errors import PluginCallError
from escort_mj.expectations.expectation import Expectation, checked
from escort_mj.measuring import measure
from escort_mj.metrics.measure import Measure
from escort_mj.metrics.metric import Metric
from escort_mj.mission import fly
from escort_mj.plugin_calls import calling
from escort_mj.record.outcome import Outcome
from escort_mj.record.recording import Recording
from escort_mj.scenario.schema.scenario import Scenario

UNIT = re.compile(r"[A-Za-z0-9/ ^*()%]+\Z")
WINDOWS = ((0.0, None), (0.0, 1.0), (0.5, 1.5), (1.0, 1.0))
BESIDE: dict[str, dict[str, Any]] = {
    "five robots": {"recording": {"truth": True}},
    "one robot alone": {"robots": {"count": 1}},
    "obstacles and noise": {
        "obstacles": ({"position": (4.0, 0.5), "radius": 0.4},),
        "sensing": {"position": {"noise": 0.01}},
    },
    "in space": {"axes": 3, "robots": {"tethers": ({"between": (1, 2), "length": 9.0},)}},
    "a robot lost": {"robots": {"failures": ({"robot": 2, "at": 0.5},)}},
    "estimates and messages": {
        "knowledge": {"estimator": "kalman", "target": {"robots": (1,), "noise": {"position": 0.01}}},
        "communication": {"rate": 50.0, "loss": 0.2},
    },
    "opponents": {
        "target": {"radius": 0.3},
        "opponents": ({"count": 2, "positions": ((6.0, 0.0), (0.0, 2.0)), "policy": {"policy": "straight"}},),
    },
    "two teams": {
        "target": None,
        "teams": (
            {"name": "one", "robots": (1, 2, 3), "targets": ({"name": "a", "position": (0.0, 0.0)},)},
            {
                "name": "two",
                "robots": (4, 5),
                "targets": ({"name": "b", "position": ("12 + 0.3*t", 0.0)},),
                "demand": ({"after": 1.0, "robots": 3},),
            },
        ),
    },
    "goals and no target": {
        "duration": 6.0,
        "target": None,
        "robots": {"positions": ((0.0, 0.0), (0.0, 3.0))},
        "mission": {
            "max_speed": 1.0,
            "behaviors": ({"behavior": "goal", "goals": ((1.0, 0.0), ((1.0, 3.0), (2.0, 3.0)))},),
        },
    },
}
"""Runs on which metrics and expectations are tried, by what is special."""


@cache
def recordings() -> dict[str, Recording]:
    """What short missions recorded."""
    found = {}
    for name, more in BESIDE.items():
        target = {"position": ("0.3*t", *["0"] * (int(str(more.get("axes", 2))) - 1))}
        scenario = Scenario.model_validate({"name": "check", "duration": 2.0, "target": target} | more)
        recording = fly(scenario).recording
        assert recording is not None
        found[name] = recording
    return found


def try_metric(metric: Metric, kind: type[Scenario]) -> Iterator[CheckResult]:
    """Check a metric.

    Args:
        metric: Which.
        kind: The type of scenarios that knows it.
    """
    said = UNIT.match(metric.unit) is not None
    yield CheckResult(
        "unit", said, metric.unit if said else f"found {metric.unit!r}; expected SI, 1 for none"
    )
    values, silent = [], 0
    for name, trace in recordings().items():
        for after, until in WINDOWS:
            found = measure(metric, trace, after, until)
            again = measure(metric, trace, after, until)
            place = f"{name}, {after:g} s to {'the end' if until is None else f'{until:g} s'}"
            if found.broken:
                yield CheckResult("runs", False, f"{place}: {found.reason}")
                return
            if not _alike(found, again):
                yield CheckResult(
                    "deterministic", False, f"{place}: {found.value} at first, then {again.value}"
                )
                return
            if found.value is None:
                silent += 1
                if not found.reason:
                    yield CheckResult("says why", False, f"{place}: neither a value nor a reason")
                    return
                continue
            values.append(found.value)
    yield CheckResult("runs", True, f"{len(values)} values, {silent} without a value, in {len(BESIDE)} runs")
    yield CheckResult("deterministic", True, "same value again")
    yield CheckResult("within bounds", bool(values), _range(values))
    if metric.grows:
        yield _grows(metric)


def _grows(metric: Metric) -> CheckResult:
    """A longer window has no smaller value."""
    for name, trace in recordings().items():
        last = -math.inf
        for step in range(1, 9):
            found = measure(metric, trace, 0.0, 0.25 * step).value
            if found is not None and found < last:
                return CheckResult(
                    "grows", False, f"{name}: decreases from {last:g} to {found:g} as the window grows"
                )
            last = last if found is None else found
    return CheckResult("grows", True, "never decreases as the window grows")


def check_expectation(member: type[Expectation], kind: type[Scenario]) -> Iterator[CheckResult]:
    """Check an expectation, with its keys' defaults, or else plausible values for those without.

    Args:
        member: Which.
        kind: The type of scenarios that knows it.
    """
    yield from check_judgments(member.model_validate(_table(member)))


def check_judgments(demand: Expectation) -> Iterator[CheckResult]:
    """Check what an expectation says of recorded runs."""
    held, kind = 0, type(demand)
    for name, trace in recordings().items():
        try:
            with calling(kind.judge):
                found, again = (checked(demand.judge_run(trace, Outcome.COMPLETED), trace) for _ in range(2))
        except PluginCallError as error:
            yield CheckResult("judges", False, f"{name}: {error}")
            return
        if found != again:
            yield CheckResult("deterministic", False, f"{name}: another judgment of the same trace")
            return
        held += bool(found.held)
    yield CheckResult("judges", True, f"{demand.demanded}: holds in {held} of {len(BESIDE)} runs")
    yield CheckResult("deterministic", True, "same judgment again")


def _table(member: type[Expectation]) -> dict[str, Any]:
    """Values for the keys that must be given."""
    plausible: dict[Any, Any] = {float: 1.0, int: 1, bool: True, str: "all"}
    required = {name: field for name, field in member.model_fields.items() if field.is_required()}
    return {name: plausible.get(field.annotation, 1.0) for name, field in required.items()}


def _alike(a: Measure, b: Measure) -> bool:
    return (a.value, a.time, a.bodies) == (b.value, b.time, b.bodies)


def _range(values: list[float]) -> str:
    return f"{min(values):.4g} to {max(values):.4g}" if values else "no value in any of the runs"
