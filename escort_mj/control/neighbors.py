"""Who may be nearest to whom: lists of candidates that hold for many steps, built in linear time.

As in a Verlet list (Phys. Rev. 159, 98, 1967), candidates are found once and hold while robots move little.
His have everybody within a cutoff; these have whoever can come to be the nearest, however near or far that
is: while no distance between two robots changes by more than the skin, the nearest one to robot i is among

    j with d_ij <= min_j d_ij + 2 skin    (d at the time when the list was made),

so the lists stay short in a dense crowd and find somebody in a sparse one, and what is found among
candidates is what a look at all pairs would find. All of this holds center to center and surface to surface.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from escort_mj.kernels import DOUBLE, inlined, kernel, merged, stack_memory, vector_at
from escort_mj.on_demand import on_demand

if TYPE_CHECKING:
    from escort_mj.control.plan import Plan, State

Array = NDArray[np.float64]

COUNT, FIRST = 0, 1  # places in a robot's row: how many candidates follow
ALL = -1.0  # in place of their number: more than a row holds, so all robots have to be looked at
SKIN, AGE, SPACING = range(3)  # places in the note of a set of lists
SHORT, LONG = 24.0, 96.0  # steps that a set should hold
THINNEST, THICKEST = 0.01, 0.4  # skin, as a share of the spacing
ROUNDING = 1.000001
DEVIATIONS, TRIMMED = 2.5, 3  # robots so far from the mean, taken so often, count to the outermost cells
CELLS = 3.0  # per robot, at most
# Rows of the scratch; three are of PLACE, and all from CELL_FIRST on are one.
CELL_OF, ORDER, RADIUS, SQUARES, SLOTS, PLACE, CELL_FIRST, CELL_ROWS = 0, 1, 2, 3, 4, 5, 8, 12


@on_demand
def keep_all_neighbors(plan: Plan, state: State) -> None:
    """Keeps the lists for true positions, and those for measured ones where they differ."""
    keep_neighbors(
        state.q, plan.robot_radius, state.neighbors, state.neighbors_places, state.neighbors_note,
        state.cells,
    )  # fmt: skip
    if state.seen_neighbors.shape[0] > 0:
        keep_neighbors(
            state.q_measured, plan.robot_radius, state.seen_neighbors, state.seen_neighbors_places,
            state.seen_neighbors_note, state.cells,
        )  # fmt: skip


@merged
def keep_neighbors(
    points: Array, radius: Array, lists: Array, places: Array, note: Array, cells: Array
) -> None:
    """Keeps a set of lists valid for the present step: makes it anew where robots have moved too far.

    Args:
        points: Positions of all robots, shape (n, p) [m].
        radius: Shape (n,) [m].
        lists: The set, a row per robot: number of candidates, and they in ascending order.
        places: Positions when the set was made, shape (n, p) [m].
        note: Its skin [m], how many steps it has held, and the harmonic mean of the distances to the nearest
            when it was made [m].
        cells: Scratch, shape (CELL_ROWS, n).
    """
    note[AGE] += 1.0
    if not _holds(points, places, note[SKIN]):  # the skin is 0 at first
        _list_neighbors(points, radius, lists, places, note, cells)


@merged
def seen_neighbors(state: State) -> Array:
    """The lists that belong to the measured positions; of no rows in a small team."""
    return state.seen_neighbors if state.seen_neighbors.shape[0] > 0 else state.neighbors


@inlined
def number_of_candidates(i: int, n: int, lists: Array) -> int:
    """How many robots have to be looked at to find the one nearest to robot i."""
    return n if _looks_at_all(i, lists) else int(lists[i, COUNT])


@inlined
def candidate(i: int, c: int, lists: Array) -> int:
    """The robot in place c of those."""
    return c if _looks_at_all(i, lists) else int(lists[i, FIRST + c])


@inlined
def _looks_at_all(i: int, lists: Array) -> bool:
    return lists.shape[0] == 0 or lists[i, COUNT] == ALL


@merged
def _holds(points: Array, places: Array, skin: float) -> bool:
    """Whether no distance between two robots can have changed by as much as the skin.

    It changes by no more than the diagonal of the box of all ways gone, and by no more than twice the longest
    of them, as seen from the middle of that box. So a team may go anywhere together.

    Args:
        points: Positions now, shape (n, p) [m].
        places: Positions then, shape (n, p) [m].
        skin: [m].
    """
    n, p = points.shape
    middle, diagonal = vector_at(stack_memory(), p), 0.0
    for k in range(p):
        least, most = math.inf, -math.inf
        for i in range(n):
            way = points[i, k] - places[i, k]
            least, most = min(least, way), max(most, way)
        middle[k] = 0.5 * (least + most)
        diagonal += (most - least) * (most - least)
    if diagonal < skin * skin:
        return True
    longest = 0.0
    for i in range(n):
        square = 0.0
        for k in range(p):
            way = points[i, k] - places[i, k] - middle[k]
            square += way * way
        longest = max(longest, square)
    return 4.0 * longest < skin * skin


@kernel
def _list_neighbors(
    points: Array, radius: Array, lists: Array, places: Array, note: Array, cells: Array
) -> None:
    """Makes a set of lists from scratch, with a grid of cells."""
    n, p = points.shape
    memory = stack_memory()
    corner, width, rate = (
        vector_at(memory, 3),
        vector_at(memory + 3 * DOUBLE, 3),
        vector_at(memory + 6 * DOUBLE, 3),
    )
    counts, here = vector_at(memory + 9 * DOUBLE, 3), vector_at(memory + 12 * DOUBLE, 3)
    _find_box(points, corner, width)
    least = 1.5 * note[SPACING] + 2.0 * note[SKIN]
    size = _choose_cells(n, least, width, rate, counts)
    _sort_into_cells(points, radius, corner, rate, counts, cells)
    largest = 0.0
    for i in range(n):
        largest = max(largest, radius[i])
        for k in range(p):
            places[i, k] = points[i, k]
    if note[AGE] < SHORT:
        note[SKIN] = max(1.5 * note[SKIN], THINNEST * note[SPACING])
    elif note[AGE] > LONG:
        note[SKIN] *= 0.75
    note[SKIN] = min(note[SKIN], THICKEST * note[SPACING])
    total = 0.0
    for slot in range(n):
        total += 1.0 / _list_one(slot, note[SKIN], largest, size, counts, here, lists, points, cells)
    note[SPACING] = n / total
    note[AGE] = 0.0


@inlined
def _find_box(points: Array, corner: Array, width: Array) -> None:
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
def _choose_cells(n: int, least: float, width: Array, rate: Array, counts: Array) -> float:
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
def _sort_into_cells(
    points: Array, radius: Array, corner: Array, rate: Array, counts: Array, cells: Array
) -> None:
    """Sorts the robots by their cells (counting sort): into the rows of `cells`."""
    n, p = points.shape
    first, cell_of, order = _cell_ends(cells), cells[CELL_OF], cells[ORDER]
    total = int(counts[0] * counts[1] * counts[2])
    for cell in range(total + 1):
        first[cell] = 0.0
    for i in range(n):
        place, stride = 0, 1
        for k in range(min(p, 3)):
            x, last = (points[i, k] - corner[k]) * rate[k], counts[k] - 1.0
            inside = int(min(x, last)) if x > 0.0 else 0  # no number counts as 0, too
            place += stride * inside
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


@merged
def _cell_ends(cells: Array) -> Array:
    """First slot of each cell, and last the number of robots: the rows of the scratch from CELL_FIRST on."""
    return cells[CELL_FIRST:].reshape(-1)


@inlined
def _list_one(
    slot: int, skin: float, largest: float, size: float, counts: Array, here: Array, lists: Array,
    points: Array, cells: Array,
) -> float:  # fmt: skip
    """Lists the candidates of the robot in one slot.

    Args:
        slot: Place in the order of cells.
        skin: [m].
        largest: Radius of the largest robot [m].
        size: Of a cell [m].
        counts: Cells along each axis, shape (3,).
        here: Scratch, shape (3,).
        lists: A row is written.
        points: Positions of all robots, shape (n, p) [m].
        cells: See `_sort_into_cells`; `SQUARES` is scratch.

    Returns:
        Its distance to the nearest robot [m]; infinite where there is none.
    """
    order, own = cells[ORDER], cells[RADIUS, slot]
    i = int(order[slot])
    cell, widest = int(cells[CELL_OF, i]), 0
    for k in range(3):
        here[k] = cell % int(counts[k])
        cell //= int(counts[k])
        widest = max(widest, int(counts[k]) - 1)
    around = 1
    while True:
        count, square, clearance = _list_block(slot, around, counts, here, points, cells)
        distance = math.sqrt(square)
        need = ROUNDING * (max(distance, clearance + own + largest) + 2.0 * skin)
        if around >= widest or need <= around * size:
            break
        around = min(2 * around if need == math.inf else int(need / size) + 1, widest)
    square = (ROUNDING * distance + 2.0 * skin) ** 2
    clearance += 2.0 * skin
    row, found = lists[i], 0
    for place in range(count):
        apart, other = cells[SQUARES, place], int(cells[SLOTS, place])
        reach = ROUNDING * max(clearance + own + cells[RADIUS, other], 0.0)
        if apart <= square or apart <= reach * reach:
            found += 1
            if found < row.shape[0]:
                _insert(row, found, order[other])
    row[COUNT] = found if found < row.shape[0] else ALL
    return distance


@inlined
def _insert(row: Array, count: int, robot: float) -> None:
    """Inserts a robot among `count - 1` others, in ascending order."""
    place = count
    while place > FIRST and row[place - 1] > robot:
        row[place] = row[place - 1]
        place -= 1
    row[place] = robot


@inlined
def _low(here: Array, axis: int, around: int) -> int:
    """First cell of a block along an axis."""
    return max(int(here[axis]) - around, 0)


@inlined
def _high(here: Array, counts: Array, axis: int, around: int) -> int:
    """One past the last cell of a block along an axis."""
    return min(int(here[axis]) + around + 1, int(counts[axis]))


@inlined
def _run(b: int, c: int, around: int, counts: Array, here: Array, cells: Array) -> tuple[int, int]:
    """First slot, and one past the last, of a block's cells in one row of the grid: they are neighbors."""
    row = (c * int(counts[1]) + b) * int(counts[0])
    first = _cell_ends(cells)
    return int(first[row + _low(here, 0, around)]), int(first[row + _high(here, counts, 0, around)])


