"""The formation of those that are left when robots drop out, and of all when they come back."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.components.parameters import Parameters
from escort_mj.control.setup import Setup
from escort_mj.failures import Dead
from escort_mj.numerics.thomson import even_figure, even_points

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

NEVER = Parameters.largest  # s
PREPARED = 4  # robots fewer for which even points in space are solved before the mission


class Figures(NamedTuple):
    """Who stands where.

    Attributes:
        predecessors: Of chords, shape (cycles, n).
        chord_length: Of chords [m].
        vertices: Unit vector of each robot's vertex, shape (n, p); no rows where robots keep none.
    """

    predecessors: NDArray[np.float64] | NDArray[np.int64]
    chord_length: float
    vertices: Array


def who_may_be_lost(setup: Setup) -> tuple[Dead, ...]:
    """Return failures that never happen: with them, a law has what it needs for robots that are lost.

    Even points of smaller teams are solved now, since in space that may take seconds.
    """
    if setup.figure is not None:
        sizes = [len(team.robots) for team in setup.teams] or [setup.count]
        for count in {size - lost for size in sizes for lost in range(PREPARED + 1) if size > lost}:
            even_points(count, setup.axes)
    return tuple(Dead(robot=robot + 1, at=NEVER) for robot in range(setup.count))


def regrouped(
    setup: Setup,
    figures: Figures,
    q: Array,
    centers: Array,
    members: NDArray[np.int64],
    before: Mask,
    lost: Mask,
) -> tuple[Figures, Mask]:
    """Return the formation of the robots that are left.

    Chords pass over lost robots; teams of which the members change get an even figure of those left. In
    space, a team that has lost more than `PREPARED` robots keeps its vertices.

    Args:
        setup: Gives the formation of the whole team.
        figures: The present one.
        q: Positions, shape (n, p) [m].
        centers: What each team escorts, shape (teams, p) [m].
        members: Team of each robot, from 0, shape (n,).
        before: Who was lost, shape (n,).
        lost: Who is lost, shape (n,); not all.

    Returns:
        The formation, and whose vertices are others, shape (n,).
    """
    predecessors, length = figures.predecessors, figures.chord_length
    if setup.arrangement is not None and setup.axes == 2:
        predecessors = np.array([_closed(ring, lost) for ring in setup.arrangement.predecessors])
        length = 2.0 * setup.radius * math.sin(math.pi / int((~lost).sum()))
    vertices, moved = figures.vertices.copy(), np.zeros(len(lost), dtype=bool)
    if setup.figure is not None:
        for team in {*members[before != lost].tolist()}:
            here = (members == team) & ~lost
            size = int((members == team).sum())
            if here.any() and (setup.axes == 2 or size - here.sum() <= PREPARED):
                vertices[here] = even_figure(q[here], centers[team]).vertices
                moved |= here
    return Figures(predecessors, length, vertices), moved


def _closed(ring: NDArray[np.int64], lost: Mask) -> NDArray[np.int64]:
    """Return who precedes whom in a ring that passes over lost robots, shape (n,)."""
    found = ring.copy()
    for robot in np.flatnonzero(~lost).tolist():
        while lost[found[robot]]:
            found[robot] = ring[found[robot]]
    return found
