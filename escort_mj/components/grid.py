"""Velocities at the points of a grid: their table, how kernels have them, and what is between points."""

from __future__ import annotations

from itertools import chain, pairwise
from math import prod
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field, model_validator

from escort_mj.components.mission import axis_names
from escort_mj.components.parameters import Parameters
from escort_mj.native.fields import Array
from escort_mj.native.kernels import inlined
from escort_mj.native.lanes import everywhere, gather, least, pick, row_of, set_row, stack_rows, where
from escort_mj.native.vectors import Vec, rows_from


class Grid(Parameters):
    """Velocities at all points of a grid, and between them by linear interpolation."""

    largest: ClassVar[float] = 1e6

    time: tuple[float, ...] = ()
    """Times of the velocities, which hold before the first one and after the last one [s]; empty for a field
    that does not change."""
    points: Annotated[tuple[tuple[float, ...], ...], Field(min_length=2, max_length=9)]
    """Coordinates of the points along each axis [m]; they increase."""
    velocity: tuple[float, ...]
    """Velocities [m/s]: component by component, points along the last axis first, times last."""

    @property
    def counts(self) -> tuple[int, ...]:
        """How many times there are, and points along each axis."""
        return (max(len(self.time), 1), *map(len, self.points))

    @model_validator(mode="after")
    def _shaped(self) -> Grid:
        axes = len(self.points)
        for name, values in zip(("time", *axis_names(axes)), (self.time, *self.points), strict=True):
            if len(values) < 2 and name != "time":
                raise ValueError(f"{name}: found {len(values)} points; expected 2 or more")
            for one, other in pairwise(values):
                if one >= other:
                    raise ValueError(f"{name}: found {other:g} after {one:g}; expected increasing numbers")
        if len(self.velocity) != prod(self.counts) * axes:
            raise ValueError(
                f"velocity: found {len(self.velocity)} numbers; expected {prod(self.counts) * axes}, "
                f"{axes} at each of {' x '.join(map(str, self.counts[not self.time :]))} points"
            )
        return self


def grids_of(members: Any, axes: int) -> tuple[list[float], Array, dict[Any, tuple[int, int]]]:
    """Return the grids of members that have one, and where each begins in both arrays.

    Returns:
        Of each grid, the counts, then times and points; velocities of all points, shape (points, p).
    """
    coordinates, rows = list[float](), [np.zeros((0, axes))]
    places: dict[Any, tuple[int, int]] = {}
    for grid in filter(None, (getattr(each, "grid", None) for each in members)):
        if grid not in places:
            places[grid] = len(coordinates), sum(map(len, rows))
            coordinates += [*grid.counts, *(grid.time or (0.0,)), *chain(*grid.points)]
            rows.append(np.reshape(grid.velocity, (-1, axes)))
    return coordinates, np.concatenate(rows), places


@inlined
def interpolate(place: int, row: int, i: int, seen: Any) -> tuple[Vec, Any]:
    """Return the velocity at each of robots i to i + 7, and whether it is within the grid.

    Args:
        place: Where the grid begins in `grid_coordinates`.
        row: Where its velocities begin in `grid_velocity`.
        i: First robot.
        seen: A view with these, and with time and positions.
    """
    p, grid = seen.q.shape[1], seen.grid_coordinates
    cells, at = stack_rows(2 * p + 2), place + p + 1
    found, beyond = 0.0 * rows_from(seen, seen.grid_velocity, everywhere(float(row))), everywhere(0.0)
    for k in range(p + 1):
        count = int(grid[place + k])
        x = everywhere(seen.time[0]) if k == 0 else gather(seen.q, i * p + k - 1, p)
        cell = everywhere(0.0)
        for j in range(1, count - 1):
            cell = cell + where(x >= grid[at + j], 1.0, 0.0)
        low = pick(grid, float(at) + cell)
        width = pick(grid, least(float(at) + cell + 1.0, float(at + count - 1))) - low
        share = (x - low) / where(width > 0.0, width, 1.0)
        share = where(width > 0.0, where(share > 0.0, least(share, 1.0), 0.0), 0.0)
        if k > 0:
            beyond = where((x < grid[at]) | (x > grid[at + count - 1]), 1.0, beyond)
        set_row(cells, 2 * k, cell)
        set_row(cells, 2 * k + 1, share)
        at += count
    for corner in range(2**p * min(int(grid[place]), 2)):
        weight, point = everywhere(1.0), everywhere(0.0)
        for k in range(p + 1):
            share, upper = row_of(cells, 2 * k + 1), (corner >> (p if k == 0 else k - 1)) % 2
            weight = weight * (share if upper == 1 else 1.0 - share)
            point = point * grid[place + k] + row_of(cells, 2 * k) + float(upper)
        found = found + weight * rows_from(seen, seen.grid_velocity, float(row) + point)
    return found, beyond < 0.5
