"""Even formations for the chords behavior: who keeps which distance to whom (paper section 3.3.1, fig. 4)."""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

# Paper eq. 26: place j keeps its distance to place CYCLES[c][j]; (0,5), (1,3), (2,4) are opposite.
OCTAHEDRON_CYCLES = ((1, 4, 3, 0, 5, 2), (2, 5, 1, 4, 0, 3))
OCTAHEDRON = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, -1, 0], [0, 0, -1], [-1, 0, 0]], dtype=float)


class Arrangement(NamedTuple):
    """An even formation and the place of each robot in it.

    Attributes:
        order: Robot (from 0) at each place, shape (n,).
        predecessors: Robot that robot i keeps its distance to, one row per cycle, shape (cycles, n).
        length: Edge length to keep [m].
        pairs: Neighbors, each edge once, lower robot first, shape (edges, 2).
    """

    order: NDArray[np.int64]
    predecessors: NDArray[np.int64]
    length: float
    pairs: NDArray[np.int64]


def chords_exist(count: int, axes: int) -> bool:
    """Whether the chords behavior has an even arrangement for so many robots in so many axes."""
    return count >= 2 if axes == 2 else (axes == 3 and count == 6)


def spacing(count: int, axes: int, radius: float) -> float | None:
    """Distance between neighbors in the even formation [m]; None where chords has no arrangement.

    Args:
        count: Number of robots.
        axes: Dimension of the space.
        radius: Distance to the target [m].
    """
    if not chords_exist(count, axes):
        return None
    return 2.0 * radius * math.sin(math.pi / count) if axes == 2 else math.sqrt(2.0) * radius


def widest_spacing(count: int, axes: int, radius: float) -> float:
    """Distance [m] that nearest neighbors cannot exceed, whatever the formation; inf for a single robot.

    The polygon's edge in the plane; in space the bound of Fejes Toth (1943), attained by 3, 4, 6 and 12; in
    more axes that of Rankin (1955): the simplex's edge, and for more than p + 1 points that of the
    cross-polytope, attained up to 2 p.

    Args:
        count: Number of robots.
        axes: Dimension of the space.
        radius: Distance to the target [m].
    """
    if count < 2:
        return math.inf
    if axes == 2 or count == 2:
        return 2.0 * radius * math.sin(math.pi / count)
    if axes > 3:
        return radius * math.sqrt(2.0 * count / (count - 1) if count <= axes + 1 else 2.0)
    return radius * math.sqrt(4.0 - 1.0 / math.sin(math.pi * count / (6.0 * (count - 2))) ** 2)


def arrange(
    positions: NDArray[np.float64],
    center: NDArray[np.float64],
    radius: float,
    order: tuple[int, ...] | None = None,
) -> Arrangement:
    """Gives every robot its place: as given, or the places nearest to where the robots start.

    Args:
        positions: Initial positions, shape (n, p) [m].
        center: Initial position of the target, shape (p,) [m].
        radius: Distance to the target [m].
        order: Robot (from 1) at each place, or None.

    Raises:
        ValueError: If there is no arrangement for this n and p.
    """
    count, axes = positions.shape
    length = spacing(count, axes, radius)
    if length is None:
        raise ValueError(f"chords has no arrangement for {count} robots in {axes} axes")
    if order is not None:
        places = np.array(order, dtype=np.int64) - 1
    elif axes == 2:
        places = _ring_order(positions - center)
    else:
        places = _octahedron_order(positions - center)
    cycles = (tuple((j - 1) % count for j in range(count)),) if axes == 2 else OCTAHEDRON_CYCLES
    predecessors = np.empty((len(cycles), count), dtype=np.int64)
    for row, cycle in enumerate(cycles):
        predecessors[row, places] = places[list(cycle)]
    edges = {(min(i, j), max(i, j)) for row in predecessors.tolist() for i, j in enumerate(row)}
    return Arrangement(places, predecessors, length, np.array(sorted(edges), dtype=np.int64))


def _ring_order(offsets: NDArray[np.float64]) -> NDArray[np.int64]:
    """Robots counterclockwise around the target, beginning with the first robot."""
    around = np.argsort(np.arctan2(offsets[:, 1], offsets[:, 0]), kind="stable")
    return np.roll(around, -int(np.flatnonzero(around == 0)[0]))


def _octahedron_order(offsets: NDArray[np.float64]) -> NDArray[np.int64]:
    """Assignment to the octahedron that needs the least motion, over all rotations of it.

    The best rotation for an assignment aligns directions with vertices; its alignment is the nuclear
    norm of their correlation (orthogonal Procrustes), so the best assignment has the largest norm.
    """
    directions = offsets / np.maximum(np.linalg.norm(offsets, axis=1, keepdims=True), 1e-12)
    assignments = np.array(list(itertools.permutations(range(len(offsets)))))
    correlations = np.einsum("ja,kjb->kab", OCTAHEDRON, directions[assignments])
    alignment = np.linalg.svd(correlations, compute_uv=False).sum(axis=1)
    return assignments[int(np.argmax(np.round(alignment, 9)))].astype(np.int64)
