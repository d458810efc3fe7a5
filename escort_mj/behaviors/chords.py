"""Scatter on chords (paper eq. 4): each robot keeps the formation's edge length to its predecessors."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import PositiveFloat

from escort_mj.behaviors.behavior import Behavior
from escort_mj.behaviors.wish import (
    MAX_DIRECTIONS,
    Wish,
    along,
    keep_distance,
    look_at_others,
)
from escort_mj.components.setup import MissionSetup
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.lanes import everywhere, root, row_of, set_row, stack_rows
from escort_mj.plan import Plan, State


class ChordParameters(Fields):
    """The formation of all robots; no cycles where no behavior asks for them."""

    predecessors: Annotated[Array, "cycles", "n", Value("1", "robot before each in a cycle, from 0")]
    chord_length: Annotated[float, Value("m", "distance to keep from it")]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        arrangement = setup.arrangement
        return {
            "predecessors": arrangement.predecessors if arrangement else np.zeros((0, setup.count)),
            "chord_length": arrangement.length if arrangement else 0.0,
        }


class ChordState(Fields):
    """The formation of the robots that are left."""

    predecessors: Annotated[Array, "cycles", "n", Value("1", "past lost robots after a loss")]
    chord_length: Annotated[Array, 1, Value("m", "of a smaller ring after a loss")]


class Chords(Behavior):
    """Spread the robots evenly with equal chords: over a ring in the plane, six on an octahedron in space."""

    spreads: ClassVar[bool] = True
    python_only: ClassVar[frozenset[str]] = frozenset({"behavior", "order"})

    behavior: Literal["chords"] = "chords"
    gain: PositiveFloat = 0.8
    """Gain of the task error [1/s] (paper: Lambda_2)."""
    order: tuple[int, ...] | None = None
    """Order of the robots (from 1) along the formation; null: determined from their initial positions."""

    def wish_lanes(self, i: int, plan: Plan, state: State, x: Array, wish: Array, at: int) -> Wish:
        """Return eq. 4 of each cycle: sigma = |q_i - q_j|^2 / 2, j before i, is to become length^2 / 2."""
        p, length = state.q.shape[1], state.chord_length[0]
        look_at_others(i, state.q_measured, state.predecessors[0], x, 0)
        weight, error = keep_distance(p, length, self.gain, x, 0, wish, at)
        if state.predecessors.shape[0] < MAX_DIRECTIONS:
            return along(weight, everywhere(1.0), abs(error))
        other = stack_rows(p)
        look_at_others(i, state.q_measured, state.predecessors[1], x, p)
        second, further = keep_distance(p, length, self.gain, x, p, other, 0)
        for k in range(p):
            set_row(wish, at + k, row_of(wish, at + k) + row_of(other, k))
        both = root(0.5 * (error * error + further * further))
        return Wish(MAX_DIRECTIONS, weight, second, everywhere(0.0), everywhere(1.0), both)
