"""A bound on a metric."""

import math
from collections.abc import Iterator, Sequence
from functools import cache
from typing import Any, Literal

from escort_mj.components.parameters import Members, one_of
from escort_mj.errors import PluginCallError
from escort_mj.expectations.bound import Limits, held_against, order_faults
from escort_mj.expectations.expectation import Fault, Judgment, OfTeam, Windowed, not_judged
from escort_mj.metrics import METRICS
from escort_mj.metrics.metric import Metric, Need
from escort_mj.metrics.watching import Watch
from escort_mj.record.recording import is_log
from escort_mj.record.window import Over, Span, span_faults

OBSTACLE_DISTANCES = ("obstacle_clearance_min", "obstacle_distance_min")
CLEARANCES = ("obstacle_clearance_min", "robot_clearance_min")


def name_among(metrics: Sequence[Metric]) -> Any:
    """Return the type of the name of one of some metrics."""
    return Literal[tuple(metric.name for metric in metrics)]


class MetricExpectation(OfTeam, Windowed):
    """A bound on one metric."""

    kind = "metric"
    rank = 10

    metric: one_of(Metric, name_among, METRICS)  # type: ignore[valid-type]
    """Name of the metric."""
    at_most: float | None = None
    """Upper bound, in the metric's unit."""
    at_least: float | None = None
    """Lower bound, in the metric's unit."""
    over: Over | None = None
    """Part of the run: the `whole` run, or its `tail`, which is its last fifth; null: what `after` and
    `before` say, without them the whole run."""

    def judge(self, trace: Any) -> Judgment:
        """Whether the metric is within its bounds."""
        found = self.definition.of(trace)
        if found.broken:
            raise PluginCallError(found.reason)
        if found.value is None and is_log(trace):
            return not_judged(found.reason)
        return held_against(found, self.in_unit, self._bounds())

    @property
    def lasting(self) -> bool:
        """Whether what does not hold of a part of a window does not hold of all of it."""
        return self.definition.grows and self.at_least is None

    @property
    def needs(self) -> tuple[Need, ...]:
        """What a mission must have for the metric to have a value."""
        return self.definition.needs

    @property
    def subject(self) -> str:
        """What is looked at, in words."""
        return self.named(self.metric)

    @property
    def demanded(self) -> str:
        """The bounds in words."""
        return " and ".join(bound.words("") for bound in self._bounds()) + (
            self.in_unit and f" {self.in_unit}"
        )

    @property
    def of_one_team(self) -> bool:
        """Whether its metric is of robots around a target."""
        return self.definition.of_team

    @property
    def definition(self) -> Metric:
        """What it is a bound on."""
        return definitions(type(self))[self.metric]

    @property
    def in_unit(self) -> str:  # type: ignore[override]
        """The metric's unit, empty for none."""
        return "" if self.definition.unit == "1" else self.definition.unit

    @property
    def watched(self) -> bool:
        """Whether it reads what is watched between samples, such as clearances."""
        return self.definition.watched

    @property
    def watches(self) -> tuple[Watch, ...]:
        """What its metric asks about every physics step."""
        return self.of_own(*self.definition.watches)

    @property
    def reads_samples(self) -> bool:
        """Whether its metric does."""
        return not self.definition.every_step

    @property
    def leaves_out(self) -> bool:
        """Whether its metric leaves out robots that have failed."""
        return self.definition.leaves_out

    def exact_distances(self) -> Iterator[float]:
        """Its bounds, if it is a metric of distances to obstacles [m]."""
        if self.metric in OBSTACLE_DISTANCES:
            yield from self._given()

    def robot_distances(self) -> Iterator[float]:
        """Its bounds, if it is a metric of clearances [m]."""
        if self.metric in CLEARANCES:
            yield from self._given()

    def _given(self) -> Iterator[float]:
        yield from (bound for bound in (self.at_least, self.at_most) if bound is not None)

    def window_in(self, end: float) -> tuple[float, float | None]:
        """Return start and end of the time that it looks at in a run that ends at a time [s]."""
        return Span(self.over, self.after, self.before).bounds(end)

    @property
    def of_end(self) -> bool:
        """Whether it is of the run's tail."""
        return self.over == "tail"

    @property
    def when(self) -> str:
        """Its window in words."""
        return f" over the {Span(self.over).words}" if self.over else super().when

    def faults(self) -> Iterator[Fault]:
        """There is a bound, a value can meet it and can fail to, and there is one window."""
        times = self.after or None, self.before
        yield from (((), words) for words in span_faults(self.over, *times) if self.over)
        if self.over == "tail" and self.definition.moment:
            yield ("over",), f"found tail; {self.metric} is a moment of the run, looked for in all of it"
        low, high, metric = self.at_least, self.at_most, self.definition
        unit, ends = self.in_unit and f" {self.in_unit}", {"at_least": metric.least, "at_most": metric.most}
        bounds = {key: bound for key, bound in (("at_least", low), ("at_most", high)) if bound is not None}
        if not bounds:
            yield (), "has no bound; give at_most or at_least"
        elif all(bound == ends[key] for key, bound in bounds.items()):
            yield tuple(bounds)[:1], f"every value of {metric.name} meets this bound: it cannot fail"
        for key, bound in bounds.items():
            if not metric.least <= bound <= metric.most:
                limits = f"{metric.least:g}{unit} or more"
                if math.isfinite(metric.most):
                    limits = f"{metric.least:g} to {metric.most:g}{unit}"
                yield (key,), f"found {bound:g}{unit}; {metric.name} is always {limits}"
        yield from order_faults(low, high)

    def _bounds(self) -> list[Limits]:
        least = self.definition.least if math.isfinite(self.definition.least) else 0.0
        bounds = [] if self.at_least is None else [Limits(self.at_least, False, least)]
        return bounds + ([] if self.at_most is None else [Limits(self.at_most, True, least)])


@cache
def definitions(kind: type[MetricExpectation]) -> dict[str, Metric]:
    """Return the metrics that a type of expectations knows, by name."""
    marks = kind.model_fields["metric"].metadata
    return {metric.name: metric for mark in marks if isinstance(mark, Members) for metric in mark.known}
