"""What tuning came to, as tables for people and programs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from escort_mj.record.tables import comma_separated, headed
from escort_mj.study.sweeps.definition import Tune
from escort_mj.study.sweeps.results import unit_of


@dataclass(frozen=True)
class TunedPoint:
    """What came of one point.

    Attributes:
        point: The values that were tried; empty for the scenario's own.
        values: Of the objectives, in their order; None where no scenario is possible or a run has no value.
        bounded: Means of the metrics that have bounds.
        violations: By how much it breaks each constraint, by its size; up to 0 it holds.
    """

    point: dict[str, float]
    values: tuple[float, ...] | None
    bounded: dict[str, float]
    violations: dict[str, float]

    @property
    def feasible(self) -> bool:
        """Whether it has values and every constraint holds."""
        return self.values is not None and all(excess <= 0.0 for excess in self.violations.values())


class Gain(NamedTuple):
    """One metric with the best values against the scenario's own, on the seeds held out.

    Attributes:
        own: Its mean with the scenario's own values, of pairs of which neither says never.
        best: Its mean with the best ones, of the same pairs.
        change: Relative change of the mean.
        low: Lower bound of a bootstrap interval of the change, pairs of runs drawn again.
        high: Upper bound.
        better: In how many pairs it is smaller; never is larger than any number.
        pairs: How many there are, those with never included.
        never: In how many of them it says never: with the scenario's own values, and with the best ones.
    """

    own: float
    best: float
    change: float
    low: float
    high: float
    better: int
    pairs: int
    never: tuple[int, int]


@dataclass(frozen=True)
class Tuned:
    """What tuning came to.

    Attributes:
        own: The scenario's own values.
        trials: Every point that was tried, in order.
        front: Places in it of the feasible points that no other betters in all objectives, by the first.
        gains: By metric, of the front's first against the scenario's own; empty without seeds held out.
        failed: Runs held out that failed a verdict: with the scenario's own values, and with the best.
        runs: Runs that it took, made before or now.
        made: How many of them were made now.
    """

    own: TunedPoint
    trials: tuple[TunedPoint, ...]
    front: tuple[int, ...]
    gains: dict[str, Gain]
    failed: tuple[int, int]
    runs: int
    made: int

    @property
    def best(self) -> TunedPoint:
        """The feasible trial that is best in the first objective."""
        return self.trials[self.front[0]]


def trials_csv(search: Tune, own: TunedPoint, trials: Sequence[TunedPoint], front: Sequence[int]) -> str:
    """All trials as comma-separated values; number 0 is the scenario's own."""
    objectives = [objective.key for objective in search.objectives]
    bounded = [m for m in dict.fromkeys(bound.key for bound in search.bounds) if m not in objectives]
    units = {key: unit_of(key) for key in search.over} | units_of(search)
    heads = [headed(key, units[key]) for key in (*search.over, *objectives, *bounded)]
    lines: list[list[object]] = [["trial", *heads, *own.violations, "feasible", "front"]]
    for number, trial in enumerate([own, *trials]):
        lines.append(
            [
                number,
                *(trial.point.get(key) for key in search.over),
                *(trial.values or [None] * len(objectives)),
                *(trial.bounded.get(metric) for metric in bounded),
                *(trial.violations.get(name) for name in own.violations),
                trial.feasible,
                number - 1 in front,
            ]
        )
    return comma_separated(lines)


def units_of(search: Tune) -> dict[str, str]:
    """Units of what a search looks at, by key; empty where none is known."""
    return {one.key: one.unit for one in (*search.objectives, *search.bounds)}


def rows_of_gains(found: Tuned, search: Tune) -> Iterator[list[str]]:
    """The comparison on seeds held out by metric: own, tuned, change, its interval, in how many smaller."""
    units = units_of(search)
    for metric, gain in found.gains.items():
        unit = "" if units[metric] in ("", "1") else f" {units[metric]}"
        yield [
            metric,
            f"{gain.own:.3g}{unit}",
            f"{gain.best:.3g}{unit}",
            f"{100 * gain.change:+.1f} %",
            f"{100 * gain.low:+.1f} to {100 * gain.high:+.1f} %",
            f"{gain.better} of {gain.pairs}" + _never(gain),
        ]


def _never(gain: Gain) -> str:
    """How often runs say never, with the scenario's own values and with the best."""
    return f", never {gain.never[0]} -> {gain.never[1]}" if any(gain.never) else ""


def tuning_lines(found: Tuned, search: Tune, base: Mapping[str, float | None]) -> list[str]:
    """What is to be said of tuning, for a terminal."""
    feasible = sum(trial.feasible for trial in found.trials)
    said = [f"{len(found.trials)} trials, {found.runs} runs; {feasible} trials keep every constraint"]
    if len(search.objectives) > 1:
        said.append(
            f"{len(found.front)} of them are the front; below, the best in {search.objectives[0].key}"
        )
    said += [
        f"  {key} = {value:.4g} (the scenario's own: {'none' if base[key] is None else f'{base[key]:.4g}'})"
        for key, value in found.best.point.items()
    ]
    if found.gains:
        pairs = max(gain.pairs for gain in found.gains.values())
        said.append(f"on {pairs} pairs of runs with seeds held out, own and tuned (95 % interval):")
        for metric, own, best, change, interval, better in rows_of_gains(found, search):
            said.append(f"  {metric}: {own} -> {best}, {change} ({interval}), smaller in {better}")
        said.append(f"  runs that failed a verdict: {found.failed[0]} -> {found.failed[1]}")
    return said
