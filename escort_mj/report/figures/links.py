"""Who is left at a time, and who is whose neighbor or hears whom then."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from escort_mj.metrics.graphs import linked
from escort_mj.metrics.reading import lost
from escort_mj.numerics.thomson import nearest_edges
from escort_mj.palette import LOST
from escort_mj.record.recording import Recorded
from escort_mj.report.figures.drawing.style import Key

MOST_LINKED = 200  # robots of a formation that is found again


def links(trace: Recorded) -> list[tuple[int, NDArray[np.int64]]]:
    """The formation's neighbors: from which sample on, and pairs of robots from 0, shape (edges, 2).

    A loss ends a formation, and so does a robot that changes over to another team. The next is what those
    that are left stand in before the next such event, or the end.
    """
    gone = lost(trace)
    count = gone.sum(axis=1)
    team = trace["member_of"].values if "member_of" in trace else np.zeros(gone.shape, dtype=np.int8)
    changed = (gone[1:] != gone[:-1]) | (team[1:] != team[:-1])
    first = [0, *(np.flatnonzero(changed.any(axis=1)) + 1).tolist()]
    formations = []
    for start, end in zip(first, [*first[1:], len(gone)], strict=True):
        if (not count[start] and (team[start] == team[0]).all()) or not len(trace["neighbors"].values):
            pairs = trace["neighbors"].values.astype(np.int64) - 1
        elif len(gone[start]) - count[start] > MOST_LINKED:
            pairs = np.zeros((0, 2), dtype=np.int64)
        else:
            together = [np.flatnonzero(~gone[start] & (team[start] == one)) for one in np.unique(team[start])]
            q = trace["q"].values[end - 1]
            pairs = np.concatenate([left[nearest_edges(q[left])[0]] for left in together if len(left) > 1])
        formations.append((start, pairs))
    return formations


def links_at(formations: list[tuple[int, NDArray[np.int64]]], sample: int) -> NDArray[np.int64]:
    """Neighbors at a sample, shape (edges, 2)."""
    return next(pairs for start, pairs in reversed(formations) if start <= sample)


def heard_links(heard: NDArray[Any], gone: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Pairs of robots of which one hears the other at a sample, shape (edges, 2).

    Args:
        heard: The signal `heard_from` there, shape (n, slots).
        gone: Which robots are lost, shape (n,).
    """
    return np.argwhere(np.triu(linked(heard)) & ~gone & ~gone[:, None])


def lost_keys(trace: Recorded) -> list[Key]:
    """Legend entry of lost robots, where there are any."""
    if not lost(trace).any():
        return []
    return [("lost", Line2D([], [], color=LOST, linewidth=0.8, marker="x", markersize=5))]
