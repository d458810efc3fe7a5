"""Spread to the vertices of the even figure (paper remark 1), each robot to its own, for any n and any p.

The figure is turned to fit the robots at every step, so that no key says where it points: only the
tangential distance to the own vertex is a task. It is orthogonal to the surface task by construction, which
is the paper's condition for tasks without conflict (eq. 19).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import PositiveFloat

from escort_mj.behaviors.behavior import Behavior
from escort_mj.behaviors.robots import Robots
from escort_mj.behaviors.task import Task, across, speed_error, without
from escort_mj.components.facts import Facts, Misfit
from escort_mj.components.setup import MissionSetup
from escort_mj.knowledge.auction import know_vertices
from escort_mj.knowledge.belief import target_place
from escort_mj.knowledge.teammates import know_teammates
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import DOUBLE, inlined, matrix_at, merged, stack_memory, vector_at
from escort_mj.native.lanes import (
    WIDTH,
    everywhere,
    load,
    load_rows,
    root,
    row_of,
    set_row,
    stack_rows,
    there,
    total,
    where,
)
from escort_mj.native.vectors import set_numbers
from escort_mj.plan import Plan, State


class VertexParameters(Fields):
    """The even figure of all robots; no vertices where no behavior asks for them."""

    vertices: Annotated[Array, "vertices", "p", Value("1", "unit vector of each robot's vertex")]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        return {"vertices": setup.figure.vertices if setup.figure else np.zeros((0, setup.axes))}


class VertexState(Fields):
    """The even figure of the robots that are left, and how it is turned."""

    vertices: Annotated[Array, "vertices", "p", Value("1", "likewise, of fewer robots after a loss")]
    rotation: Annotated[Array, "turned", "p", "p", Value("1", "that turns the figure to fit the robots")]


class Vertices(Behavior):
    """Spread any number of robots evenly, over the vertices of the formation of lowest Coulomb energy."""

    spreads: ClassVar[bool] = True
    uses_vertices: ClassVar[bool] = True

    behavior: Literal["vertices"] = "vertices"
    gain: PositiveFloat = 0.8
    """Gain of the tangential distance to the vertex [1/s]."""
    assignment: Literal["nearest", "auction"] = "nearest"
    """How vertices are assigned to robots: before the mission, from all initial positions (`nearest`), or by
    the robots themselves, which exchange bids (`auction`)."""

    python_only: ClassVar[frozenset[str]] = frozenset({"assignment"})

    def misfits(self, mission: Facts) -> Iterator[Misfit]:
        """Yield figures that the team cannot form, and bids that nobody hears."""
        if mission.teams and self.bids:
            words = "assigns the vertices of one formation of all robots; with teams expected nearest"
            yield Misfit(words, "", (("teams",),))
        elif not mission.teams and self.bids and not mission.heard:
            words = "found auction without communication, by which robots bid; expected nearest"
            yield Misfit(words, "assignment")
        if not mission.teams and mission.known_by and mission.failures:
            words = "the team re-forms as one, but each robot has a figure of its own; expected repulsion"
            yield Misfit(words, "", (("robots", "failures"), (mission.known_by,)))

    @property
    def bids(self) -> bool:
        """Whether robots bid for their vertices."""
        return self.assignment == "auction"

    def task(self, r: Robots) -> Task:
        """Return the task across the way to the target: toward the robot's vertex, R u_i - (q_i - c)."""
        x = r.q - r.target
        velocity = without(x, self.gain * (r.radius * r.vertex - x))
        return across(x, velocity, speed_error(velocity, self.gain))


@merged
def turn_figures(plan: Plan, state: State) -> None:
    """One step of the rotation that fits the figure to the robots: the team's, or each robot's own.

    A robot with a figure of its own fits it to those robots that it knows of, when it has learned of some,
    and by as much of the way as they are of the team: the less it knows, the more it agrees with others.
    """
    for robot in range(state.rotation.shape[0]):
        q, missing, center = state.q_measured, state.lost, vector_at(stack_memory(), state.q.shape[1])
        set_numbers(center, 0, target_place(robot, plan, state))
        share, vertices = 1.0, state.vertices
        if plan.apart:
            if state.team_news[robot] == 0.0 or state.lost[robot] != 0.0:
                continue
            know_teammates(robot, plan, state)
            q, missing = state.mate_position, state.mate_unknown
            if plan.auctioned:
                know_vertices(robot, plan, state)
                vertices = state.mate_vertex
            known, left = 0.0, 0.0
            for j in range(q.shape[0]):
                known += 1.0 - missing[j]
                if plan.team_radius.shape[0] == 0 or state.member_of[j] == state.member_of[robot]:
                    left += 1.0 - state.lost[j]
            share = known / left if plan.estimating else 1.0  # a team knows all of its members
        turn_figure(q, center, missing, vertices, share, state.rotation[robot])


