"""Vectors that depend on time: the target's path and the disturbance, with exact velocities."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from escort_mj.numerics.program import INSTRUCTION_SIZE, SEGMENT_SIZE, Op
from escort_mj.scenario.schema.expressions import Expression
from escort_mj.scenario.schema.nodes import Array, Dual
from escort_mj.scenario.schema.obstacle_tables import Motion, Waypoint
from escort_mj.scenario.schema.scenario import Scenario


@dataclass(frozen=True, eq=False)
class Piecewise:
    """A piecewise cubic function of time; before its first piece it rests at that piece's start.

    Attributes:
        segments: Start time, then the coefficients of (t - start)^0 .. (t - start)^3, shape (segments, 5).
    """

    segments: Array

    def evaluate(self, t: float | Array) -> Dual:
        """Value and exact time derivative at t [s], each of t's shape."""
        start = self.segments[:, 0]
        index = np.maximum(np.searchsorted(start, t, side="right") - 1, 0)
        h = np.asarray(t, dtype=np.float64) - start[index]
        c0, c1, c2, c3 = self.segments[index, 1:].T
        started = h >= 0.0
        value = np.where(started, c0 + h * (c1 + h * (c2 + h * c3)), c0)
        return value, np.where(started, c1 + h * (2.0 * c2 + h * 3.0 * c3), 0.0)


@dataclass(frozen=True)
class Sum:
    """A sum of functions of time.

    Attributes:
        terms: What is added; at least one.
    """

    terms: tuple[Expression, ...]

    def evaluate(self, t: float | Array) -> Dual:
        """Value and exact time derivative at t [s], each of t's shape."""
        values, rates = zip(*(term.evaluate(t) for term in self.terms), strict=True)
        return sum(values), sum(rates)

    def instructions(self) -> list[tuple[float, float, float]]:
        """Instructions for the compiled stack machine."""
        code: list[tuple[float, float, float]] = [*self.terms[0].instructions()]
        for term in self.terms[1:]:
            code += [*term.instructions(), (Op.ADD, 0.0, 0.0)]
        return code


@dataclass(frozen=True)
class Trajectory:
    """One function of time per axis.

    Attributes:
        components: The functions, p of them.
    """

    components: tuple[Expression | Piecewise | Sum, ...]

    def position(self, t: float | Array) -> Array:
        """Value at t [s], shape (p,) for one time or (len(t), p) for many."""
        return np.stack([component.evaluate(t)[0] for component in self.components], axis=-1)

    def velocity(self, t: float | Array) -> Array:
        """Exact time derivative at t [s], shape as for `position`."""
        return np.stack([component.evaluate(t)[1] for component in self.components], axis=-1)

    def programs(self) -> tuple[Array, NDArray[np.int64], Array]:
        """The same functions for the compiled stack machine (`control.program`).

        Returns:
            Instructions of all axes, shape (instructions, 3); first row and number of rows of each axis,
            shape (p, 2); segments of the piecewise cubics, shape (segments, 5).
        """
        code: list[tuple[float, float, float]] = []
        spans: list[tuple[int, int]] = []
        tables: list[Array] = [np.empty((0, SEGMENT_SIZE))]
        for component in self.components:
            first = len(code)
            if isinstance(component, Piecewise):
                code.append((Op.PIECEWISE, sum(map(len, tables)), len(component.segments)))
                tables.append(component.segments)
            else:
                code.extend(component.instructions())
            spans.append((first, len(code) - first))
        return (
            np.array(code, dtype=np.float64).reshape(-1, INSTRUCTION_SIZE),
            np.array(spans, dtype=np.int64).reshape(-1, 2),
            np.concatenate(tables),
        )


def trajectory(motion: Motion, axes: int) -> Trajectory:
    """Where a body is to be [m]; its velocity is the exact derivative [m/s]."""
    if motion.waypoints is not None:
        return Trajectory(_through(motion.waypoints, smooth=motion.interpolation == "smooth"))
    return Trajectory(tuple(map(Expression, motion.position or (0.0,) * axes)))


def target_trajectory(scenario: Scenario) -> Trajectory:
    """Where the target is to be [m]; its velocity is the exact derivative [m/s]; the origin without one."""
    return trajectory(scenario.target or Motion(), scenario.axes)


def disturbance_trajectory(scenario: Scenario) -> Trajectory | None:
    """Force on every robot by all disturbances that depend on time alone [N]; None for none."""
    forces = scenario.uncertainty.of_time
    if not forces:
        return None
    return Trajectory(tuple(Sum(tuple(map(Expression, terms))) for terms in zip(*forces, strict=True)))


def _through(waypoints: Sequence[Waypoint], smooth: bool) -> tuple[Piecewise, ...]:
    times = np.array([waypoint.time for waypoint in waypoints], dtype=np.float64)
    points = np.array([waypoint.position for waypoint in waypoints], dtype=np.float64)
    coefficients = np.zeros((len(times), 4, points.shape[1]))  # piece, power, axis; the last piece rests
    coefficients[:, 0] = points
    if smooth and len(times) > 1:
        from scipy.interpolate import CubicSpline  # slow to import, and few scenarios need it

        coefficients[:-1] = CubicSpline(times, points, bc_type="clamped").c[::-1].swapaxes(0, 1)
    elif len(times) > 1:
        coefficients[:-1, 1] = np.diff(points, axis=0) / np.diff(times)[:, np.newaxis]
    return tuple(
        Piecewise(np.column_stack([times, coefficients[:, :, axis]])) for axis in range(points.shape[1])
    )
