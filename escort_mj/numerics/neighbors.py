"""Who may be nearest to whom: lists of candidates that hold for many steps, built in linear time.

As in a Verlet list (Phys. Rev. 159, 98, 1967), candidates are found once and hold while robots move little.
His have everybody within a cutoff; these have those that can come to be the nearest, however near or far that
is: while no distance between two robots changes by more than the skin, the nearest one to robot i is among

    j with d_ij <= min_j d_ij + 2 skin    (d at the time when the list was made),

so the lists stay short in a dense crowd and find some in a sparse one, and what is found among
candidates is what a look at all pairs would find. All of this holds center to center and surface to surface.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import DOUBLE, inlined, kernel, merged, stack_memory, vector_at
from escort_mj.native.lanes import (
    WIDTH,
    Lanes,
    any_of,
    everywhere,
    gather,
    greatest,
    largest,
    least,
    load,
    set_row,
    stack_rows,
    there,
    where,
)
from escort_mj.native.on_demand import on_demand
from escort_mj.numerics.cells import (
    CELL_OF,
    CELL_ROWS,
    NEAREST,
    ORDER,
    PLACE,
    RADIUS,
    SLOTS,
    SQUARES,
    cell_along,
    choose_cells,
    find_box,
    high_end,
    low_end,
    slots_of,
    sort_into_cells,
)
from escort_mj.plan import Plan, State

COUNT, FIRST = 0, 1  # places in a robot's row: how many candidates follow
ALL = -1.0  # in place of their number: more than a row holds, so all robots have to be looked at
SKIN, AGE, SPACING, LENGTH, WIDEST = range(5)  # places in the note of a set of lists
CORNER, RATE, COUNTS = 5, 8, 11  # of its grid
MOVED, MADE, NOTE = 14, 15, 16  # the last places, and the length of the note
REACH, FOR, AROUND = 1, 2, 3  # places in a robot's row of `around`, beside COUNT
SHORT, LONG = 24.0, 96.0  # steps that a set should hold
FULL = 8.0  # candidates, in the mean; more cost more than making the lists again
THINNEST, THICKEST = 0.05, 0.7  # skin, as a share of the spacing
ROUNDING = 1.000001
LISTED = 48  # robots from which on lists pay
NEIGHBORS = 32  # places in a robot's list: their number, and they
WIDER = 1.1  # times the distance that is asked for: what is found for the next steps as well


class NeighborState(Fields):
    """Lists of a crowd: by true positions, and by measured ones where those differ."""

    neighbors: Annotated[Array, "crowd", NEIGHBORS, Value("1", "number of candidates, then which robots")]
    neighbors_places: Annotated[Array, "crowd", "p", Value("m", "positions when the lists were made")]
    neighbors_note: Annotated[Array, NOTE, Value("m or 1", "see `keep_neighbors`")]
    seen_neighbors: Annotated[Array, "misled", NEIGHBORS, Value("1", "likewise, of measured positions")]
    seen_neighbors_places: Annotated[Array, "misled", "p", Value("m", "likewise")]
    seen_neighbors_note: Annotated[Array, NOTE, Value("m or 1", "likewise")]
    around: Annotated[Array, "avoiding", NEIGHBORS, Value("1", "see `find_near`")]
    cells: Annotated[Array, CELL_ROWS, "crowd", Value("1", "see `cells`")]
    seen_cells: Annotated[Array, CELL_ROWS, "misled", Value("1", "likewise, of measured positions")]


class Lists(NamedTuple):
    """A set of lists.

    Attributes:
        rows: One for each robot: number of candidates, and they in ascending order.
        places: Positions when the set was made, shape (n, p) [m].
        note: Its skin [m], how many steps it has held, the harmonic mean of the distances to
            the nearest when it was made [m], the mean number of candidates, the largest radius [m],
            the grid: its corner [m], cells per meter and number of cells, three each, the most by which a
            distance between two robots has changed since [m], and how many sets were made; shape (NOTE,).
        cells: The robots sorted by cells when the set was made, and how near others were to each: from center
            to center and from surface to surface [m], a little less; shape (CELL_ROWS, n).
    """

    rows: Array
    places: Array
    note: Array
    cells: Array


@inlined
def _true_lists(state: State) -> Lists:
    """Return the lists that belong to the true positions."""
    return Lists(state.neighbors, state.neighbors_places, state.neighbors_note, state.cells)


@inlined
def _seen_lists(state: State) -> Lists:
    """Return the lists that belong to the measured positions."""
    if state.seen_neighbors.shape[0] == 0:
        return _true_lists(state)
    return Lists(
        state.seen_neighbors, state.seen_neighbors_places, state.seen_neighbors_note, state.seen_cells
    )


@on_demand
def keep_all_neighbors(plan: Plan, state: State) -> None:
    """Keeps the lists of a crowd valid for the present step: by true positions, and by measured ones."""
    keep_neighbors(state.q, plan.robot_radius, _true_lists(state))
    if state.seen_neighbors.shape[0] > 0:
        keep_neighbors(state.q_measured, plan.robot_radius, _seen_lists(state))


@kernel
def keep_neighbors(points: Array, radius: Array, lists: Lists) -> None:
    """Keeps a set of lists valid for the present step: makes it again where robots have moved too far.

    Args:
        points: Positions of all robots, shape (n, p) [m].
        radius: Shape (n,) [m].
        lists: The set.
    """
    note = lists.note
    note[AGE] += 1.0
    note[MOVED] = _change(points, lists.places, note[SKIN])
    if not note[MOVED] < note[SKIN]:  # the skin is 0 at first
        _list_neighbors(points, radius, lists)


@merged
def seen_neighbors(state: State) -> Array:
    """Return the rows of the lists that belong to the measured positions; none in a small team."""
    return state.seen_neighbors if state.seen_neighbors.shape[0] > 0 else state.neighbors


@inlined
def find_near(i: int, distance: float, to_surface: float, radius: Array, state: State, found: Array) -> int:
    """Find the other robots within a distance of one, by measured positions.

    In a crowd, those that may come so near before lists are made again are kept in the robot's row of
    `around`: their number, the distance for which that is so, the set of lists that it is of, and they.

    Args:
        i: Which robot, from 0.
        distance: From its center [m].
        to_surface: 1 if the distance ends at surfaces, 0 at centers.
        radius: Shape (n,) [m].
        state: Gives positions and lists; `around` is written.
        found: Result: which robots, in ascending order.

    Returns:
        How many; `ALL` where there are more than `found` holds.
    """
    q, count = state.q_measured, 0
    if seen_neighbors(state).shape[0] == 0:
        for j in range(q.shape[0]):
            if j != i:
                count = _add_near(i, j, distance + to_surface * radius[j], q, found, count)
        return count if count <= found.shape[0] else int(ALL)
    lists = _seen_lists(state)
    row, note = state.around[i], lists.note
    bodies = to_surface * note[WIDEST]
    reach = ROUNDING * (distance + bodies + note[MOVED])
    if row[FOR] != note[MADE] or reach > row[REACH]:
        row[FOR], row[REACH] = note[MADE], ROUNDING * (WIDER * distance + bodies + note[SKIN])
        row[COUNT] = _search(i, row[REACH], row[REACH], 0.0, lists.places, lists, row[AROUND:])
    if row[COUNT] == ALL:
        return _search(i, reach, distance, to_surface, q, lists, found)
    for place in range(AROUND, AROUND + int(row[COUNT])):
        j = int(row[place])
        count = _add_near(i, j, distance + to_surface * radius[j], q, found, count)
    return count if count <= found.shape[0] else int(ALL)


@kernel
def _search(
    i: int, reach: float, distance: float, to_surface: float, q: Array, lists: Lists, found: Array
) -> int:
    """Finds the other robots within a distance of one among those that were within reach of it.

    Args:
        i: Which robot, from 0.
        reach: From its center, when the lists were made [m].
        distance: From its center [m].
        to_surface: 1 if the distance ends at surfaces, 0 at centers.
        q: Positions, shape (n, p) [m].
        lists: Those of them that belong to measured positions.
        found: Result: which robots, in ascending order.

    Returns:
        How many; `ALL` where there are more than `found` holds.
    """
    p, count, places, cells = q.shape[1], 0, lists.places, lists.cells
    corner, rate, counts = _grid(lists.note)
    block, hits = vector_at(stack_memory(), 6), stack_rows(1)
    for k in range(3):
        block[k], block[3 + k] = 0.0, 1.0
        if k < p:
            block[k] = cell_along(places[i, k] - reach, k, corner, rate, counts)
            block[3 + k] = 1 + cell_along(places[i, k] + reach, k, corner, rate, counts)
    for c in range(int(block[2]), int(block[5])):
        for b in range(int(block[1]), int(block[4])):
            begin, end = slots_of(b, c, int(block[0]), int(block[3]), counts, cells)
            for first in range(begin, end, WIDTH):
                square = everywhere(0.0)
                for k in range(min(p, 3)):
                    way = load(cells[PLACE + k], first) - places[i, k]
                    square = square + way * way
                hit = there(end - first) & (square < reach * reach)
                hit = hit & (abs(load(cells[ORDER], first) - float(i)) > 0.5)
                if not any_of(hit):
                    continue
                set_row(hits, 0, where(hit, 1.0, 0.0))
                for slot in range(first, min(first + WIDTH, end)):
                    if hits[0, slot - first] > 0.5:
                        look, j = distance + to_surface * cells[RADIUS, slot], int(cells[ORDER, slot])
                        count = _add_near(i, j, look, q, found, count)
    return count if count <= found.shape[0] else int(ALL)


@inlined
def empty_around(i: int, to_surface: float, state: State) -> Lanes:
    """Return a distance within which each of robots i to i + 7 has no other, by measured positions [m].

    It is what the lists say without a look at others: how near they were, less what may have changed since.

    Args:
        i: First robot, from 0.
        to_surface: 1 for distances between surfaces, 0 between centers.
        state: Gives lists of a crowd.
    """
    lists = _seen_lists(state)
    return load(lists.cells[NEAREST + int(to_surface)], i) - ROUNDING * lists.note[MOVED]


@inlined
def _add_near(i: int, j: int, reach: float, q: Array, found: Array, count: int) -> int:
    """Add robot j to those found, in ascending order, if it is within reach; return their number."""
    square = 0.0
    for k in range(q.shape[1]):
        square += (q[i, k] - q[j, k]) ** 2
    if square > reach * reach:
        return count
    place = count
    if place < found.shape[0]:
        while place > 0 and found[place - 1] > j:
            found[place] = found[place - 1]
            place -= 1
        found[place] = j
    return count + 1


@inlined
def _grid(note: Array) -> tuple[Array, Array, Array]:
    """Return the grid's corner [m], its cells per meter and their number along each axis, in a note."""
    return note[CORNER:RATE], note[RATE:COUNTS], note[COUNTS:NOTE]


