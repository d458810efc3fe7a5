"""Statistics against values worked out by hand, closed forms and known distributions."""

import math
from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import stdtr
from scipy.stats import wilcoxon

from escort_mj.study.sweeps.statistics import (
    LEVEL,
    Summary,
    _means,
    bootstrap,
    holm,
    paired,
    pareto,
    proportion_of,
    signed_rank,
)

NAN, NEVER = math.nan, math.inf


@pytest.mark.parametrize("of", [1, 5, 20, 500])
def test_edges_of_the_exact_interval_have_closed_forms(of: int) -> None:
    tail = (1.0 - LEVEL) / 2.0
    none, all_of_them = proportion_of(np.zeros(of)), proportion_of(np.ones(of))
    assert none.interval == pytest.approx((0.0, 1.0 - tail ** (1.0 / of)))
    assert all_of_them.interval == pytest.approx((tail ** (1.0 / of), 1.0))


def test_an_exact_interval_from_the_literature() -> None:
    found = proportion_of([1] * 4 + [0] * 16)  # Clopper and Pearson: 0.0573 to 0.4366
    assert (found.times, found.of, found.share) == (4, 20, 0.2)
    assert found.interval == pytest.approx((0.057334, 0.436614), abs=1e-6)


def test_rates_leave_out_what_is_not_known() -> None:
    assert proportion_of([1, 0, NAN])[:3] == (1, 2, 0.5)
    assert math.isnan(proportion_of([NAN]).share)


def test_never_is_in_medians_and_not_in_means() -> None:
    found = Summary([1.0, 2.0, 6.0, NEVER, NEVER, NAN])
    assert (found.runs, found.known, found.never, found.mean, found.median) == (6, 5, 2, 3.0, 6.0)
    assert found.median_interval.low == 1.0 and found.median_interval.high == NEVER
    assert 1.0 <= found.mean_interval.low < 3.0 < found.mean_interval.high <= 6.0
    assert Summary([1.0, NEVER, NEVER]).median == NEVER
    assert math.isnan(Summary([NEVER]).mean) and math.isnan(Summary([NAN, NAN]).median)


def test_one_value_has_no_interval_and_equal_values_an_empty_one() -> None:
    assert math.isnan(Summary([2.0]).mean_interval.low)
    assert Summary([2.0] * 5).mean_interval == (2.0, 2.0) == Summary([2.0] * 5).median_interval


def test_the_bootstrap_is_the_same_every_time_and_near_the_normal_interval() -> None:
    values = np.random.default_rng(1).normal(3.0, 2.0, 400)
    found = bootstrap(values, _means)
    assert found == bootstrap(values, _means)
    half = 1.959964 * values.std() / math.sqrt(len(values))
    assert found == pytest.approx((values.mean() - half, values.mean() + half), abs=0.1 * half)


@pytest.mark.slow
@pytest.mark.parametrize("n", [10, pytest.param(40, marks=pytest.mark.slow)])
def test_intervals_of_normal_values_cover_the_mean_as_often_as_theory_says(n: int) -> None:
    # It is nearly mean +- 1.96 s / sqrt(n), s with divisor n: Student's t knows how often that covers.
    trials, rng = 600, np.random.default_rng(2)
    theory = 2.0 * stdtr(n - 1, 1.959964 * math.sqrt((n - 1) / n)) - 1.0
    found = [Summary(rng.normal(1.0, 1.0, n)) for _ in range(trials)]
    of_mean = np.mean([one.mean_interval.low <= 1.0 <= one.mean_interval.high for one in found])
    of_median = np.mean([one.median_interval.low <= 1.0 <= one.median_interval.high for one in found])
    assert of_mean == pytest.approx(theory, abs=4.0 * math.sqrt(theory * (1.0 - theory) / trials))
    assert 0.9 <= of_median <= 0.99


def test_pairs_worked_out_by_hand() -> None:
    found = paired([1.0, 2.0, 3.0, 4.0], [2.0, 4.0, 3.0, 3.0])
    assert (found.pairs, found.blocks, found.difference) == (4, 4, 0.5)
    assert found.dominance == 0.25  # two larger, one smaller, one alike
    assert found.interval.low < 0.5 < found.interval.high


def test_pairs_with_never_and_missing_values() -> None:
    found = paired([1.0, NEVER, NEVER, 5.0, NAN], [2.0, 3.0, NEVER, NEVER, 1.0])
    assert (found.pairs, found.unpaired, found.never) == (4, 1, 3)
    assert found.difference == found.median == 0.5  # 1, less than all, none, more than all
    assert found.dominance == 0.25  # larger, smaller, alike, larger
    lost = paired([NAN, 1.0], [1.0, NAN])
    assert lost.pairs == 0 and lost.unpaired == 2 and math.isnan(lost.p)
    only_never = paired([1.0, 1.0], [NEVER, NEVER])
    assert only_never.difference == only_never.median == NEVER and only_never.dominance == 1.0


def test_faster_sometimes_and_mostly_never_is_not_better() -> None:
    first = np.full(20, 10.0)
    found = paired(first, [9.8] * 6 + [NEVER] * 14)
    assert (found.side, found.difference, found.median) == (1, NEVER, NEVER)
    assert found.p == pytest.approx(brute_signed_rank([-0.2] * 6 + [NEVER] * 14)) and found.p < 0.01
    assert found.dominance == pytest.approx(0.4) and found.interval == (NEVER, NEVER)


