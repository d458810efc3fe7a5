"""Eight numbers at once: a type for kernels whose arithmetic is the machine's SIMD arithmetic.

`load` takes eight neighbors of a vector, `gather` one number of each of eight rows; with these, kernels
compute as with floats, `where` in place of `if`, and `store` puts all back. The compiler's own vectorizer
needs to know that the arrays of a loop do not overlap, which views of one memory cannot say; and
short loops, those of a few robots, it leaves alone.

Lanes past the last number or robot compute too; arrays have room for what comes of it (see `memory`). What a
processor has just stored it hands at once to a load of the same eight numbers; a load that takes some of them
and some of others has to wait until all are written. So all begin at multiples of eight.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from escort_mj.native.kernels import DOUBLE, flat, inlined, vector_at

Array = NDArray[np.float64]

WIDTH = 8
STACK_ROWS = 144  # eight tasks of two directions in nine axes


class Lanes:
    """The type as annotations name it."""

    __add__: Callable[[Lanes, Lanes | float], Lanes]
    __radd__: Callable[[Lanes, float], Lanes]
    __sub__: Callable[[Lanes, Lanes | float], Lanes]
    __rsub__: Callable[[Lanes, float], Lanes]
    __mul__: Callable[[Lanes, Lanes | float], Lanes]
    __rmul__: Callable[[Lanes, float], Lanes]
    __truediv__: Callable[[Lanes, Lanes | float], Lanes]
    __rtruediv__: Callable[[Lanes, float], Lanes]
    __neg__: Callable[[Lanes], Lanes]
    __abs__: Callable[[], Lanes]
    __lt__: Callable[[Lanes, Lanes | float], Any]
    __gt__: Callable[[Lanes, Lanes | float], Any]
    __and__: Callable[[Lanes, Any], Any]


# Compiled, each of these is a few SIMD instructions, which `compiler` says; interpreted, lanes are arrays of
# eight doubles, and places past an array's end are read and written where they lie, as the machine does.


def _numbers(array: Array, at: int, count: int) -> Array:
    """So many numbers of an array, as if it were flat, where they lie."""
    return vector_at(array.ctypes.data + DOUBLE * int(at), int(count))


def copysign(size: Any, sign: Any) -> Any:
    """The magnitude of one with the sign of the other."""
    return np.copysign(size, sign)


def root(x: Any) -> Any:
    """Square root, of lanes or of one number; not a number below 0."""
    return np.sqrt(x)


def where(condition: Any, yes: Any, no: Any) -> Any:
    """Lane by lane: one thing where a condition holds, else the other."""
    return np.where(condition, yes, no)[()]


def least(x: Any, y: Any) -> Any:
    """The smaller of two, lane by lane; the second where one is no number."""
    return np.where(np.less(x, y), x, y)[()]


def greatest(x: Any, y: Any) -> Any:
    """The greater of two, lane by lane; the second where one is no number."""
    return np.where(np.greater(x, y), x, y)[()]


def any_of(condition: Any) -> Any:
    """Whether a condition holds in some lane."""
    return bool(np.any(condition))


def total(x: Any) -> Any:
    """Sum over the lanes."""
    pairs = x
    while len(pairs) > 1:  # in the order in which the machine adds
        pairs = pairs[::2] + pairs[1::2]
    return pairs[0]


def largest(x: Any) -> Any:
    """Largest of the lanes."""
    return np.max(x)


def everywhere(x: Any) -> Any:
    """The same float in all lanes; what are lanes already stay so."""
    return np.full(WIDTH, x, dtype=float) if np.ndim(x) == 0 else x


def load(array: Array, at: int) -> Any:
    """Numbers in a row of an array, as if it were flat."""
    return _numbers(array, at, WIDTH).copy()


def gather(array: Array, at: int, stride: int) -> Any:
    """Numbers of an array, as if it were flat, so far apart."""
    return _numbers(array, at, stride * (WIDTH - 1) + 1)[::stride].copy()


def pick(array: Array, places: Any) -> Any:
    """Numbers of an array, as if it were flat, from anywhere: places are whole floats."""
    return np.array([_numbers(array, int(place), 1)[0] for place in places])


def lane_numbers() -> Any:
    """The numbers of the lanes, from 0."""
    return np.arange(WIDTH, dtype=float)


def store(array: Array, at: int, x: Any) -> Any:
    """Writes lanes to an array, as if it were flat; complex numbers and texts are an error."""
    np.copyto(_numbers(array, at, WIDTH), x)


def scatter(array: Array, at: int, stride: int, x: Any) -> Any:
    """Writes lanes to an array, as if it were flat, so far apart; as `store`."""
    np.copyto(_numbers(array, at, stride * (WIDTH - 1) + 1)[::stride], x)


def load_pairs(array: Array, at: int) -> Any:
    """Numbers in a row of an array, as if it were flat: x of eight pairs (x, y), and y."""
    return tuple(_numbers(array, at, 2 * WIDTH).reshape(WIDTH, 2).T.copy())


def load_triples(array: Array, at: int) -> Any:
    """Numbers in a row of an array, as if it were flat: x of eight triples (x, y, z), and y, and z."""
    return tuple(_numbers(array, at, 3 * WIDTH).reshape(WIDTH, 3).T.copy())


def two_to(shifted: Any) -> Any:
    """2**n for n + 1.5 * 2**52: that sum leaves n in the lowest bits, from where it moves to the exponent."""
    return np.ldexp(1.0, (shifted - 1.5 * 2.0**52).astype(int))


def stack_rows(rows: int) -> Any:
    """Scratch of so many rows of lanes, STACK_ROWS at most; nothing is in it yet.

    Each place that asks has memory of its own, whose address nothing else knows: the compiler keeps in
    registers what is read and written at places that it knows.
    """
    return np.zeros((rows, WIDTH))


def room_for(count: int) -> int:
    """The least number of whole lanes that hold so many numbers, times their width."""
    return -(-count // WIDTH) * WIDTH


@inlined
def row_of(rows: Array, k: int) -> Lanes:
    """A row of scratch."""
    row: Lanes = load(rows, WIDTH * k)
    return row


@inlined
def set_row(rows: Array, k: int, x: Lanes) -> None:
    """Writes a row of scratch."""
    store(rows, WIDTH * k, x)


@inlined
def load_rows(array: Array, i: int, rows: Array) -> None:
    """Reads rows i to i + 7 of a matrix, one column to each row of scratch."""
    p = rows.shape[0]
    if p == 2:
        x, y = load_pairs(array, 2 * i)
        set_row(rows, 0, x)
        set_row(rows, 1, y)
    elif p == 3:
        x, y, z = load_triples(array, 3 * i)
        set_row(rows, 0, x)
        set_row(rows, 1, y)
        set_row(rows, 2, z)
    else:
        for k in range(p):
            set_row(rows, k, gather(array, i * p + k, p))


@inlined
def there(left: int) -> Any:
    """Which lanes stand for something, where so many are left."""
    return lane_numbers() < float(left)


@inlined
def copy_lanes(source: Array, target: Array, count: int) -> None:
    """Copies so many numbers, and what follows in whole lanes, from one array to another, both as if flat."""
    for at in range(0, count, WIDTH):
        store(target, at, load(source, at))


@inlined
def copy_numbers(source: Array, target: Array, count: int) -> None:
    """Copies so many numbers and no more from one array to another, both as if flat."""
    whole = count - count % WIDTH
    copy_lanes(source, target, whole)
    for at in range(whole, count):
        flat(target)[at] = flat(source)[at]


@inlined
def copy_in(source: Array, target: Array, count: int) -> None:
    """Copies so many numbers to an array that has whole lanes; what follows there becomes 0."""
    for at in range(0, count, WIDTH):
        store(target, at, where(there(count - at), load(source, at), 0.0))