@inlined
def number_of_candidates(i: int, n: int, lists: Array) -> int:
    """How many robots have to be looked at to find the one nearest to robot i."""
    return n if _looks_at_all(i, lists) else int(lists[i, COUNT])


@inlined
def candidate(i: int, c: int, lists: Array) -> int:
    """The robot in place c of those."""
    return c if _looks_at_all(i, lists) else int(lists[i, FIRST + c])


@inlined
def most_candidates(i: int, lists: Array) -> int:
    """Most candidates that one of robots i to i + 7 has; 0 where one of them has none, or looks at all."""
    most = 0.0
    for robot in range(i, min(i + WIDTH, lists.shape[0])):
        if lists[robot, COUNT] < 1.0:
            return 0
        most = max(most, lists[robot, COUNT])
    return int(most)


@inlined
def _looks_at_all(i: int, lists: Array) -> bool:
    return lists.shape[0] == 0 or lists[i, COUNT] == ALL


@merged
def _change(points: Array, places: Array, enough: float) -> float:
    """Return a length by which no distance between two robots can have changed [m].

    It changes by no more than the diagonal of the box of all ways gone, and by no more than twice the longest
    of them, as seen from the middle of that box. So a team may go anywhere together.

    Args:
        points: Positions now, shape (n, p) [m].
        places: Positions then, shape (n, p) [m].
        enough: No less is asked for than anything below this [m].
    """
    n, p = points.shape
    middle, diagonal = vector_at(stack_memory(), p), 0.0
    for k in range(p):
        low, high = everywhere(math.inf), everywhere(-math.inf)
        for i in range(0, n, WIDTH):
            way = gather(points, i * p + k, p) - gather(places, i * p + k, p)
            low, high = (
                least(low, where(there(n - i), way, low)),
                greatest(high, where(there(n - i), way, high)),
            )
        first, last = -largest(-low), largest(high)
        middle[k] = 0.5 * (first + last)
        diagonal += (last - first) * (last - first)
    if diagonal < enough * enough:
        return math.sqrt(diagonal)
    longest = everywhere(0.0)
    for i in range(0, n, WIDTH):
        square = everywhere(0.0)
        for k in range(p):
            way = gather(points, i * p + k, p) - gather(places, i * p + k, p) - middle[k]
            square = square + way * way
        longest = greatest(longest, where(there(n - i), square, 0.0))
    return 2.0 * math.sqrt(largest(longest))