def test_always_against_never_is_told_by_as_many_seeds_as_anything_else() -> None:
    found = paired(np.arange(8.0), np.full(8, NEVER))
    assert (found.p, found.side, found.never) == (pytest.approx(2.0 / 2**8), 1, 8)
    back = paired(np.full(8, NEVER), np.arange(8.0))
    assert (back.difference, back.median, back.side, back.p) == (-NEVER, -NEVER, -1, found.p)
    assert back.interval == (-NEVER, -NEVER)


def test_never_once_is_no_reason_to_call_the_rest_worse() -> None:
    found = paired(np.full(20, 10.0), [9.0] * 19 + [NEVER])
    assert found.median == -1.0 and found.side == -1 and found.difference == NEVER
    assert found.interval.low == -1.0 and found.interval.high == NEVER  # a third of all draws leave it out


def brute_signed_rank(values: list[float]) -> float:
    """Two-sided, by counting how many ways of signs come to each sum of ranks."""
    size = np.abs(values)
    ranks = [2 * int(np.sum(size < one)) + int(np.sum(size == one)) + 1 for one in size]
    moving = [rank for rank, value in zip(ranks, values, strict=True) if value]
    found = abs(sum(math.copysign(rank, value) for rank, value in zip(ranks, values, strict=True) if value))
    counts = Counter({0: 1})
    for rank in moving:
        up, down = ({total + sign * rank: n for total, n in counts.items()} for sign in (1, -1))
        counts = Counter(up) + Counter(down)
    return sum(number for total, number in counts.items() if abs(total) >= found) / 2 ** len(moving)


@given(st.lists(st.sampled_from([-NEVER, -2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 3.0, NEVER]), max_size=14))
def test_the_signed_rank_test_counts_signs(values: list[float]) -> None:
    p, side = signed_rank(values)
    if not values:
        assert math.isnan(p) and side == 0
        return
    assert p == pytest.approx(brute_signed_rank(values))
    assert signed_rank([-value for value in values]) == (p, -side)


@pytest.mark.parametrize("n", [3, 12, 40, 60, 200])
def test_the_signed_rank_test_is_that_of_scipy_where_nothing_ties(n: int) -> None:
    values = np.random.default_rng(n).normal(0.3, 1.0, n)
    method = "exact" if n <= 60 else "asymptotic"
    assert signed_rank(values)[0] == pytest.approx(wilcoxon(values, method=method).pvalue)


def test_differences_within_the_resolution_are_none() -> None:
    first, sample = 5.0 + 0.02 * np.arange(20), 0.02
    faster = paired(first, first - 0.02 * (np.arange(20) % 5 > 0), resolution=sample)
    assert faster.difference == pytest.approx(-0.016)  # 0.016 s of samples 0.02 s apart
    assert (faster.alike, faster.p, faster.side, faster.dominance) == (20, 1.0, 0, 0.0)
    assert paired(first, first - 0.02 * (np.arange(20) % 5 > 0)).p < 0.001
    assert paired(first, first - 0.04, resolution=sample).p < 0.001
    each = paired(first, first - 0.02, resolution=np.where(np.arange(20) < 10, 0.02, 0.001))
    assert each.alike == 10 and each.side == -1


def test_pairs_of_one_seed_are_one_piece_of_evidence() -> None:
    rng = np.random.default_rng(3)
    shared = np.repeat(rng.normal(0.0, 1.0, 6), 50)  # six seeds, fifty cells that all feel the seed alike
    second, seeds = shared + rng.normal(0.0, 0.01, 300), list(np.repeat(np.arange(6), 50))
    by_pair, by_seed = paired(np.zeros(300), second), paired(np.zeros(300), second, seeds)
    assert (by_seed.pairs, by_seed.blocks) == (300, 6)
    assert by_seed.difference == pytest.approx(by_pair.difference)
    width, naive = (found.interval.high - found.interval.low for found in (by_seed, by_pair))
    assert 5.0 < width / naive < 9.0  # about the root of 50
    assert by_seed.p > 0.02


def test_blocks_weigh_alike_however_many_pairs_they_have() -> None:
    found = paired([0.0] * 4, [1.0, 1.0, 1.0, 5.0], ["a", "a", "a", "b"])
    assert (found.blocks, found.difference, found.pairs) == (2, 3.0, 4)


def test_holm_by_hand() -> None:
    assert holm([0.01, 0.04, 0.03, NAN]) == pytest.approx([0.03, 0.06, 0.06, NAN], nan_ok=True)
    assert holm([0.6, 0.7]) == [1.0, 1.0]


@given(st.lists(st.lists(st.sampled_from([0.0, 1.0, 2.0, 3.0, NEVER, NAN]), min_size=3, max_size=3)))
def test_a_front_is_what_no_other_point_beats(points: list[list[float]]) -> None:
    array = np.reshape(points, (-1, 3))
    for point, on_front in zip(array, pareto(array), strict=True):
        better = [other for other in array if all(other <= point) and any(other < point)]
        assert on_front == (not better and not np.isnan(point).any())