@inlined
def _list_block(
    slot: int, around: int, counts: Array, here: Array, points: Array, cells: Array
) -> tuple[int, float, float]:
    """Finds the other robots in the block of cells around one: their slots and squared distances.

    Returns:
        How many there are, the least squared distance [m^2] and the least clearance [m].
    """
    own, count = cells[RADIUS, slot], 0
    x, y, z = cells[PLACE, slot], cells[PLACE + 1, slot], cells[PLACE + 2, slot]
    nearest = clearance = math.inf
    for c in range(_low(here, 2, around), _high(here, counts, 2, around)):
        for b in range(_low(here, 1, around), _high(here, counts, 1, around)):
            begin, end = _run(b, c, around, counts, here, cells)
            for other in range(begin, end):
                apart = (
                    (x - cells[PLACE, other]) ** 2
                    + (y - cells[PLACE + 1, other]) ** 2
                    + (z - cells[PLACE + 2, other]) ** 2
                )
                for k in range(3, points.shape[1]):
                    i, j = int(cells[ORDER, slot]), int(cells[ORDER, other])
                    apart += (points[i, k] - points[j, k]) ** 2
                if other == slot:
                    continue
                cells[SQUARES, count], cells[SLOTS, count] = apart, other
                count += 1
                nearest = min(nearest, apart)
                bodies = own + cells[RADIUS, other]
                reach = max(clearance + bodies, 0.0)
                if apart < reach * reach:
                    clearance = math.sqrt(apart) - bodies
    return count, nearest, clearance
