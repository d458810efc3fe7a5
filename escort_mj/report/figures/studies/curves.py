"""Curves of a study: medians and shares over one factor with bands; intervals of each cell."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import NullLocator
from numpy.typing import NDArray

from escort_mj import palette
from escort_mj.report.figures.drawing.look import abreast
from escort_mj.report.figures.drawing.scales import (
    Scale,
    colors_of,
    heading,
    level_keys,
    logarithmic,
    scale_of,
    ticks_of,
)
from escort_mj.report.figures.drawing.style import FAILED, figure, legend, panels, rows_of_cells
from escort_mj.study.sweeps.quantities import RATES, Quantity
from escort_mj.study.sweeps.results import Factor, Results
from escort_mj.study.sweeps.statistics import Interval, Summary, proportion_of

Array = NDArray[np.float64]

BINS = 8  # of values that were drawn
MOST_CELLS = 60
BAR = 0.2  # inches of height
LETTERS = 44, 24  # of a title's line over one of two panels, and of four
ABREAST = 4  # panels
ALONE = (0.25, 0.35, 0.5)
DASHES: tuple[Any, ...] = ("-", (0, (5, 2)), (0, (2, 2)))  # lines that coincide all show


class Point(NamedTuple):
    """A median or a share, and its interval."""

    x: float
    value: float
    interval: Interval


def draw_study_curves(
    path: Path, results: Results, factor: Factor, by: Factor | None, quantities: Sequence[str]
) -> None:
    """Draw each quantity over one factor with numbers; what else varies is taken together.

    Args:
        path: Where to save it.
        results: The study's.
        factor: From left to right.
        by: A line per level of this one.
        quantities: A panel each.
    """
    across, never = abreast(2), False
    down = -(-len(quantities) // across)
    with figure(path, 0.8 + 2.1 * down, f"{results.name}: against {factor.name}") as canvas:
        _, shown = panels(canvas, len(quantities), across, sharex=True)
        for axes, quantity in zip(shown, quantities, strict=True):
            lines = [list(_points(results, quantity, factor, here)) for here in _parts(results, by)]
            _curves(axes, results.quantities[quantity], lines)
            never |= any(np.isposinf(point.value) for line in lines for point in line)
        for axes in shown[-across:]:
            axes.set_xlabel(factor.title)
        for axes in shown:
            if factor.log:
                axes.set_xscale("log")
                logarithmic(axes.xaxis)
            if len(factor.levels) <= 10 and not factor.drawn:
                axes.set_xticks(factor.numbers, ticks_of(factor))
                axes.xaxis.set_minor_locator(NullLocator())
        colors = colors_of(len(by.levels) if by else 0)
        keys = level_keys(by, lambda level: Line2D([], [], color=colors[level], linewidth=2.0))
        if never:
            keys.append(("median: never", Line2D([], [], color="#555555", marker="x", linestyle="")))
        legend(canvas, keys)


def _parts(results: Results, by: Factor | None) -> list[NDArray[np.bool_]]:
    """Runs of each level of a factor; all of them where there is none."""
    if by is None:
        return [np.ones(len(results.runs), dtype=bool)]
    return [results.levels[by.name] == level for level in range(len(by.levels))]


def _points(results: Results, quantity: str, factor: Factor, here: NDArray[np.bool_]) -> Iterator[Point]:
    """Medians or shares along a factor; of values that were drawn, in groups of equal size."""
    values, place = results.values(quantity), results.levels[factor.name]
    numbers = np.array(factor.numbers)
    groups: list[NDArray[np.intp]] = [np.array([level]) for level in range(len(numbers))]
    if factor.drawn:
        groups = [part for part in np.array_split(np.arange(len(numbers)), BINS) if len(part)]
    for group in groups:
        some = values[here & np.isin(place, group)]
        if not np.isnan(some).all():
            yield _point(float(np.median(numbers[group])), quantity, some)


def _point(x: float, quantity: str, values: Array) -> Point:
    if quantity in RATES:
        happened = proportion_of(values)
        return Point(x, happened.share, happened.interval)
    found = Summary(values)
    return Point(x, found.median, found.median_interval)


def _curves(axes: Axes, quantity: Quantity, lines: Sequence[Sequence[Point]]) -> None:
    """One panel: a line and a band per level."""
    ends = [end for line in lines for point in line for end in (point.value, *point.interval)]
    scale = scale_of(quantity, np.array(ends or [0.0]))
    _prepare(axes, quantity, scale, vertical=True)
    for level, (line, color) in enumerate(zip(lines, colors_of(len(lines)), strict=True)):
        x = np.array([point.x for point in line])
        value = scale.factor * np.array([point.value for point in line])
        band = scale.factor * np.array([point.interval for point in line]).reshape(-1, 2)
        band = np.where(np.isposinf(band), 1e3 * abs(scale.high) + 1.0, band)
        axes.fill_between(x, band[:, 0], band[:, 1], color=color, alpha=0.16, linewidth=0)
        value, never = np.where(np.isfinite(value), value, np.nan), x[np.isposinf(value)]
        axes.plot(x, value, "o", color=color, markersize=3.0, linestyle=DASHES[level % len(DASHES)])
        if len(never):
            top = np.ones(len(never))
            where = axes.get_xaxis_transform()
            axes.plot(never, top, "x", color=color, markersize=5, transform=where, clip_on=False)


def _prepare(axes: Axes, quantity: Quantity, scale: Scale, vertical: bool) -> None:
    """Heading, unit and limits of a panel; shares from nothing to all."""
    letters = LETTERS[0] if vertical else LETTERS[1]
    axes.set_title("\n".join(textwrap.fill(line, letters) for line in heading(quantity, "\n").split("\n")))
    label = "[" + scale.unit + "]" if scale.unit else ""
    margin = 0.06 * (scale.high - scale.low)
    limits = (scale.low - margin, scale.high + margin)
    if scale.log:
        limits = (scale.low / 1.4, scale.high * 1.4)
    if vertical:
        axes.set(ylabel=label, yscale="log" if scale.log else "linear", ylim=limits)
    else:
        axes.set(xlabel=label, xscale="log" if scale.log else "linear", xlim=limits)
    if scale.log:
        logarithmic(axes.yaxis if vertical else axes.xaxis)


def draw_intervals(path: Path, results: Results, by: Factor | None, quantities: Sequence[str]) -> None:
    """Draw each cell's medians and shares with their intervals, a panel per quantity.

    Args:
        path: Where to save it.
        results: The study's; of more than `MOST_CELLS` cells, the first ones.
        by: The factor whose levels have colors.
        quantities: A panel each.
    """
    cells = list(range(min(len(results.cells), MOST_CELLS)))
    words = [results.title(index) or "all runs" for index in cells]
    colors: list[palette.Color] = [ALONE] * len(cells)
    if by is not None:
        colors = [colors_of(len(by.levels))[results.level_of_cell[by.name][index]] for index in cells]
    across = abreast(min(len(quantities), ABREAST))
    rows = -(-len(quantities) // across)
    height = rows * (1.16 + BAR * max(len(cells), 3))
    with figure(path, height, f"{results.name}: each cell", width=9.6) as canvas:
        shown = rows_of_cells(canvas, len(quantities), across, words)
        for axes, quantity in zip(shown, quantities, strict=True):
            points = [_point(0.0, quantity, results.of_cell(quantity, index)) for index in cells]
            _intervals(axes, results.quantities[quantity], points, colors)


def _intervals(
    axes: Axes, quantity: Quantity, points: Sequence[Point], colors: Sequence[palette.Color]
) -> None:
    """One panel: a dot and a bar per cell, or why there is none."""
    scale = scale_of(quantity, np.array([end for point in points for end in (point.value, *point.interval)]))
    _prepare(axes, quantity, scale, vertical=False)
    for place, (point, color) in enumerate(zip(points, colors, strict=True)):
        if not np.isfinite(point.value):
            text = "never" if np.isposinf(point.value) else "-"
            axes.text(
                0.02, place, text, transform=axes.get_yaxis_transform(), va="center", fontsize=7, color=FAILED
            )
            continue
        low, high = (scale.factor * end for end in point.interval)
        ends = [low, min(high, 1e3 * abs(scale.high) + 1.0)]
        axes.plot(ends, [place, place], color=color, linewidth=2.0, alpha=0.45)
        axes.plot(scale.factor * point.value, place, "o", color=color, markersize=4)
