"""What a study expects of its cells, and which of its kept runs it shows side by side."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any

from pydantic import Field

from escort_mj.components.parameters import TEXT, Parameters
from escort_mj.scenario.findings import Finding, Path
from escort_mj.scenario.schema.fields import LABEL, RUN_NAME
from escort_mj.study.sweeps.quantities import ChosenMetric, MetricOver

Where = dict[str, Any]
"""Factors, and the level of each, or a list of levels, in the words of tables."""


class CellBound(MetricOver):
    """A bound on a cell's median of a metric."""

    at_most: float | None = None
    """Upper bound, in the metric's unit."""
    at_least: float | None = None
    """Lower bound, in the metric's unit."""


class Better(Parameters):
    """A comparison of each cell with another one."""

    than: Annotated[Where, Field(min_length=1)]
    """What is different in the other cell: factors, and the level of each."""
    quantities: Annotated[tuple[ChosenMetric, ...], Field(min_length=1)]
    """Metrics. Medians count; one of them must be better, and none worse by more than 5 %."""
    by: Annotated[float, Field(gt=0, lt=1)] = 0.05
    """By which share one must be better at least."""


class CellsExpectation(Parameters):
    """What is expected of some cells: that their runs complete, and more."""

    claim: Annotated[str, Field(pattern=LABEL)]
    """What is claimed."""
    source: Annotated[str, Field(max_length=200, pattern=TEXT)] = ""
    """Who says so, and where."""
    where: Where = {}
    """Which cells it is about; empty: all."""
    bounds: tuple[CellBound, ...] = ()
    """What must hold in each of these cells."""
    better: Better | None = None
    """Than which other cells each of them must be better."""

    def asked(self) -> Iterator[tuple[Path, MetricOver]]:
        """Every metric that it names, and where."""
        yield from ((("bounds", place), one) for place, one in enumerate(self.bounds))
        if self.better is not None:
            yield from (
                (("better", "quantities", place), one) for place, one in enumerate(self.better.quantities)
            )

    def findings(self, path: Path) -> Iterator[Finding]:
        """What is wrong between its keys, which stand at a path."""
        for where, one in self.asked():
            yield from one.findings((*path, *where))
        for place, bound in enumerate(self.bounds):
            if bound.at_most is None and bound.at_least is None:
                yield Finding((*path, "bounds", place), "has no bound; give at_most or at_least")


class KeptFigure(Parameters):
    """A figure of runs that are kept, side by side."""

    name: Annotated[str, Field(pattern=RUN_NAME)]
    """Name of its file."""
    title: Annotated[str, Field(max_length=200, pattern=TEXT)] = ""
    """What stands above it."""
    draw: str
    """Which figure of a run, such as `panels` or `paths`."""
    where: Annotated[Where, Field(min_length=1)]
    """Which cells, up to four; the run with the first seed of each is shown."""
