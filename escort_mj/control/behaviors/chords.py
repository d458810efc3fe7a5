"""Scatter on chords (paper eq. 4): each robot keeps the formation's edge length to its predecessors."""

from __future__ import annotations

from typing import Literal

from pydantic import PositiveFloat

from escort_mj.control.parameters import Parameters


class Chords(Parameters):
    """Spreads the robots evenly: a ring in the plane, an octahedron of six robots in space."""

    behavior: Literal["chords"] = "chords"
    gain: PositiveFloat = 0.8
    """Gain of the task's error [1/s] (paper: Lambda_2)."""
    order: tuple[int, ...] | None = None
    """Robots (from 1) in their order along the formation; null: from their initial positions."""