@kernel
def _list_neighbors(points: Array, radius: Array, lists: Lists) -> None:
    """Makes a set of lists from scratch, with a grid of cells."""
    (n, p), (rows, places, note, cells) = points.shape, lists
    memory = stack_memory()
    width, here = vector_at(memory, 3), vector_at(memory + 3 * DOUBLE, 3)
    corner, rate, counts = _grid(note)
    find_box(points, corner, width)
    least = 1.5 * note[SPACING] + 2.0 * note[SKIN]
    size = choose_cells(n, least, width, rate, counts)
    sort_into_cells(points, radius, corner, rate, counts, cells)
    largest = 0.0
    for i in range(n):
        largest = max(largest, radius[i])
        for k in range(p):
            places[i, k] = points[i, k]
    if note[LENGTH] > FULL:
        note[SKIN] *= 0.7
    elif note[AGE] < SHORT:
        note[SKIN] = max(2.0 * note[SKIN], THINNEST * note[SPACING])
    elif note[AGE] > LONG:
        note[SKIN] *= 0.7
    note[SKIN] = min(note[SKIN], THICKEST * note[SPACING])
    total = length = 0.0
    for slot in range(n):
        nearest = _list_one(slot, largest, size, counts, here, points, lists)
        total += 1.0 / nearest if nearest > 0.0 else math.inf
    for i in range(n):
        length += rows[i, COUNT] if rows[i, COUNT] != ALL else rows.shape[1]
    note[SPACING], note[LENGTH] = n / total, length / n
    note[AGE], note[WIDEST], note[MOVED] = 0.0, largest, 0.0
    note[MADE] += 1.0


