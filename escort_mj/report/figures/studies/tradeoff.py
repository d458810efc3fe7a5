"""Safety against precision and effort: every cell of a study, and those that no other beats."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, Normalize
from matplotlib.lines import Line2D

from escort_mj.report.figures.drawing.scales import heading, level_keys, logarithmic, scale_of
from escort_mj.report.figures.drawing.style import figure, legend
from escort_mj.study.sweeps.quantities import EFFORT, PRECISION, SAFETY
from escort_mj.study.sweeps.results import Factor, Results
from escort_mj.study.sweeps.statistics import pareto

MARKS = "osD^vP*Xhp<>"
RING = "#C8001E"
FRONT: Any = {"color": RING, "linewidth": 0.9, "linestyle": (0, (4, 2))}


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
        circle: Any = {"marker": "o", "linestyle": "", "mec": RING, "mfc": "none"}
        axes.plot(x.factor * safety[ring], y.factor * precision[ring], **circle, markersize=11, mew=1.3)
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
        both = np.stack([x.factor * safety[known], y.factor * precision[known]], axis=1)
        front = both[pareto(both * (-1.0, 1.0))]
        front = front[np.argsort(-front[:, 0], kind="stable")]  # from its safest point to its most precise
        axes.step(*front.T, where="post", **FRONT)
        axes.axvline(0.0, color="#555555", linewidth=0.9)
        axes.set(xlabel=f"{x.label}: more is safer", ylabel=f"{y.label}: less is more precise")
        if y.log:
            axes.set_yscale("log")
            logarithmic(axes.yaxis)
        bar = canvas.colorbar(ScalarMappable(norm, "viridis"), ax=axes, fraction=0.035, pad=0.015, aspect=30)
        bar.set_label(f"{heading(results.quantities[EFFORT])}, median [{colors.unit}]")
        bar.outline.set_visible(False)
        shapes: Any = {"color": "#555555", "linestyle": "", "markersize": 5}
        keys = level_keys(by, lambda level: Line2D([], [], marker=MARKS[level % len(MARKS)], **shapes))
        keys.append(("on the front of all three", Line2D([], [], **circle, markersize=8)))
        keys.append(("front of these two", Line2D([], [], **FRONT)))
        legend(canvas, keys)
