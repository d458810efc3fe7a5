"""Vectors of eight robots at once, p lanes as one value, or of one body, p numbers; and their arithmetic.

Compiled, a `Vec` lives in registers as p lanes or numbers do; interpreted, it is what stands here. Where
kernels do not know p when they are compiled, a vector has room for MOST_AXES and carries its p along.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from escort_mj.native.kernels import flat, inlined
from escort_mj.native.lanes import WIDTH, Lanes, everywhere, gather, load, pick, root, scatter, store
from escort_mj.native.lanes import where as where_lanes

Array = NDArray[np.float64]

MOST_AXES = 9


class Vec:
    """A vector for each of eight robots, or of any number: components are lanes, arrays or numbers.

    Args:
        parts: Its components.
    """

    __array_ufunc__ = None  # NumPy leaves arithmetic with vectors to them

    def __init__(self, parts: tuple[Any, ...]) -> None:
        self.parts = parts

    def __add__(self, other: Vec) -> Vec:
        return Vec(tuple(x + y for x, y in zip(self.parts, _vector(other).parts, strict=True)))

    def __sub__(self, other: Vec) -> Vec:
        return Vec(tuple(x - y for x, y in zip(self.parts, _vector(other).parts, strict=True)))

    def __mul__(self, factor: Any) -> Vec:
        return Vec(tuple(_number(factor) * x for x in self.parts))

    __rmul__ = __mul__

    def __truediv__(self, divisor: Any) -> Vec:
        return Vec(tuple(x / _number(divisor) for x in self.parts))

    def __neg__(self) -> Vec:
        return Vec(tuple(-x for x in self.parts))

    def __getitem__(self, axis: int) -> Any:
        return self.parts[axis]

    def __len__(self) -> int:
        return len(self.parts)

    def __iter__(self) -> Iterator[Any]:
        return iter(self.parts)


def _vector(value: Any) -> Vec:
    if not isinstance(value, Vec):
        raise TypeError(
            f"found {type(value).__name__}; a vector is added to and subtracted from vectors only"
        )
    return value


def _number(value: Any) -> Any:
    if isinstance(value, Vec):
        raise TypeError("a vector is multiplied and divided by numbers only; dot(x, y) is the product of two")
    return value


def dot(x: Vec, y: Vec) -> Any:
    """Scalar product of two vectors."""
    return sum((a * b for a, b in zip(x, y, strict=True)), start=0.0)


@inlined
def norm(x: Vec) -> Any:
    """Length of a vector."""
    return root(dot(x, x))


def where(condition: Any, yes: Any, no: Any) -> Any:
    """Robot by robot: one thing where a condition holds, else the other; vectors, or numbers for all axes."""
    if not isinstance(yes, Vec) and not isinstance(no, Vec):
        return where_lanes(condition, yes, no)
    count = len(yes if isinstance(yes, Vec) else no)
    sides = [side.parts if isinstance(side, Vec) else (side,) * count for side in (yes, no)]
    return Vec(tuple(where_lanes(condition, *pair) for pair in zip(*sides, strict=True)))


def quarter_turn(x: Vec) -> Vec:
    """Turn a vector by 90 degrees in the plane of the first two axes, and leave out the others."""
    return Vec((-x[1], x[0], *(0.0 * part for part in x.parts[2:])))


def turned(x: Vec, first: int) -> Vec:
    """Turn a vector by 90 degrees in planes of two axes each, from the first one on.

    Args:
        x: The vector.
        first: 0 or 1, a literal; the other axis of an odd number of them has no partner, and becomes 0.
    """
    parts = [0.0 * part for part in x]
    for k in range(first, len(x) - 1, 2):
        parts[k], parts[k + 1] = -x[k + 1], x[k]
    return Vec(tuple(parts))


def unit_axis(x: Vec, axis: int) -> Vec:
    """Unit vector along an axis, with as many axes as another vector; -1 is the last axis."""
    one = everywhere(1.0) if np.ndim(x[0]) else np.float64(1.0)
    return Vec(tuple(one if k == axis % len(x) else 0.0 * one for k in range(len(x))))


def of_numbers(x: Vec, first: float, second: float, third: float) -> Vec:
    """Vector of numbers, with as many axes as another vector of numbers: three at most are not 0."""
    numbers = np.zeros(max(len(x), 3))
    numbers[:3] = first, second, third
    return Vec(tuple(numbers[: len(x)]))


@inlined
def unit_of(x: Vec) -> tuple[Vec, Any]:
    """Return the unit vector along another, the first axis where that has length 0, and that length."""
    length = norm(x)
    return where(length > 0.0, x / where(length > 0.0, length, 1.0), unit_axis(x, 0)), length


@inlined
def zero_like(x: Vec) -> Vec:
    """Return the zero vector with as many axes as another vector of numbers."""
    return of_numbers(x, 0.0, 0.0, 0.0)


# How vectors and memory meet. The first argument, a view of the state, says how many axes there are; of
# vectors of numbers, another vector may do so.


def rows_at(state: Any, matrix: Array, i: int) -> Vec:
    """Rows i to i + 7 of a matrix with a column for each axis."""
    p = matrix.shape[-1]
    return Vec(tuple(gather(matrix, i * p + k, p) for k in range(p)))


def one_row(state: Any, vector: Array) -> Vec:
    """The same vector for all robots; shape (p,)."""
    return Vec(tuple(everywhere(number) for number in vector))


def numbers_from(state: Any, array: Array, at: int) -> Vec:
    """A vector of numbers, which lie in a row from a place on, as if the array were flat."""
    axes = len(state) if isinstance(state, Vec) else state.q.shape[1]
    return Vec(tuple(flat(array)[at : at + axes]))


@inlined
def numbers_at(state: Any, matrix: Array, i: int) -> Vec:
    """Row i of a matrix with a column for each axis, as a vector of numbers."""
    return numbers_from(state, matrix, i * matrix.shape[-1])


def set_numbers(array: Array, at: int, x: Any) -> None:
    """Write a vector of numbers, or one number, in a row from a place on, as if the array were flat."""
    numbers = x.parts if isinstance(x, Vec) else (x,)
    flat(array)[at : at + len(numbers)] = numbers


@inlined
def set_numbers_at(matrix: Array, i: int, x: Vec) -> None:
    """Write a vector of numbers in row i of a matrix with a column for each axis."""
    set_numbers(matrix, i * matrix.shape[-1], x)


def rows_from(state: Any, matrix: Array, rows: Lanes) -> Vec:
    """Rows of a matrix with a column for each axis, from anywhere: `rows` are whole floats."""
    p = matrix.shape[-1]
    return Vec(tuple(pick(matrix, float(p) * rows + float(k)) for k in range(p)))


def set_rows(matrix: Array, i: int, x: Vec) -> None:
    """Write rows i to i + 7 of a matrix with a column for each axis."""
    p = matrix.shape[-1]
    for k in range(p):
        scatter(matrix, i * p + k, p, x[k])


def part_at(state: Any, scratch: Array, at: int) -> Vec:
    """A vector that lies in rows of scratch, p of them from one on, see `lanes.stack_rows`."""
    return Vec(tuple(load(scratch, WIDTH * (at + k)) for k in range(state.q.shape[1])))


def set_part(scratch: Array, at: int, x: Vec) -> None:
    """Write a vector to rows of scratch, from one on."""
    for k, part in enumerate(x):
        store(flat(scratch), WIDTH * (at + k), part)
