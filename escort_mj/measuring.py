"""Metrics of a run or of a window of it, with their unit, moment and bodies."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from escort_mj.metrics import METRICS
from escort_mj.metrics.measure import Measure
from escort_mj.metrics.metric import Metric
from escort_mj.record.recording import Recorded, sealed
from escort_mj.record.team import of_team, team_names
from escort_mj.record.window import OVERS, Span, rate_of

if TYPE_CHECKING:
    from escort_mj.record.outcome import Outcome

EMPTY = "the run has no sample in the window"
SHIPPED = {metric.name: metric for metric in METRICS}


def measure(
    metric: str | Metric, trace: Recorded, after: float = 0.0, before: float | None = None
) -> Measure:
    """Return a metric's value over a window of a trace.

    Args:
        metric: Itself, or the name of one that ships.
        trace: A trace.
        after: Start of the window [s].
        before: Its end [s]; None for the end of the run.
    """
    return measure_over(metric, trace, Span(None, after, before))


def measure_over(metric: str | Metric, trace: Recorded, span: Span) -> Measure:
    """Return a metric's value over a part of a run.

    Args:
        metric: Itself, or the name of one that ships.
        trace: The whole trace.
        span: Which part.
    """
    part = span.of(trace)
    if not part.sizes["time"]:
        return Measure(None, reason=EMPTY)
    return (SHIPPED[metric] if isinstance(metric, str) else metric).of(part)


def measures_of(
    trace: Recorded, metrics: Sequence[Metric] = METRICS, wanted: Collection[str] = ()
) -> dict[str, Measure]:
    """Return every metric over what it looks at by default: the whole run or, for steady state, its tail.

    Those of teams follow, under names such as `van.radius_error_mean`.

    Args:
        trace: The whole trace.
        metrics: Which.
        wanted: Names of those that are measured even if it takes long.
    """
    if not trace.sizes["time"]:
        return {metric.name: Measure(None, reason=EMPTY) for metric in metrics}
    found, of_teams = {}, [metric for metric in metrics if metric.of_team]
    views = [
        ("", trace, metrics),
        *((f"{name}.", of_team(trace, name), of_teams) for name in team_names(trace)),
    ]
    for before, view, listed in views:
        parts = {over: sealed(Span(over).of(view)) for over in OVERS}
        for metric in listed:
            part, name = parts[metric.over], before + metric.name
            found[name] = metric.of(part, unless_dear=name not in wanted)
    return found


def summarize(
    found: dict[str, Measure],
    trace: Recorded,
    outcome: Outcome,
    steps: int,
    wall_time: float,
    metrics: Sequence[Metric] = METRICS,
) -> dict[str, Any]:
    """Contents of metrics.json: every metric, what it means, and what it looks at.

    Args:
        found: What `measures_of` says of the trace.
        trace: The whole trace.
        outcome: How the run ended.
        steps: Physics steps taken.
        wall_time: Time that they took [s].
        metrics: Which.
    """
    time = trace["time"].values
    reached = float(time[-1]) if len(time) else 0.0
    begins = {over: float(Span(over).of(trace)["time"][0]) if len(time) else 0.0 for over in OVERS}
    rates = {True: 1.0 / float(trace.attrs["timestep"]), False: rate_of(trace)}
    summary: dict[str, Any] = {
        "run": {
            "outcome": outcome.value,
            "simulated_time": reached,
            "steps": steps,
            "wall_time": wall_time,
            "real_time_factor": reached / wall_time if wall_time > 0.0 else None,
        }
    }
    known = {metric.name: metric for metric in metrics}
    for name, measured in found.items():
        team, _, bare = name.rpartition(".")
        one, metric = _finite(measured), known[bare]
        sees_steps = metric.sees_steps(trace, team)
        summary[name] = {
            "value": one.value,
            "unit": metric.unit,
            "meaning": metric.meaning,
            "over": metric.over,
            "window": [begins[metric.over], reached],
            "read": "every step" if sees_steps else "samples",
            "rate": rates[sees_steps],
            "time": one.time,
            "who": one.who,
        } | ({"reason": one.reason} if one.reason else {})
        if measured.value == math.inf:
            summary[name]["infinite"] = True
    return summary


def _finite(found: Measure) -> Measure:
    """A measure as JSON can hold it: where the value is no finite number, the reason says so."""
    if found.value is None or math.isfinite(found.value):
        return found
    return found._replace(value=None, reason=found.reason or f"the value is {found.value}")


def metric_value(entry: Mapping[str, Any]) -> float:
    """The value of a metric as metrics.json has it, as a number: NaN for none, infinite for "never"."""
    if entry["value"] is not None:
        return float(entry["value"])
    return math.inf if entry.get("infinite") else math.nan
