"""Statistics of runs: intervals, paired comparisons and Pareto fronts, of plain arrays.

A value is a number, infinite for "never" (it never settled), or NaN for "missing" (the run broke off, or the
metric says nothing of it). Missing values are left out and counted. Never is larger than any number: medians
and shares keep it, means are of the finite values alone. Draws come from a generator of fixed seed,
so that the same runs give the same numbers.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

LEVEL = 0.95
RESAMPLES = 4000
SEED = 0


class Interval(NamedTuple):
    """A confidence interval of level `LEVEL`.

    Attributes:
        low: Lower bound.
        high: Upper bound.
    """

    low: float
    high: float


class Proportion(NamedTuple):
    """How often something happened.

    Attributes:
        times: How often.
        of: How often it could have.
        share: Maximum-likelihood estimate, times / of; NaN of nothing.
        interval: Binomial interval of the probability, see `proportion_of`.
    """

    times: int
    of: int
    share: float
    interval: Interval


class Summary(NamedTuple):
    """What several runs say of one quantity, in its unit.

    Attributes:
        runs: How many runs there are.
        known: How many have a value, never included.
        never: How many of these say never.
        mean: Of the finite values; NaN of none.
        mean_interval: Of the mean of the finite values; NaN of fewer than two.
        median: Of all values, never included; NaN of none.
        median_interval: Of the median; NaN of fewer than two values.
    """

    runs: int
    known: int
    never: int
    mean: float
    mean_interval: Interval
    median: float
    median_interval: Interval


class Paired(NamedTuple):
    """One level of a factor against another, over the same seeds and the same levels of all else.

    Attributes:
        pairs: Pairs of which both have a value, never included.
        blocks: Independent blocks that they come from.
        unpaired: Pairs of which one has no value or both have none.
        never: Pairs of which one says never, or both: in the dominance, but not in the mean.
        difference: Mean over blocks of each block's mean difference, second minus first; NaN of none.
        interval: Of the difference, blocks drawn again; NaN of fewer than two.
        dominance: Share of pairs in which the second is larger, minus the share in which it is smaller
            (Cliff's delta of paired data), from -1 to 1.
        dominance_interval: Of the dominance, blocks drawn again.
        p: Two-sided, of Wilcoxon's signed-rank test of the blocks' mean differences; NaN of none.
    """

    pairs: int
    blocks: int
    unpaired: int
    never: int
    difference: float
    interval: Interval
    dominance: float
    dominance_interval: Interval
    p: float


NOTHING = Interval(math.nan, math.nan)


def proportion_of(happened: ArrayLike, method: Literal["exact", "wilson"] = "exact") -> Proportion:
    """How often something happened.

    Args:
        happened: 1 or 0 per run, NaN where it is not known; shape (runs,).
        method: Of the interval: of Clopper and Pearson (1934), or of Wilson (1927).
    """
    values = _known(happened)
    count, of = int(np.count_nonzero(values)), len(values)
    if not of:
        return Proportion(0, 0, math.nan, NOTHING)
    from scipy.stats import binomtest  # slow to import

    found = binomtest(count, of).proportion_ci(LEVEL, method=method)
    return Proportion(count, of, count / of, Interval(float(found.low), float(found.high)))


def summary(values: ArrayLike) -> Summary:
    """What several runs say of one quantity.

    Args:
        values: One per run, infinite for never, NaN for missing; shape (runs,).
    """
    all_runs = np.asarray(values, dtype=np.float64)
    known = _known(all_runs)
    finite = known[np.isfinite(known)]
    return Summary(
        len(all_runs),
        len(known),
        len(known) - len(finite),
        float(finite.mean()) if len(finite) else math.nan,
        bootstrap(finite, _means),
        float(np.median(known)) if len(known) else math.nan,
        bootstrap(known, _medians),
    )


def bootstrap(values: Array, statistic: Callable[[Array], Array]) -> Interval:
    """Percentile interval: the statistic of as many values, drawn with replacement again and again.

    Args:
        values: Shape (n, ...); rows are drawn.
        statistic: From draws, shape (resamples, n, ...), to shape (resamples,).

    Returns:
        The interval; NaN of fewer than two values.
    """
    if len(values) < 2:
        return NOTHING
    draws = np.random.Generator(np.random.Philox(SEED)).integers(len(values), size=(RESAMPLES, len(values)))
    found = statistic(values[draws])
    found = found[~np.isnan(found)]
    if not len(found):
        return NOTHING
    ends = ((1.0 - LEVEL) / 2.0, (1.0 + LEVEL) / 2.0)
    # Not interpolated: half way from a number to never is no number.
    low, high = np.quantile(found, ends, method="inverted_cdf")
    return Interval(float(low), float(high))


def paired(first: ArrayLike, second: ArrayLike, block: Sequence[object] | None = None) -> Paired:
    """Compares two levels of a factor, pair by pair.

    Args:
        first: One value per pair, infinite for never, NaN for missing; shape (pairs,).
        second: Likewise, of the other level.
        block: What each pair belongs to, such as its seed: pairs of one block are not independent, so blocks
            are what is drawn again and tested. None: every pair by itself.
    """
    a, b = np.asarray(first, dtype=np.float64), np.asarray(second, dtype=np.float64)
    both = ~(np.isnan(a) | np.isnan(b))
    names = list(range(len(a))) if block is None else list(block)
    kept = [name for name, known in zip(names, both, strict=True) if known]
    order = {name: index for index, name in enumerate(dict.fromkeys(kept))}
    of = np.array([order[name] for name in kept], dtype=np.intp)
    a, b, count = a[both], b[both], len(order)
    if not count:
        return Paired(0, 0, len(both), 0, math.nan, NOTHING, math.nan, NOTHING, math.nan)
    finite = np.isfinite(a) & np.isfinite(b)
    gaps = np.subtract(b, a, out=np.zeros_like(a), where=finite)
    sizes = np.bincount(of[finite], minlength=count)
    sums = np.bincount(of, weights=gaps, minlength=count)
    blocks = sums[sizes > 0] / sizes[sizes > 0]
    larger = np.bincount(of, weights=np.greater(b, a) * 1.0 - np.less(b, a), minlength=count)
    dominance = np.stack([larger, np.bincount(of, minlength=count)], axis=1).astype(np.float64)
    return Paired(
        len(a),
        count,
        len(both) - len(a),
        int(np.count_nonzero(~finite)),
        float(blocks.mean()) if len(blocks) else math.nan,
        bootstrap(blocks, _means),
        float(_shares(dominance[None])[0]),
        bootstrap(dominance, _shares),
        _signed_rank(blocks),
    )


def holm(p: Sequence[float]) -> list[float]:
    """Probabilities of error adjusted for their number (Holm, 1979); NaN stay as they are, and do not count.

    The adjusted ones below 0.05 all hold together with a probability of error below 0.05.
    """
    order = sorted((value, index) for index, value in enumerate(p) if not math.isnan(value))
    adjusted, least = list(p), 0.0
    for rank, (value, index) in enumerate(order):
        least = max(least, min(1.0, (len(order) - rank) * value))
        adjusted[index] = least
    return adjusted


def pareto(points: ArrayLike) -> NDArray[np.bool_]:
    """Which points no other point beats: as small in every coordinate, and smaller in one.

    Args:
        points: Shape (n, k), the less the better; points with a NaN are on no front.

    Returns:
        Shape (n,).
    """
    x = np.asarray(points, dtype=np.float64)
    known = ~np.isnan(x).any(axis=1)
    beaten = [bool((known & (x <= row).all(axis=1) & (x < row).any(axis=1)).any()) for row in x]
    return known & ~np.array(beaten, dtype=bool)


def _known(values: ArrayLike) -> Array:
    array = np.asarray(values, dtype=np.float64)
    return array[~np.isnan(array)]


def _means(draws: Array) -> Array:
    return np.asarray(draws.mean(axis=1))


def _medians(draws: Array) -> Array:
    return np.asarray(np.median(draws, axis=1))


def _shares(draws: Array) -> Array:
    """Sum of the first column over the sum of the second, shape (resamples, n, 2)."""
    total = draws.sum(axis=1)
    return np.asarray(total[:, 0] / total[:, 1])


def _signed_rank(differences: Array) -> float:
    """Wilcoxon's test that differences are symmetric about zero; zeros halve to both sides (Pratt)."""
    if not len(differences):
        return math.nan
    if not differences.any():
        return 1.0
    from scipy.stats import wilcoxon  # slow to import

    with warnings.catch_warnings():
        warnings.simplefilter(
            "ignore"
        )  # of a few pairs, whose exact distribution SciPy cannot have with ties
        return float(wilcoxon(differences, zero_method="zsplit").pvalue)