@inlined
def _list_one(
    slot: int, largest: float, size: float, counts: Array, here: Array, points: Array, lists: Lists
) -> float:
    """Lists the candidates of the robot in one slot, and notes how near the nearest are.

    Args:
        slot: Place in the order of cells.
        largest: Radius of the largest robot [m].
        size: Of a cell [m].
        counts: Cells along each axis, shape (3,).
        here: Scratch, shape (3,).
        points: Positions of all robots, shape (n, p) [m].
        lists: A row is written; `SQUARES` of the cells is scratch.

    Returns:
        Its distance to the nearest robot [m]; infinite where there is none.
    """
    cells, skin = lists.cells, lists.note[SKIN]
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
        wider = 2.0 * around if need == math.inf else max(need / size, float(around)) + 1.0
        around = int(wider) if wider < widest else widest  # also where it is too large for an integer
    square = (ROUNDING * distance + 2.0 * skin) ** 2
    nearest, clearance = clearance, clearance + 2.0 * skin
    row, found = lists.rows[i], 0
    for place in range(count):
        apart, other = cells[SQUARES, place], int(cells[SLOTS, place])
        reach = ROUNDING * max(clearance + own + cells[RADIUS, other], 0.0)
        if apart <= square or apart <= reach * reach:
            found += 1
            if found < row.shape[0]:
                _insert(row, found, order[other])
    row[COUNT] = found if found < row.shape[0] else ALL
    bodies = own + largest
    cells[NEAREST, i], cells[NEAREST + 1, i] = distance / ROUNDING, (nearest + bodies) / ROUNDING - bodies
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
    for c in range(low_end(here, 2, around), high_end(here, counts, 2, around)):
        for b in range(low_end(here, 1, around), high_end(here, counts, 1, around)):
            begin, end = slots_of(
                b, c, low_end(here, 0, around), high_end(here, counts, 0, around), counts, cells
            )
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
