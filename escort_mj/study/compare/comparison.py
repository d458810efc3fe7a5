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
from escort_mj.study.sweeps.design import Clock
from escort_mj.study.sweeps.quantities import VALUES, Quantity
from escort_mj.study.sweeps.statistics import LEVEL, holm, paired

LAWS = {str(law.model_fields["law"].default): law.title_of() for law in SHIPPED}
"""Titles of the laws that come with the package."""
OUTERS = {str(loop.model_fields["loop"].default): loop.title for loop in OUTER_LOOPS}

TRUE_ERROR, TRUE_PEAK = "true_error_rms", "true_error_max"
_OWN = {
    TRUE_ERROR: Quantity(
        "m",
        "root mean square of |q_d - q|, without the measurement noise",
        title="error without noise, rms",
        window=Span("tail").words,
        read="samples",
    ),
    TRUE_PEAK: Quantity(
        "m",
        "largest |q_d - q|",
        title="error without noise, max",
        window=Span("whole").words,
        read="samples",
    ),
}
_SPANS = {metric.name: metric.span for metric in METRICS} | {
    TRUE_ERROR: Span("tail"),
    TRUE_PEAK: Span("whole"),
}
QUANTITIES = {
    name: (VALUES | _OWN)[name]
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


def span_of(name: str, over: Span | None = None) -> Span:
    """The part of a run that a quantity looks at.

    Args:
        name: Of the quantity.
        over: What is asked for; None for its own. A moment is looked for in the whole run.
    """
    return _SPANS[name] if over is None or QUANTITIES[name].moment else over


def quantities_over(over: Span | None = None) -> dict[str, Quantity]:
    """The quantities of a comparison, each with its window in words; see `span_of`."""
    return {name: one._replace(window=span_of(name, over).words) for name, one in QUANTITIES.items()}


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
    def whole(self) -> bool:
        """Whether every seed reached its end."""
        return self.completed == len(self.results)

    def values(self, name: str) -> list[float]:
        """A quantity of each seed; NaN for none, infinite for never."""
        return [
            math.nan if one.values[name] is None else float(one.values[name] or 0.0) for one in self.results
        ]

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


def best(table: Sequence[Combination], name: str) -> Combination | None:
    """The combination with the best mean of a quantity; None without any.

    Only those count that reached every end, and the best never says never.
    """
    sign = -1.0 if QUANTITIES[name].more_is_better else 1.0
    able = [
        (sign * mean, place, row)
        for place, row in enumerate(table)
        if row.whole and (mean := row.spreads[name].mean) is not None and not row.spreads[name].never
    ]
    return min(able)[2] if able else None


def told_best(table: Sequence[Combination], clock: Clock) -> dict[str, tuple[Combination, float]]:
    """Combinations that are better than each other one in a quantity, as far as tests can tell.

    The one with the best mean is held against each other that reached every end, seed by seed, by Wilcoxon's
    signed-rank test. The largest p, times the number of others (Bonferroni), is that of being the best; those
    of all quantities are corrected together (Holm).

    Args:
        table: The combinations.
        clock: How often runs are looked at: moments that differ by no more are alike.

    Returns:
        By quantity, the combination and its corrected p, where that is below 1 - `LEVEL`.
    """
    firsts = {name: row for name in QUANTITIES if (row := best(table, name)) is not None}
    chances = {name: _chance(table, name, row, clock) for name, row in firsts.items()}
    corrected = dict(zip(chances, holm(list(chances.values())), strict=True))
    return {name: (firsts[name], p) for name, p in corrected.items() if p < 1.0 - LEVEL}


def _chance(table: Sequence[Combination], name: str, first: Combination, clock: Clock) -> float:
    """Probability of a combination to look better than each other one by chance; NaN without others."""
    quantity = QUANTITIES[name]
    fine = (clock.timestep if quantity.exact else clock.interval) if quantity.moment else 0.0
    others = [row for row in table if row is not first and row.whole and row.spreads[name].known]
    found = [paired(first.values(name), row.values(name), resolution=fine) for row in others]
    if all(one.alike == one.pairs for one in found):
        return math.nan
    sign = -1 if quantity.more_is_better else 1
    worst = max(one.p if sign * one.side > 0 and sign * one.dominance > 0.0 else 1.0 for one in found)
    return min(1.0, worst * len(found))
