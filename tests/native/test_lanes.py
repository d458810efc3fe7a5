"""Eight numbers at once against NumPy: arithmetic, choices, columns of matrices."""

import numpy as np
import pytest

from escort_mj.native.compiler.declarations import jitted
from escort_mj.native.lanes import (
    WIDTH,
    any_of,
    copy_in,
    copy_lanes,
    copy_numbers,
    copysign,
    everywhere,
    gather,
    greatest,
    lane_numbers,
    least,
    load,
    load_rows,
    pick,
    room_for,
    root,
    row_of,
    scatter,
    set_row,
    stack_rows,
    store,
    total,
    where,
)
from escort_mj.numerics.elementary import arc_cosine, tanh


@jitted
def arithmetic(x, y, results):
    n = results.shape[1]
    for at in range(0, n, WIDTH):
        a, b = load(x, at), load(y, at)
        store(results[0], at, (2.0 * a + b * 3.0) / (1.0 - b) - a)
        store(results[1], at, root(abs(-a)))
        store(results[2], at, where((a < b) & (a > 0.0), a, 7.0))
        store(results[3], at, least(a, greatest(b, 0.5)))
        store(results[4], at, copysign(a, b))
        store(results[5], at, tanh(a))
        store(results[6], at, where(lane_numbers() != 2.0, a, b))


@jitted
def roots(x, cosines, squares):
    for at in range(0, len(x), WIDTH):
        store(cosines, at, arc_cosine(load(x, at)))
        store(squares, at, root(load(x, at)))


@jitted
def rows(matrix, sums, columns, extremes):
    n, p = matrix.shape
    for at in range(0, n, WIDTH):
        square = everywhere(0.0)
        for k in range(p):
            x = gather(matrix, at * p + k, p)
            square = square + x * x
            scatter(columns, at * p + k, p, 2.0 * x)
        store(sums, at, square)
    first, last = pick(matrix, (lane_numbers() + 1.0) * float(p)), load(sums, 0)
    extremes[0], extremes[1] = 1.0 if any_of(first > 1.0) else 0.0, total(last)


@jitted
def copies(source, exact, whole, padded, count):
    copy_numbers(source, exact, count)
    copy_lanes(source, whole, count)
    copy_in(source, padded, count)


@jitted
def weave(matrix, columns, sums):
    n, p = matrix.shape
    x = stack_rows(p)
    for at in range(0, n, WIDTH):
        load_rows(matrix, at, x)
        square = everywhere(0.0)
        for k in range(p):
            square = square + row_of(x, k) * row_of(x, k)
            set_row(x, k, 2.0 * row_of(x, k))
        store(sums, at, square)
        for k in range(p):
            scatter(columns, at * p + k, p, row_of(x, k))


@pytest.mark.parametrize("count", [1, 7, 8, 9, 20])
def test_lanes_compute_what_numpy_does(count: int) -> None:
    rng, room = np.random.default_rng(count), room_for(count)
    x, y = rng.normal(size=(2, room)) * 3.0
    results = np.full((8, room), np.nan)
    arithmetic(x, y, results[:7])
    expected = [
        (2.0 * x + 3.0 * y) / (1.0 - y) - x,
        np.sqrt(np.abs(x)),
        np.where((x < y) & (x > 0.0), x, 7.0),
        np.minimum(x, np.maximum(y, 0.5)),
        np.copysign(x, y),
        np.tanh(x),
        np.where(np.arange(room) % WIDTH != 2, x, y),
    ]
    np.testing.assert_allclose(results[:7], expected, rtol=1e-12, atol=1e-15)
    assert np.isnan(results[7]).all(), "nothing is written past whole lanes"


@pytest.mark.parametrize("axes", [2, 3, 5])
@pytest.mark.parametrize("count", [4, 8, 9, 17])
def test_lanes_of_rows(count: int, axes: int) -> None:
    rng, room = np.random.default_rng([count, axes]), room_for(count)
    matrix = rng.normal(size=(room + WIDTH, axes))
    expected = (matrix[:room] ** 2).sum(axis=1)
    sums, columns, extremes = np.zeros(room), np.zeros((room + 1, axes)), np.zeros(2)
    rows(matrix[:room], sums, columns[:room], extremes)
    np.testing.assert_allclose(sums, expected, rtol=1e-14)
    np.testing.assert_array_equal(columns, np.vstack([2.0 * matrix[:room], np.zeros(axes)]))
    assert extremes[0] == float((matrix[1 : WIDTH + 1, 0] > 1.0).any())
    assert extremes[1] == pytest.approx(sums[:WIDTH].sum(), rel=1e-14)

    woven, squares = np.zeros((room + 1, axes)), np.zeros(room)
    weave(matrix[:room], woven[:room], squares)
    np.testing.assert_array_equal(woven, columns)
    np.testing.assert_allclose(squares, expected, rtol=1e-14)


@pytest.mark.parametrize("count", [0, 1, 7, 8, 13, 16])
def test_copies_end_where_they_should(count: int) -> None:
    source, room = np.arange(1.0, 25.0), room_for(count)
    exact, whole, padded = np.zeros((3, 24))
    copies(source, exact, whole, padded, count)
    np.testing.assert_array_equal(exact, np.where(np.arange(24) < count, source, 0.0))
    np.testing.assert_array_equal(whole, np.where(np.arange(24) < room, source, 0.0))
    np.testing.assert_array_equal(padded, exact)


def test_tanh_is_exact_to_rounding_and_sees_what_is_no_number() -> None:
    x = np.concatenate(
        [np.linspace(-25.0, 25.0, 10_000), np.geomspace(1e-300, 1.0, 400), [0.0, np.inf, np.nan]]
    )
    padded = np.append(x, np.zeros(room_for(len(x)) - len(x)))
    results = np.zeros((7, len(padded)))
    with np.errstate(all="ignore"):
        arithmetic(padded, padded, results)
    np.testing.assert_allclose(results[5, : len(x)], np.tanh(x), rtol=1e-15, atol=0.0)


def test_the_arc_cosine_is_exact_to_rounding() -> None:
    x = np.concatenate([np.linspace(0.0, 1.0, 10_001), 1.0 - np.geomspace(1e-16, 0.1, 999)])
    cosines, squares = np.empty((2, len(x)))
    roots(x, cosines, squares)
    np.testing.assert_allclose(cosines, np.arccos(x), rtol=4e-16, atol=0.0)
    np.testing.assert_array_equal(squares, np.sqrt(x))
