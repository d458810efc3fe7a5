"""Laws and outer loops side by side on one scenario: which runs that takes, and their results."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from escort_mj.control.outer_loops import OUTER_LOOPS
from escort_mj.errors import UsageError
from escort_mj.laws import LAWS as SHIPPED
from escort_mj.metrics import METRICS
from escort_mj.record.outcome import FINAL, Outcome
from escort_mj.record.window import Span
from escort_mj.scenario.findings import did_you_mean
from escort_mj.study.compare.measured import ComparedQuantity

LAWS = {str(law.model_fields["law"].default): law.title_of() for law in SHIPPED}
"""Titles of the laws that come with the package."""
OUTERS = {str(loop.model_fields["loop"].default): loop.title for loop in OUTER_LOOPS}

TRUE_ERROR, TRUE_PEAK = "true_error_rms", "true_error_max"
_OF_METRICS = {metric.name: ComparedQuantity(metric.unit, metric.meaning) for metric in METRICS}
_OWN = {
    TRUE_ERROR: ComparedQuantity("m", "root mean square of |q_d - q|, without the measurement noise"),
    TRUE_PEAK: ComparedQuantity("m", "largest |q_d - q|"),
}
QUANTITIES = {
    name: (_OWN | _OF_METRICS)[name]
    for name in (
        "settling_time",
        "radius_error_mean",
        "spacing_error_mean",
        "tracking_error_rms",
        TRUE_ERROR,
        TRUE_PEAK,
        "velocity_error_rms",
        "chattering",
        "force_rms",
        "energy",
        "obstacle_clearance_min",
        "robot_clearance_min",
        "contacts",
        "saturated_share",
    )
}
SPANS = {metric.name: metric.span for metric in METRICS if metric.name in QUANTITIES} | {
    TRUE_ERROR: Span("tail"),
    TRUE_PEAK: Span("whole"),
}
"""What each quantity looks at."""
MORE_IS_BETTER = {metric.name for metric in METRICS if metric.more_is_better}


class Trial(NamedTuple):
    """One run of a comparison: a law and an outer loop by their names, and the seed of all randomness."""

    law: str
    outer: str
    seed: int

    @property
    def name(self) -> str:
        """Name of its run folder and of its scenario."""
        return f"{self.law}-{self.outer}-seed{self.seed}"


class Result(NamedTuple):
    """What came of a trial.

    Attributes:
        trial: Which.
        outcome: How it ended.
        message: The same in words.
        values: By the names of `QUANTITIES`; None where there is nothing to measure, infinite for "never".
        ran: Whether it ran now, and not before.
    """

    trial: Trial
    outcome: str
    message: str
    values: dict[str, float | None]
    ran: bool = False

    @property
    def completed(self) -> bool:
        """Whether the run reached its end."""
        return self.outcome == Outcome.COMPLETED.value

    @property
    def stated(self) -> bool:
        """Whether the simulation itself decided how it ended."""
        return self.outcome in FINAL


def title_of(law: str) -> str:
    """What pictures and tables call a law: one of a plugin by its name."""
    return LAWS.get(law, law)


def chosen_names(
    option: str, words: Sequence[str], known: Iterable[str], default: Sequence[str]
) -> list[str]:
    """Names that a user picks, such as `apd_smc,pd`, in the order given and each once.

    Args:
        option: What to call it in messages.
        words: What the user wrote; every one may hold several names.
        known: All that there are.
        default: What is meant by writing nothing.

    Raises:
        UsageError: If there is no such name.
    """
    names = list(known)
    picked = [word.strip() for text in words for word in text.split(",") if word.strip()]
    for word in picked:
        if word not in names:
            raise UsageError(f"{option} {word}: allowed are {', '.join(names)}{did_you_mean(word, names)}")
    return list(dict.fromkeys(picked)) or list(default)


def trials(laws: Iterable[str], outers: Sequence[str], seeds: Sequence[int]) -> list[Trial]:
    """Every combination, in the order of the table."""
    return [Trial(law, outer, seed) for law in laws for outer in outers for seed in seeds]


class Spread(NamedTuple):
    """A quantity over the seeds of one combination.

    Attributes:
        mean: Of the finite values; None without any.
        deviation: Their standard deviation; 0 for one.
        never: How many are infinite.
        known: How many there are, those included.
    """

    mean: float | None
    deviation: float
    never: int
    known: int


def mean_and_deviation(values: Iterable[float | None]) -> Spread:
    """Mean and standard deviation of what was measured; nothing counts where nothing could be."""
    known = [value for value in values if value is not None]
    finite = [value for value in known if math.isfinite(value)]
    if not finite:
        return Spread(None, 0.0, len(known), len(known))
    mean = math.fsum(finite) / len(finite)
    square = math.fsum((value - mean) ** 2 for value in finite) / max(len(finite) - 1, 1)
    return Spread(mean, math.sqrt(square), len(known) - len(finite), len(known))


class Combination(NamedTuple):
    """One combination of a comparison.

    Attributes:
        law: By its name.
        outer: By its name.
        results: One per seed.
        spreads: By the names of `QUANTITIES`, over the seeds that reached their end.
    """

    law: str
    outer: str
    results: list[Result]
    spreads: Mapping[str, Spread]

    @property
    def completed(self) -> int:
        """How many seeds reached their end."""
        return sum(result.completed for result in self.results)

    @property
    def title(self) -> str:
        """Law and outer loop in words."""
        return f"{title_of(self.law)} / {OUTERS[self.outer]}"


def rows(results: Iterable[Result]) -> list[Combination]:
    """Results by combination, in the order of the first of each."""
    groups: dict[tuple[str, str], list[Result]] = {}
    for result in results:
        groups.setdefault((result.trial.law, result.trial.outer), []).append(result)
    return [
        Combination(
            law,
            outer,
            group,
            {name: mean_and_deviation(each.values[name] for each in group) for name in QUANTITIES},
        )
        for (law, outer), group in groups.items()
    ]


def best(table: Sequence[Combination], name: str) -> float | None:
    """The best mean of a quantity; only combinations count that reached every end and never say never."""
    means = [
        row.spreads[name].mean
        for row in table
        if row.completed == len(row.results) and not row.spreads[name].never
    ]
    known = [mean for mean in means if mean is not None]
    if not known:
        return None
    return max(known) if name in MORE_IS_BETTER else min(known)