@inlined
def turn_figure(q: Array, center: Array, lost: Array, vertices: Array, share: float, rotation: Array) -> None:
    """One step of the rotation that fits the figure to the robots, from the step before.

    With H the correlation of robots and vertices and M = H R^T, R is best where M is symmetric; a skew step
    (M - M^T) / tr M brings it there, and one Newton-Schulz step keeps R a rotation. The skew step is at most
    1 rad, which the Newton-Schulz step can take.

    Args:
        q: Measured positions, shape (n, p) [m].
        center: Position of the target, shape (p,) [m].
        lost: 1 for robots that do not count, shape (n,).
        vertices: Unit vector of each robot's vertex in the figure's own frame, shape (n, p).
        share: Of the way to go.
        rotation: R, shape (p, p); changed in place.
    """
    p = q.shape[1]
    memory = stack_memory()
    m, old = matrix_at(memory, p, p), matrix_at(memory + DOUBLE * p * p, p, p)
    _correlate(q, center, lost, vertices, old)
    for a in range(p):
        for b in range(p):
            m[a, b] = 0.0
            for c in range(p):
                m[a, b] += old[a, c] * rotation[b, c]
    for a in range(p):
        for b in range(p):
            old[a, b] = rotation[a, b]
    trace = 0.0
    for a in range(p):
        trace += m[a, a]
    if trace <= 0.0:
        return
    skew = 0.0
    for a in range(p):
        for b in range(a):
            skew += (m[a, b] - m[b, a]) * (m[a, b] - m[b, a])
    scale = max(trace, math.sqrt(skew))
    for a in range(p):
        for b in range(p):
            total = 0.0
            for c in range(p):
                total += (m[a, c] - m[c, a]) * old[c, b]
            rotation[a, b] = old[a, b] + share * total / scale
    for a in range(p):
        for b in range(p):
            total = 0.0
            for c in range(p):
                total += rotation[c, a] * rotation[c, b]
            m[a, b] = (3.0 if a == b else 0.0) - total
            old[a, b] = rotation[a, b]
    for a in range(p):
        for b in range(p):
            total = 0.0
            for c in range(p):
                total += old[a, c] * m[c, b]
            rotation[a, b] = 0.5 * total


@inlined
def _correlate(q: Array, center: Array, lost: Array, vertices: Array, h: Array) -> None:
    """Correlation H of where robots and vertices are, as seen from the target; eight robots at once.

    Args:
        q: As for `turn_figure`, and so are the next three.
        center: Position of the target.
        lost: 1 for robots that do not count.
        vertices: Unit vectors.
        h: Result, shape (p, p).
    """
    n, p = q.shape
    way, vertex, sums = stack_rows(p), stack_rows(p), stack_rows(p * p)
    for entry in range(p * p):
        set_row(sums, entry, everywhere(0.0))
    for i in range(0, n, WIDTH):
        square, counts = everywhere(0.0), there(n - i) & (load(lost, i) < 0.5)
        load_rows(q, i, way)
        load_rows(vertices, i, vertex)
        for a in range(p):
            set_row(way, a, where(counts, row_of(way, a) - center[a], 0.0))
            square = square + row_of(way, a) * row_of(way, a)
        inverse = where(square > 0.0, 1.0 / root(square), 0.0)
        for b in range(p):
            part = where(counts, inverse * row_of(vertex, b), 0.0)
            for a in range(p):
                set_row(sums, a * p + b, row_of(sums, a * p + b) + row_of(way, a) * part)
    for a in range(p):
        for b in range(p):
            h[a, b] = total(row_of(sums, a * p + b))
