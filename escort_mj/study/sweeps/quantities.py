"""What a study looks at in each of its runs: metrics over some part of it, and whether something happened."""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

from pydantic import Field, NonNegativeFloat, PositiveFloat, model_validator

from escort_mj.components.parameters import Parameters
from escort_mj.metrics import METRIC_NAMES, METRICS
from escort_mj.metrics.metric import Metric, title_of
from escort_mj.record.outcome import Outcome
from escort_mj.record.window import Over, Span, span_faults, span_of
from escort_mj.scenario.findings import Finding, Path
from escort_mj.study.engine.store import Row

SHIPPED = {metric.name: metric for metric in METRICS}

MetricName = Annotated[str, Field(json_schema_extra={"examples": [*METRIC_NAMES]})]
"""A metric that ships, or one of the scenario's plugins: `design.Design` checks it."""


class MetricOver(Parameters):
    """A metric, and the part of each run that it looks at."""

    metric: MetricName
    """Name of the metric."""
    over: Over | None = None
    """Part of each run: the `whole` run, or its `tail`, which is its last fifth; null: what `after` and
    `before` say, or without them the metric's own, see [metrics](metrics.md)."""
    after: NonNegativeFloat | None = None
    """Start of the window [s], at the next sample."""
    before: PositiveFloat | None = None
    """End of the window [s], at the sample before; null: the end of the run."""

    def findings(self, path: Path) -> list[Finding]:
        """What is wrong between its keys, which stand at a path."""
        return [Finding(path, words) for words in span_faults(self.over, self.after, self.before)]

    @property
    def span(self) -> Span | None:
        """The part of a run that it looks at; None for the metric's own."""
        return span_of(self.over, self.after, self.before)

    @property
    def key(self) -> str:
        """What its values are called: the metric's name, and its window where it has one of its own."""
        return self.metric if self.span is None else f"{self.metric}_{self.span.suffix}"

    @property
    def unit(self) -> str:
        """Unit of the metric, `1` for none; empty where none is known: of a plugin's."""
        return SHIPPED[self.metric].unit if self.metric in SHIPPED else ""

    @property
    def words(self) -> str:
        """Title and window: `radius error, mean, last fifth`."""
        metric = SHIPPED.get(self.metric)
        span = self.span or (metric.span if metric else None)
        return ", ".join([title_of(self.metric), *([span.words] if span else [])])


class ChosenMetric(MetricOver):
    """A metric of the tables and figures of a study: a name, or a table with a window."""

    @model_validator(mode="before")
    @classmethod
    def _named(cls, given: Any) -> Any:
        """A name alone is a table of it."""
        return {"metric": given} if isinstance(given, str) else given


class Measured(NamedTuple):
    """A metric that is measured of a run beside those that it has anyway.

    Attributes:
        key: What its values are called.
        metric: The metric's name.
        span: The part of the run that it looks at.
    """

    key: str
    metric: str
    span: Span


class Quantity(NamedTuple):
    """What is looked at in every run.

    Attributes:
        unit: SI unit, `1` for none.
        meaning: One sentence.
        more_is_better: Whether larger values are the better ones.
        title: A few words.
        window: The part of a run that it looks at, in words; empty for the run's end.
        read: When it looks: at every physics step, at the samples, or at steps where an expectation asks.
        moment: Whether it is a moment of the run.
    """

    unit: str
    meaning: str
    more_is_better: bool = False
    title: str = ""
    window: str = ""
    read: str = ""
    moment: bool = False

    @property
    def heading(self) -> str:
        """Title and window: `radius error, mean, last fifth`."""
        return self.title + (f", {self.window}" if self.window else "")

    @property
    def head(self) -> str:
        """Title, unit and window, for heads of tables: `radius error, mean [m], last fifth`."""
        return self._replace(title=self.title + (f" [{self.unit}]" if self.unit != "1" else "")).heading

    @property
    def about(self) -> str:
        """What it means, and when it looks."""
        return f"{self.meaning}; read at {'every physics step' if self.exact else 'samples'}"

    @property
    def cost_sign(self) -> float:
        """1 where less is better, -1 where more is."""
        return -1.0 if self.more_is_better else 1.0

    @property
    def exact(self) -> bool:
        """Whether it counts every physics step of every run, whatever a scenario expects."""
        return self.read == "every step"


def quantity_of_metric(metric: Metric, span: Span | None = None) -> Quantity:
    """A metric over a part of each run; None for the metric's own."""
    window = (metric.span if span is None else span).words
    return Quantity(
        metric.unit, metric.meaning, metric.more_is_better, metric.title, window, metric.read, metric.moment
    )


PASSED, COMPLETED, COLLIDED = "passed", "completed", "collided"
RATES = {
    PASSED: Quantity("1", "the run completed and every verdict holds", True, "share of runs that pass"),
    COMPLETED: Quantity("1", "the run reached its end", True, "share of runs that complete"),
    COLLIDED: Quantity(
        "1", "something touched something (contacts > 0)", False, "share of runs with contacts"
    ),
}
SAFETY, PRECISION, EFFORT = "clearance_least", "radius_error_mean", "energy"
CLEARANCES = tuple(metric.name for metric in METRICS if metric.name.endswith("clearance_min"))
VALUES = {
    SAFETY: Quantity(
        "m",
        "least distance of a robot's surface to any other body's",
        True,
        "least clearance",
        Span("whole").words,
    ),
    **{metric.name: quantity_of_metric(metric) for metric in METRICS},
}
QUANTITIES = RATES | VALUES


def quantity_of(row: Row, quantity: str) -> float:
    """A quantity of one run, infinite for never, NaN for missing."""
    if quantity == PASSED:
        return float(row.passed)
    if quantity == COMPLETED:
        return float(row.outcome == Outcome.COMPLETED.value)
    if quantity == COLLIDED:
        touches = row.metrics.get("contacts")
        return math.nan if touches is None else float(touches > 0)
    if quantity == SAFETY:
        known = [value for name in CLEARANCES if (value := row.metrics.get(name)) is not None]
        return min(known, default=math.nan)
    value = row.metrics.get(quantity)
    return math.nan if value is None else float(value)


def value_text(value: float | None, unit: str = "", digits: int = 3) -> str:
    """A value for people; `-` for nothing, `never` for infinite, lengths below 1 m in millimeters."""
    if value is None or math.isnan(value):
        return "-"
    if math.isinf(value):
        return "never"
    if unit == "1":
        return f"{value:g}"
    if unit in ("m", "m/s") and abs(value) < 1:
        value, unit = 1000 * value, "m" + unit
    form = ".0f" if abs(value) >= 10**digits else f".{digits}g"
    return f"{value:{form}} {unit}".rstrip()
