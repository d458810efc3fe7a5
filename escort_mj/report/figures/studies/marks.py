"""Every cell of a study that varies three things with names: a column, a color and a mark."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from escort_mj.report.figures.drawing.curves import log_ticks
from escort_mj.report.figures.drawing.look import abreast
from escort_mj.report.figures.drawing.scales import colors_of, heading, scale_of
from escort_mj.report.figures.drawing.style import figure, legend, panels
from escort_mj.study.sweeps.quantities import COMPLETED, RATES
from escort_mj.study.sweeps.results import Factor, Results

MARKS = "os^Dv*Xhp<>P"
ROOM = 0.85  # of a column that marks take
LOWEST = 1e-3  # of the largest value: where a logarithmic scale puts zero
WIDE = 8.0  # times the least: values that reach so far are shown on a logarithmic scale
LETTERS = 84, 9  # in a line under all columns, and under one at least


def draw_marks(
    path: Path, results: Results, factors: tuple[Factor, Factor, Factor], quantities: Sequence[str]
) -> None:
    """Draw medians of all cells, a panel per quantity; what is never or missing is a cross on top.

    Args:
        path: Where to save it.
        results: The study's.
        factors: What has a column per level, what a color, and what a mark.
        quantities: A panel each.
    """
    across, by, marks = factors
    letters = max(LETTERS[0] // len(across.levels), LETTERS[1])
    lines = textwrap.TextWrapper(letters, break_long_words=False, break_on_hyphens=False)
    columns, colors = abreast(2), colors_of(len(by.levels))
    rows = -(-len(quantities) // columns)
    with figure(path, 1.6 + 2.2 * rows, f"{results.name}: cell by cell", width=9.6) as canvas:
        _, shown = panels(canvas, len(quantities), columns, sharex=True)
        for axes, name in zip(shown, quantities, strict=True):
            _panel(axes, results, name, factors)
        for axes in shown[-columns:]:
            axes.set_xticks(
                range(len(across.levels)), [lines.fill(level) for level in across.levels], fontsize=6.5
            )
        dot: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 5}
        keys = [
            (level, Line2D([], [], **dot, color=color))
            for level, color in zip(by.levels, colors, strict=True)
        ]
        for level, mark in zip(marks.levels, MARKS, strict=False):
            hollow = Line2D([], [], **(dot | {"marker": mark}), color="#555555", markerfacecolor="white")
            keys.append((level, hollow))
        keys.append(("never, or not completed", Line2D([], [], **(dot | {"marker": "x"}), color="#555555")))
        legend(canvas, keys)


def _panel(axes: Axes, results: Results, name: str, factors: tuple[Factor, Factor, Factor]) -> None:
    """One quantity of every cell."""
    across, by, marks = factors
    values = results.medians(name)
    scale = scale_of(results.quantities[name], values)
    finite = values[np.isfinite(values)]
    positive = bool(len(finite)) and bool((finite >= 0.0).all())
    log = positive and name not in RATES and float(finite.max()) > WIDE * float(finite.min())
    axes.set(title=heading(results.quantities[name]), ylabel=scale.unit)
    for column in range(1, len(across.levels)):
        axes.axvline(column - 0.5, color="#E3E5E8", linewidth=0.6)
    axes.grid(axis="x", visible=False)
    count = len(by.levels) * (len(marks.levels) + 1) - 1
    for index, value in enumerate(values):
        column, color, mark = (int(results.level_of_cell[one.name][index]) for one in factors)
        place = color * (len(marks.levels) + 1) + mark
        x = column + ROOM * ((place + 0.5) / count - 0.5)
        paint = colors_of(len(by.levels))[color]
        if np.isnan(value) and results.rate(COMPLETED, index).share == 1.0:
            continue  # nothing to measure, such as the distance to obstacles where there are none
        if not np.isfinite(value):
            axes.plot(x, 0.965, "x", transform=axes.get_xaxis_transform(), color=paint, markersize=4)
        else:
            shown = scale.factor * (max(value, LOWEST * float(finite.max())) if log else value)
            axes.plot(x, shown, MARKS[mark], color=paint, markersize=3.4, markerfacecolor="white")
    axes.set_xlim(-0.55, len(across.levels) - 0.45)
    if log:
        axes.set_yscale("log")
        low, high = axes.get_ylim()
        axes.set_ylim(low, high * (high / low) ** 0.1)
        log_ticks(axes, (high / low) ** 1.1)
