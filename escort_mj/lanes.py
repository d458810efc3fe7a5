"""Four numbers at once: a type for kernels whose arithmetic is the machine's SIMD arithmetic.

`load` takes four neighbors of a vector, `gather` one number of each of four rows; with these, kernels compute
as with floats, `where` in place of `if`, and `store` puts back as many as there are. The compiler's own
vectorizer needs to know that the arrays of a loop do not overlap, which nobody can tell it of views of one
memory; and short loops, those of a few robots, it leaves alone.

Numbers are read up to three past the end of an array: inside the state, whatever follows there.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from escort_mj.kernels import inlined, machine

Array = NDArray[np.float64]

WIDTH = 4
STACK_ROWS = 81  # nine axes by nine


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
    __float__: Callable[[], float]  # for math.sqrt
    __lt__: Callable[[Lanes, Lanes | float], Any]
    __gt__: Callable[[Lanes, Lanes | float], Any]
    __and__: Callable[[Lanes, Any], Any]


@machine
def copysign(size: Lanes, sign: Lanes) -> Any:
    """The magnitude of one with the sign of the other."""


@machine
def where(condition: Any, yes: Any, no: Any) -> Any:
    """Lane by lane: one thing where a condition holds, else the other."""


@machine
def least(x: Any, y: Any) -> Any:
    """The smaller of two, lane by lane; the second where one is no number."""


@machine
def greatest(x: Any, y: Any) -> Any:
    """The greater of two, lane by lane; the second where one is no number."""


@machine
def any_of(condition: Any) -> Any:
    """Whether a condition holds in some lane."""


@machine
def total(x: Lanes) -> Any:
    """Sum over the lanes."""


@machine
def largest(x: Lanes) -> Any:
    """Largest of the lanes."""


@machine
def everywhere(x: float) -> Any:
    """The same float in all lanes."""


@machine
def load(array: Array, at: int) -> Any:
    """Four numbers in a row of an array, as if it were flat."""


@machine
def gather(array: Array, at: int, stride: int) -> Any:
    """Four numbers of an array, as if it were flat, so far apart."""


@machine
def pick(array: Array, a: int, b: int, c: int, d: int) -> Any:
    """Four numbers of an array, as if it were flat, from anywhere."""


@machine
def lane_numbers() -> Any:
    """The numbers of the lanes, from 0."""


@machine
def store(array: Array, at: int, left: int, x: Any) -> Any:
    """Writes lanes to an array, as if it were flat: all four, or so many as are left."""


@machine
def scatter(array: Array, at: int, stride: int, left: int, x: Any) -> Any:
    """Writes lanes to an array so far apart: all four, or so many as are left."""


@machine
def two_to(shifted: Lanes) -> Any:
    """2**n for n + 1.5 * 2**52: that sum leaves n in the lowest bits, from where it moves to the exponent."""


@machine
def stack_rows(rows: int) -> Any:
    """Scratch of so many rows of four numbers, STACK_ROWS at most; nothing is in it yet.

    Each place that asks has memory of its own, whose address nobody else knows: the compiler keeps in
    registers what is read and written at places that it knows.
    """


@inlined
def row_of(rows: Array, k: int) -> Lanes:
    """A row of scratch."""
    row: Lanes = load(rows, WIDTH * k)
    return row


@inlined
def set_row(rows: Array, k: int, x: Lanes) -> None:
    """Writes a row of scratch."""
    store(rows, WIDTH * k, WIDTH, x)


@inlined
def four_from(at: int, count: int) -> int:
    """Where four of so many numbers begin: `at`, or earlier so that all four are there, if so many are.

    What is found for some twice is the same twice, as long as nothing is added up.
    """
    return max(min(at, count - WIDTH), 0)


@inlined
def copy_numbers(source: Array, target: Array, count: int) -> None:
    """Copies so many numbers from the beginning of one array to that of another, as if both were flat."""
    for begin in range(0, count, WIDTH):
        at = four_from(begin, count)
        store(target, at, count - at, load(source, at))
