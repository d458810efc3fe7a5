"""A grid of cells that finds who is near a point: robots sorted by cell, in time linear in their number.

Its scratch is one matrix, a row for each thing that is kept per robot or slot. A slot is a place in the order
of cells; robots of cells that are neighbors along the first axis have slots in a row.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from escort_mj.native.kernels import flat, inlined, merged

Array = NDArray[np.float64]

DEVIATIONS, TRIMMED = 2.5, 3  # robots so far from the mean, taken so often, count to the outermost cells
CELLS = 3.0  # per robot, at most
# Rows of the scratch; two are of NEAREST, three of PLACE, and all from CELL_FIRST on are one.
CELL_OF, ORDER, RADIUS, SQUARES, SLOTS, NEAREST, PLACE, CELL_FIRST, CELL_ROWS = 0, 1, 2, 3, 4, 5, 7, 10, 14


@inlined
def find_box(points: Array, corner: Array, width: Array) -> None:
    """The box that the grid divides: around the robots, but not for the sake of a few that are far out."""
    n, p = points.shape
    for k in range(3):
        corner[k] = width[k] = 0.0
    for k in range(min(p, 3)):
        low, high = -math.inf, math.inf
        for _ in range(TRIMMED):
            least, most, mean, square, inside = math.inf, -math.inf, 0.0, 0.0, 0.0
            for i in range(n):
                x = points[i, k]
                if low <= x <= high:
                    least, most = min(least, x), max(most, x)
                    mean += x
                    inside += 1.0
            mean /= inside
            for i in range(n):
                if low <= points[i, k] <= high:
                    square += (points[i, k] - mean) ** 2
            reach = DEVIATIONS * math.sqrt(square / inside)
            low, high = max(least, mean - reach), min(most, mean + reach)
        corner[k], width[k] = low, high - low


@inlined
def choose_cells(n: int, least: float, width: Array, rate: Array, counts: Array) -> float:
    """Divides the box into at most 3 n cells, nearly cubes; axes shorter than a cell are left whole.

    Args:
        n: Number of robots.
        least: Side of a cell that suffices [m].
        width: Of the box, shape (3,) [m].
        rate: Result: cells per meter along each axis.
        counts: Result: cells along each axis.

    Returns:
        A length that no side of a divided axis is below [m].
    """
    size = 0.0
    for _ in range(3):
        volume, axes = 1.0, 0
        for k in range(3):
            if size < width[k] < math.inf:
                volume *= width[k]
                axes += 1
        if axes > 0:
            size = max((volume / (CELLS * n)) ** (1.0 / axes), least)
    for k in range(3):
        divided = 0.0 < size < width[k] < math.inf
        counts[k] = float(int(width[k] / size)) if divided else 1.0
        rate[k] = counts[k] / width[k] if divided else 0.0
    return size


@inlined
def sort_into_cells(
    points: Array, radius: Array, corner: Array, rate: Array, counts: Array, cells: Array
) -> None:
    """Sorts the robots by their cells (counting sort): into the rows of `cells`."""
    n, p = points.shape
    first, cell_of, order = cell_ends(cells), cells[CELL_OF], cells[ORDER]
    total = int(counts[0] * counts[1] * counts[2])
    for cell in range(total + 1):
        first[cell] = 0.0
    for i in range(n):
        place, stride = 0, 1
        for k in range(min(p, 3)):
            place += stride * cell_along(points[i, k], k, corner, rate, counts)
            stride *= int(counts[k])
        cell_of[i] = place
        first[place] += 1.0
    end = float(n)
    for back in range(total):
        cell = total - 1 - back
        end -= first[cell]
        first[cell] = end
    for i in range(n):  # `first` runs on to the end of each cell: that of the next one's begin
        cell = int(cell_of[i])
        slot = int(first[cell])
        first[cell] += 1.0
        order[slot] = i
        cells[RADIUS, slot] = radius[i]
        for k in range(p):
            if k < 3:
                cells[PLACE + k, slot] = points[i, k]
    for back in range(total):
        cell = total - back
        first[cell] = first[cell - 1]
    first[0] = 0.0


@inlined
def cell_along(x: float, axis: int, corner: Array, rate: Array, counts: Array) -> int:
    """Return in which cell along an axis a coordinate lies; what is outside the box is in the outermost."""
    x = (x - corner[axis]) * rate[axis]
    return int(min(x, counts[axis] - 1.0)) if x > 0.0 else 0  # no number counts as 0, too


@merged
def cell_ends(cells: Array) -> Array:
    """First slot of each cell, and last the number of robots: the rows of the scratch from CELL_FIRST on."""
    return flat(cells[CELL_FIRST:])


@inlined
def low_end(here: Array, axis: int, around: int) -> int:
    """First cell of a block along an axis."""
    return max(int(here[axis]) - around, 0)


@inlined
def high_end(here: Array, counts: Array, axis: int, around: int) -> int:
    """One past the last cell of a block along an axis."""
    return min(int(here[axis]) + around + 1, int(counts[axis]))


@inlined
def slots_of(b: int, c: int, first: int, end: int, counts: Array, cells: Array) -> tuple[int, int]:
    """First slot, and one past the last, of cells `first` to `end - 1` in a row of the grid: neighbors."""
    row = (c * int(counts[1]) + b) * int(counts[0])
    ends = cell_ends(cells)
    return int(ends[row + first]), int(ends[row + end])
