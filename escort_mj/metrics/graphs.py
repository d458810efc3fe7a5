"""Graphs of a team: who hears whom where robots communicate, else who sees whom within a limited range."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from escort_mj.metrics.reading import lost
from escort_mj.record.recording import Recorded, lacks

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

DEAR = 2_000_000  # entries of the graphs of all samples: their eigenvalues take a second
CUT = 1e-9  # a smaller second eigenvalue is that of a graph in parts
BLOCK = 2**18  # entries at once


def takes_long(trace: Recorded) -> bool:
    """Whether there are too many robots and samples to look at all pairs of robots in every run."""
    return bool(trace.sizes["time"] * trace.sizes["robot"] ** 2 > DEAR)


def linked(heard: NDArray[Any]) -> Mask:
    """Who is linked with whom, because one of the two has heard the other, shape (..., robot, robot).

    Args:
        heard: The signal `heard_from` at some samples, shape (..., robot, slot).
    """
    n = heard.shape[-2]
    found = np.zeros((*heard.shape[:-1], n + 1), dtype=bool)
    np.put_along_axis(found, heard.astype(int), True, axis=-1)
    return np.asarray(found[..., 1:] | found[..., 1:].swapaxes(-1, -2))


def blocks(trace: Recorded) -> Iterator[slice]:
    """Yield stretches of samples, so short that numbers of all pairs of robots fit into memory."""
    count = trace.sizes["time"]
    step = max(1, BLOCK // trace.sizes["robot"] ** 2)
    for first in range(0, count, step):
        yield slice(first, min(first + step, count))


def pairs_of(count: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the two robots of each pair, from 0, shape (pairs,) each."""
    return np.triu_indices(count, 1)


def near_pairs(trace: Recorded, rows: slice, reach: Array) -> Mask:
    """Return which pairs of robots are nearer than a distance at some samples, shape (samples, pairs).

    Args:
        trace: A trace.
        rows: The samples.
        reach: Center to center, shape (pairs,) [m].
    """
    q, (first, second) = trace["q"].values[rows], pairs_of(trace.sizes["robot"])
    way = q[:, first] - q[:, second]
    return np.asarray(np.einsum("tpk,tpk->tp", way, way) < reach**2)


def sums_of_radii(trace: Recorded) -> Array:
    """Return the distance at which the robots of each pair touch, center to center, shape (pairs,) [m]."""
    radius = trace["robot_radius"].values
    first, second = pairs_of(len(radius))
    return np.asarray(radius[first] + radius[second])


def has_graph(trace: Recorded) -> bool:
    """Whether robots communicate, or see each other within a limited range."""
    return not lacks(trace, "heard_from") or "sensing_robots" in trace.attrs


def _graphs(trace: Recorded, rows: slice) -> Mask:
    """The graph at some samples, lost robots included, shape (samples, robot, robot)."""
    if not lacks(trace, "heard_from"):
        return linked(trace["heard_from"].values[rows])
    near = near_pairs(trace, rows, sums_of_radii(trace) + float(trace.attrs["sensing_robots"]))
    (first, second), n = pairs_of(trace.sizes["robot"]), trace.sizes["robot"]
    found = np.zeros((len(near), n, n), dtype=bool)
    found[:, first, second] = found[:, second, first] = near
    return found


def of_graphs(trace: Recorded, of: Callable[[Mask], float]) -> Array:
    """Return a number of each sample's graph of the robots that are left, shape (time,).

    Args:
        trace: Of a mission that has a graph.
        of: The number, of a matrix that says who is linked with whom; asked once for each graph in a row.
    """
    found = np.empty(trace.sizes["time"])
    for rows in blocks(trace):
        graphs, gone = _graphs(trace, rows), lost(trace)[rows]
        changes = (graphs[1:] != graphs[:-1]).any(axis=(1, 2)) | (gone[1:] != gone[:-1]).any(axis=1)
        first = np.flatnonzero(np.append(True, changes))  # a graph that was not there before
        values = [float(of(graphs[row][~gone[row]][:, ~gone[row]])) for row in first]
        found[rows] = np.repeat(values, np.diff(np.append(first, len(graphs))))
    return found


def components(left: Mask) -> int:
    """Number of connected components of a graph."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    return int(connected_components(csr_array(left), directed=False)[0]) if len(left) else 0


def algebraic_connectivity(left: Mask) -> float:
    """Second-smallest eigenvalue of a graph's Laplacian (Fiedler 1973); NaN of fewer than two robots."""
    if len(left) < 2:
        return math.nan
    graph = left.astype(float)
    found = float(np.linalg.eigvalsh(np.diag(graph.sum(axis=1)) - graph)[1])
    return found if found > CUT else 0.0
