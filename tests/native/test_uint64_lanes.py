"""Whole numbers at once against Python's own: arithmetic modulo 2^64, products, bits as doubles."""

import numpy as np
import pytest

from escort_mj.native.compiler.declarations import jitted
from escort_mj.native.kernels import high_product
from escort_mj.native.lanes import WIDTH, store
from escort_mj.native.uint64_lanes import double_of, words_from

MASK = 2**64 - 1
EDGES = (0, 1, 2, 2**32 - 1, 2**32, 2**32 + 1, 2**63, MASK - 2 * WIDTH, MASK - 1, MASK)


@jitted
def arithmetic(a: np.ndarray, b: np.ndarray, results: np.ndarray) -> None:
    """Of as many words in a row from a and from b, and of lanes with the single word b; bits as doubles."""
    x, y, one = words_from(a[0]), words_from(b[0]), b[0]
    store(results[0], 0, double_of(x + y))
    store(results[1], 0, double_of(x - y))
    store(results[2], 0, double_of(x * y))
    store(results[3], 0, double_of(high_product(x, y)))
    store(results[4], 0, double_of(x ^ y))
    store(results[5], 0, double_of(x & y))
    store(results[6], 0, double_of(x | y))
    store(results[7], 0, double_of(x << np.uint64(20)))
    store(results[8], 0, double_of(x >> np.uint64(63)))
    store(results[9], 0, double_of(high_product(one, x)))
    store(results[10], 0, double_of(one - x))
    results[11, 0] = double_of(high_product(a[0], b[0]))


@pytest.mark.parametrize("a", EDGES + (0x0123456789ABCDEF, 0xFEDCBA9876543210))
@pytest.mark.parametrize("b", EDGES + (0xD2E7470EE14C6C93,))
def test_words_compute_what_python_does(a: int, b: int) -> None:
    results = np.zeros((12, WIDTH))
    arithmetic(np.array([a], dtype=np.uint64), np.array([b], dtype=np.uint64), results)
    rows = [((a + lane) & MASK, (b + lane) & MASK) for lane in range(WIDTH)]
    expected = [
        (x + y, x - y, x * y, x * y >> 64, x ^ y, x & y, x | y, x << 20, x >> 63, b * x >> 64, b - x)
        for x, y in rows
    ]
    told = np.array([[value & MASK for value in row] for row in expected], dtype=np.uint64).T
    np.testing.assert_array_equal(results[:11].view(np.uint64), told)
    assert results[11].view(np.uint64)[0] == a * b >> 64


def test_the_double_with_some_bits() -> None:
    results, number = np.zeros((12, WIDTH)), np.array([-1.25])
    arithmetic(number.view(np.uint64), np.zeros(1, dtype=np.uint64), results)
    assert results[6, 0] == number[0]
