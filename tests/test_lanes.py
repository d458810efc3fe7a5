"""Four numbers at once against NumPy: arithmetic, choices, whole and partial stores."""

import math

import numpy as np
import pytest

from escort_mj.compiler.declarations import jitted
from escort_mj.control.elementary import tanh
from escort_mj.lanes import (
    WIDTH,
    any_of,
    copysign,
    everywhere,
    gather,
    greatest,
    lane_numbers,
    least,
    load,
    pick,
    scatter,
    store,
    total,
    where,
)

ROOM = WIDTH - 1  # what may be read past an end


@jitted
def arithmetic(x, y, results):
    n = results.shape[1]
    for at in range(0, n, WIDTH):
        left, a, b = n - at, load(x, at), load(y, at)
        store(results[0], at, left, (2.0 * a + b * 3.0) / (1.0 - b) - a)
        store(results[1], at, left, math.sqrt(abs(-a)))
        store(results[2], at, left, where((a < b) & (a > 0.0), a, 7.0))
        store(results[3], at, left, least(a, greatest(b, 0.5)))
        store(results[4], at, left, copysign(a, b))
        store(results[5], at, left, tanh(a))
        store(results[6], at, left, where(lane_numbers() != 2.0, a, b))


@jitted
def rows(matrix, sums, columns, extremes):
    n, p = matrix.shape
    for at in range(0, n, WIDTH):
        square = everywhere(0.0)
        for k in range(p):
            x = gather(matrix, at * p + k, p)
            square = square + x * x
            scatter(columns, at * p + k, p, n - at, 2.0 * x)
        store(sums, at, n - at, square)
    first, last = pick(matrix, 0, p, 2 * p, 3 * p), load(sums, 0)
    extremes[0], extremes[1] = 1.0 if any_of(first > 1.0) else 0.0, total(last)


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 8, 11])
def test_lanes_compute_what_numpy_does(count: int) -> None:
    rng = np.random.default_rng(count)
    x, y = rng.normal(size=(2, count + ROOM)) * 3.0
    results = np.full((8, count), np.nan)
    arithmetic(x, y, results[:7])
    x, y = x[:count], y[:count]
    expected = [
        (2.0 * x + 3.0 * y) / (1.0 - y) - x,
        np.sqrt(np.abs(x)),
        np.where((x < y) & (x > 0.0), x, 7.0),
        np.minimum(x, np.maximum(y, 0.5)),
        np.copysign(x, y),
        np.tanh(x),
        np.where(np.arange(count) % WIDTH != 2, x, y),
    ]
    np.testing.assert_allclose(results[:7], expected, rtol=1e-12, atol=1e-15)
    assert np.isnan(results[7]).all(), "nothing is written past an end"


@pytest.mark.parametrize("axes", [2, 3])
@pytest.mark.parametrize("count", [4, 6, 9])
def test_lanes_of_rows(count: int, axes: int) -> None:
    rng = np.random.default_rng([count, axes])
    matrix = rng.normal(size=(count + ROOM, axes))
    sums, columns, extremes = np.zeros(count), np.zeros((count + 1, axes)), np.zeros(2)
    rows(matrix[:count], sums, columns[:count], extremes)
    matrix = matrix[:count]
    np.testing.assert_allclose(sums, (matrix**2).sum(axis=1), rtol=1e-14)
    np.testing.assert_array_equal(columns, np.vstack([2.0 * matrix, np.zeros(axes)]))
    assert extremes[0] == float((matrix[:4, 0] > 1.0).any())
    assert extremes[1] == pytest.approx(sums[:4].sum(), rel=1e-14)


def test_tanh_is_exact_to_rounding_and_sees_what_is_no_number() -> None:
    x = np.concatenate(
        [np.linspace(-25.0, 25.0, 10_000), np.geomspace(1e-300, 1.0, 400), [0.0, np.inf, np.nan]]
    )
    padded, results = np.append(x, np.zeros(ROOM)), np.zeros((7, len(x)))
    with np.errstate(all="ignore"):
        arithmetic(padded, padded, results)
    np.testing.assert_allclose(results[5], np.tanh(x), rtol=1e-15, atol=0.0)
