"""Statistics of runs: intervals, paired comparisons and Pareto fronts, of plain arrays.

A value is a number, infinite for "never" (it never settled), or NaN for "missing" (the run broke off, or the
metric says nothing of it). Missing values are left out and counted. Never is larger than any number: medians,
shares, differences and tests keep it; means of one level are of its finite values alone, which say how many
are left out. Draws come from a generator of fixed seed, so that the same runs give the same numbers.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property
from statistics import NormalDist
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

LEVEL = 0.95
RESAMPLES = 4000
SEED = 0
NORMAL = NormalDist().inv_cdf((1.0 + LEVEL) / 2.0)
ROUNDING = 1e-9  # of a resolution
EXACT = 60  # differences up to which the signed-rank test adds up all signs; beyond, it is nearly normal


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


class Summary:
    """What several runs say of one quantity, in its unit.

    Attributes:
        runs: How many runs there are.
        known: How many have a value, never included.
        never: How many of these say never.
        mean: Of the finite values; NaN of none.
        deviation: Standard deviation of the finite values; 0 of fewer than two.
        median: Of all values, never included; NaN of none.
    """

    def __init__(self, values: ArrayLike) -> None:
        """Sum up runs.

        Args:
            values: One per run, infinite for never, NaN for missing; shape (runs,).
        """
        self._known = known = _known(values)
        self._finite = finite = known[np.isfinite(known)]
        self.runs, self.known, self.never = np.size(values), len(known), len(known) - len(finite)
        self.mean = float(finite.mean()) if len(finite) else math.nan
        self.deviation = float(finite.std(ddof=1)) if len(finite) > 1 else 0.0
        self.median = float(np.median(known)) if len(known) else math.nan

    @cached_property
    def mean_interval(self) -> Interval:
        """Of the mean of the finite values; NaN of fewer than two."""
        return bootstrap(self._finite, _means)

    @cached_property
    def median_interval(self) -> Interval:
        """Of the median; NaN of fewer than two values."""
        return bootstrap(self._known, _medians)


class Paired(NamedTuple):
    """One level of a factor against another, over the same seeds and the same levels of all else.

    Attributes:
        pairs: Pairs of which both have a value, never included.
        blocks: Independent blocks that they come from.
        unpaired: Pairs of which one has no value or both have none.
        never: Pairs of which one says never, or both.
        alike: Pairs that differ by no more than the resolution of their values.
        difference: Mean over blocks of each block's mean difference, second minus first; NaN of none. Where
            one alone says never, the difference is infinite; infinite ones of opposite signs cancel one for
            one, and what is left of them outweighs all numbers.
        interval: Of the difference, blocks drawn again; NaN of fewer than two.
        median: Median over blocks of each block's mean difference.
        median_interval: Of the median, blocks drawn again.
        dominance: Share of pairs in which the second is larger, minus the share in which it is smaller
            (Cliff's delta of paired data), from -1 to 1.
        dominance_interval: Of the dominance, blocks drawn again.
        p: Two-sided, of Wilcoxon's signed-rank test of the blocks' mean differences, infinite ones included;
            NaN of none.
        side: 1 if by that test the second is larger, -1 if it is smaller, 0 if neither.
    """

    pairs: int
    blocks: int
    unpaired: int
    never: int
    alike: int
    difference: float
    interval: Interval
    median: float
    median_interval: Interval
    dominance: float
    dominance_interval: Interval
    p: float
    side: int


NOTHING = Interval(math.nan, math.nan)


def proportion_of(happened: ArrayLike, method: Literal["exact", "wilson"] = "exact") -> Proportion:
    """How often something happened.

    Args:
        happened: 1 or 0 per run, NaN where it is not known; shape (runs,). What robots of one run do is not
            independent.
        method: Of the interval: of Clopper and Pearson (1934), or of Wilson (1927).
    """
    values = _known(happened)
    count, of = int(np.count_nonzero(values)), len(values)
    if not of:
        return Proportion(0, 0, math.nan, NOTHING)
    from scipy.stats import binomtest  # slow to import

    found = binomtest(count, of).proportion_ci(LEVEL, method=method)
    return Proportion(count, of, count / of, Interval(float(found.low), float(found.high)))


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


def paired(
    first: ArrayLike,
    second: ArrayLike,
    block: Sequence[object] | None = None,
    resolution: ArrayLike = 0.0,
) -> Paired:
    """Compares two levels of a factor, pair by pair.

    Args:
        first: One value per pair, infinite for never, NaN for missing; shape (pairs,).
        second: Likewise, of the other level.
        block: What each pair belongs to, such as its seed: pairs of one block are not independent, so blocks
            are what is drawn again and tested. None: every pair by itself.
        resolution: Up to this, a difference counts as none in dominance and test; shape (pairs,), or one for
            all.
    """
    a, b = np.asarray(first, dtype=np.float64), np.asarray(second, dtype=np.float64)
    fine = np.broadcast_to(np.asarray(resolution, dtype=np.float64), a.shape)
    both = ~(np.isnan(a) | np.isnan(b))
    names = list(range(len(a))) if block is None else list(block)
    kept = [name for name, known in zip(names, both, strict=True) if known]
    order = {name: index for index, name in enumerate(dict.fromkeys(kept))}
    of = np.array([order[name] for name in kept], dtype=np.intp)
    a, b, fine, count = a[both], b[both], fine[both], len(order)
    if not count:
        nothing = math.nan, NOTHING
        return Paired(0, 0, len(both), 0, 0, *nothing, *nothing, *nothing, math.nan, 0)
    gaps = np.subtract(b, a, out=np.zeros_like(a), where=a != b)
    alike = np.abs(gaps) <= fine * (1.0 + ROUNDING)
    told = np.where(alike, 0.0, gaps)
    blocks = _block_means(gaps, of, count)
    sign = np.bincount(of, weights=np.sign(told), minlength=count)
    dominance = np.stack([sign, np.bincount(of, minlength=count)], axis=1).astype(np.float64)
    p, side = signed_rank(_block_means(told, of, count))
    return Paired(
        len(a),
        count,
        len(both) - len(a),
        int(np.count_nonzero(np.isinf(a) | np.isinf(b))),
        int(np.count_nonzero(alike)),
        float(_means(blocks[None])[0]),
        bootstrap(blocks, _means),
        float(_medians(blocks[None])[0]),
        bootstrap(blocks, _medians),
        float(_shares(dominance[None])[0]),
        bootstrap(dominance, _shares),
        p,
        side,
    )


def _block_means(gaps: Array, of: NDArray[np.intp], count: int) -> Array:
    """Mean difference of each block, shape (count,); pairs belong to block `of`."""
    finite = np.isfinite(gaps)
    left = np.bincount(of, weights=np.where(finite, 0.0, np.sign(gaps)), minlength=count)
    sums = np.bincount(of, weights=np.where(finite, gaps, 0.0), minlength=count)
    return _outweighed(left, sums, np.bincount(of[finite], minlength=count))


def signed_rank(differences: ArrayLike) -> tuple[float, int]:
    """Wilcoxon's test that differences are symmetric about zero; infinite ones rank above all numbers.

    Differences of zero take part in the ranks and in no sum (Pratt, 1959). Up to `EXACT` differences, the
    probability is exact whatever their ties: all signs are equally likely, given the ranks.

    Args:
        differences: Shape (n,), without NaN.

    Returns:
        The two-sided probability, NaN of no differences; and the side on which the larger sum of ranks is,
        0 if both are alike.
    """
    from scipy.stats import rankdata  # slow to import

    values = np.asarray(differences, dtype=np.float64)
    if not len(values):
        return math.nan, 0
    ranks = np.rint(2.0 * rankdata(np.abs(values))).astype(np.int64)[values != 0.0]  # whole: twice the ranks
    upper, total = int(ranks[values[values != 0.0] > 0.0].sum()), int(ranks.sum())
    side = int(np.sign(2 * upper - total))
    if not side:
        return 1.0, 0
    if len(values) > EXACT:
        return math.erfc(abs(2 * upper - total) / math.sqrt(2.0 * float((ranks**2).sum()))), side
    chances = np.ones(1)
    for rank in ranks:
        more = np.zeros(len(chances) + rank)
        more[: len(chances)] = chances
        more[rank:] += chances
        chances = 0.5 * more
    return min(1.0, 2.0 * float(chances[max(upper, total - upper) :].sum())), side


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


def counted(count: int, what: str) -> str:
    """Return so many of something: `1 seed`, `4 seeds`."""
    return f"{count} {what}{'s' * (count != 1)}"


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
    """Means of shape (draws, n) over n."""
    finite = np.isfinite(draws)
    if finite.all():
        return np.asarray(draws.mean(axis=1))
    left = np.where(finite, 0.0, np.sign(draws)).sum(axis=1)
    return _outweighed(left, np.where(finite, draws, 0.0).sum(axis=1), finite.sum(axis=1))


def _outweighed(left: NDArray[Any], sums: NDArray[Any], counts: NDArray[np.intp]) -> Array:
    """Means of numbers and infinities, which cancel one for one; those that are left outweigh all numbers.

    Args:
        left: How many infinities are above zero, less those below.
        sums: Of the numbers.
        counts: How many numbers there are.
    """
    return np.where(left, np.copysign(np.inf, left), sums / np.maximum(counts, 1))


def _medians(draws: Array) -> Array:
    """Medians of shape (draws, n) over n; half way between both infinities is 0."""
    with np.errstate(invalid="ignore"):
        found = np.median(draws, axis=1)
    return np.where(np.isnan(found), 0.0, found)


def _shares(draws: Array) -> Array:
    """Sum of the first column over the sum of the second, shape (resamples, n, 2)."""
    total = draws.sum(axis=1)
    return np.asarray(total[:, 0] / total[:, 1])
