"""Safety against precision and effort: every cell of a study, and those that no other beats."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, Normalize
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from escort_mj.report.figures.drawing.scales import heading, level_keys, logarithmic, scale_of
from escort_mj.report.figures.drawing.style import figure, legend
from escort_mj.study.sweeps.quantities import EFFORT, PRECISION, SAFETY
from escort_mj.study.sweeps.results import Factor, Results
from escort_mj.study.sweeps.statistics import pareto

MARKS = "osD^vP*Xhp<>"
RING = "#C8001E"


def draw_tradeoff(path: Path, results: Results, by: Factor | None) -> None:
    """Draws medians of safety and precision, one mark per cell: shape by a factor's level, color by effort.

    Args:
        path: Where to save it.
        results: The study's.
        by: The factor whose levels have shapes.
    """
    safety, precision, effort = (results.medians(name) for name in (SAFETY, PRECISION, EFFORT))
    known = np.isfinite(safety) & np.isfinite(precision)
    x, y, colors = (
        scale_of(results.quantities[name], values)
        for name, values in ((SAFETY, safety[known]), (PRECISION, precision[known]), (EFFORT, effort))
    )
    shape = np.zeros(len(results.cells), dtype=np.intp)
    if by is not None:
        shape = results.level_of_cell[by.name]
    norm = (LogNorm if colors.log else Normalize)(colors.low, colors.high)
    with figure(path, 4.6, f"{results.name}: safety against precision and effort") as canvas:
        axes = canvas.subplots()
        ring = known & results.front()
        axes.plot(
            x.factor * safety[ring],
            y.factor * precision[ring],
            "o",
            markersize=11,
            mec=RING,
            mew=1.3,
            mfc="none",
        )
        for level in range(1 if by is None else len(by.levels)):
            here = known & (shape == level)
            axes.scatter(
                x.factor * safety[here],
                y.factor * precision[here],
                c=colors.factor * np.where(np.isfinite(effort[here]), effort[here], np.nan),
                cmap="viridis",
                norm=norm,
                marker=MARKS[level % len(MARKS)],
                s=30,
                edgecolors="white",
                linewidths=0.5,
                zorder=3,
                plotnonfinite=True,
            )
        axes.plot(
            *_stairs(x.factor * safety[known], y.factor * precision[known]),
            color=RING,
            linewidth=0.9,
            linestyle=(0, (4, 2)),
        )
        axes.axvline(0.0, color="#555555", linewidth=0.9)
        axes.set_xlabel(f"{x.label}: more is safer")
        axes.set_ylabel(f"{y.label}: less is more precise")
        if y.log:
            axes.set_yscale("log")
            logarithmic(axes.yaxis)
        bar = canvas.colorbar(ScalarMappable(norm, "viridis"), ax=axes, fraction=0.035, pad=0.015, aspect=30)
        bar.set_label(f"{heading(results.quantities[EFFORT])}, median [{colors.unit}]")
        bar.outline.set_visible(False)
        keys = level_keys(by, lambda level: _mark(MARKS[level % len(MARKS)], color="#555555", markersize=5))
        keys.append(("on the front of all three", _mark("o", mec=RING, mfc="none", markersize=8)))
        keys.append(("front of these two", Line2D([], [], color=RING, linewidth=0.9, linestyle=(0, (4, 2)))))
        legend(canvas, keys)


def _stairs(safety: NDArray[np.float64], precision: NDArray[np.float64]) -> tuple[list[float], list[float]]:
    """The front of safety and precision: from its safest point to its most precise, in steps."""
    front = pareto(np.stack([-safety, precision], axis=1))
    order = np.argsort(-safety[front], kind="stable")
    x: list[float] = []
    y: list[float] = []
    for a, b in zip(safety[front][order], precision[front][order], strict=True):
        x += [a, a] if x else [a]
        y += [y[-1], b] if y else [b]
    return x, y


def _mark(shape: str, **look: Any) -> Line2D:
    """A mark of a legend."""
    return Line2D([], [], marker=shape, linestyle="", **look)
