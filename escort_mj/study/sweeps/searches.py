"""What a study says of searches: which keys are tuned to what end, or searched for a failure."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field, PositiveFloat, PositiveInt

from escort_mj.components.parameters import Parameters
from escort_mj.scenario.findings import Finding
from escort_mj.study.sweeps.expected import CellBound
from escort_mj.study.sweeps.quantities import MetricOver
from escort_mj.study.sweeps.ranges import Box


class Search(Parameters):
    """What tuning and falsifying have in common."""

    over: Box
    """Scenario keys or parameters, and the bounds within which each is searched."""
    seed: Annotated[int, Field(ge=0, lt=2**32)] = 0
    """Seed of the search."""
    batch: Annotated[int, Field(ge=1, le=1000)] = 8
    """Points that are chosen at once, before any of them is known; not the number of workers, so that the
    search is the same on every machine."""


class Falsify(Search):
    """A search for a run that breaks a verdict."""

    method: Literal["cmaes", "tpe", "random"] = "cmaes"
    """CMA-ES, Bayesian (tree-structured Parzen estimators), or evenly at random."""
    runs: Annotated[int, Field(ge=1, le=1_000_000)] = 1000
    """Most runs of the search; shrinking what it finds takes some more."""
    collect: PositiveInt = 1
    """How many points that break a verdict end the search."""


class Objective(MetricOver):
    """A metric that is to become small, or large: its mean over cells and seeds counts."""

    goal: Literal["minimize", "maximize"] = "minimize"
    """Which way."""


class MetricBound(CellBound):
    """A bound on the mean of a metric over cells and seeds."""

    at_most_own: PositiveFloat | None = None
    """Upper bound as a multiple of what the scenario's own values come to, with the same seeds."""


class Tune(Search):
    """A search for better values, among those with which every verdict holds."""

    objectives: Annotated[tuple[Objective, ...], Field(min_length=1, max_length=4)]
    """What is to be reached; with several, the front of what cannot be bettered in all of them is sought."""
    bounds: tuple[MetricBound, ...] = ()
    """What must hold beside the scenario's own expectations."""
    verdicts: bool = True
    """Whether every verdict of every run must hold."""
    trials: Annotated[int, Field(ge=1, le=100_000)] = 200
    """Points to try; each takes a run for every cell and seed."""
    sampler: Literal["tpe", "nsga2", "random"] | None = None
    """Bayesian (tree-structured Parzen estimators), evolutionary (NSGA-II) or evenly at random; null: `tpe`
    for one objective, `nsga2` for several."""
    held_out: Annotated[int, Field(ge=0, le=100_000)] = 20
    """Seeds beyond the study's own, with which the best values and the scenario's own are compared."""

    @property
    def method(self) -> str:
        """The sampler that is used."""
        return self.sampler or ("tpe" if len(self.objectives) == 1 else "nsga2")

    def findings(self) -> Iterator[Finding]:
        """What is wrong between its keys."""
        for part, measured in (("objectives", self.objectives), ("bounds", self.bounds)):
            for place, one in enumerate(measured):
                yield from one.findings(("tune", part, place))
        for place, bound in enumerate(self.bounds):
            if bound.at_most is None and bound.at_least is None and bound.at_most_own is None:
                message = f"has no bound; give at_most, at_least or at_most_own to {bound.metric}"
                yield Finding(("tune", "bounds", place), message)
        metrics = [objective.key for objective in self.objectives]
        for place, metric in enumerate(metrics):
            if metric in metrics[:place]:
                yield Finding(("tune", "objectives", place, "metric"), f"{metric} is an objective already")
