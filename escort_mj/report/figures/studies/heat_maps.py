"""Heat maps: a quantity over two factors, a panel per level of a third."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pandas
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm, Normalize
from numpy.typing import NDArray

from escort_mj.report.figures.drawing.look import abreast, present
from escort_mj.report.figures.drawing.scales import Scale, logarithmic, readable, scale_of, ticks_of
from escort_mj.report.figures.drawing.style import figure, panels
from escort_mj.study.sweeps.quantities import RATES, Quantity
from escort_mj.study.sweeps.results import Factor, Results

Array = NDArray[np.float64]

ACROSS = 3  # panels
LETTER = 0.075  # inches, of a label beside a panel
MOST_WORDS = 150  # numbers written into the cells of one panel
NOTHING = "#DDDFE3"


def draw_map(
    path: Path, results: Results, quantity: str, x: Factor, y: Factor, by: Factor | None = None
) -> None:
    """Draws medians, or of something that happens its share, over two factors.

    Args:
        path: Where to save it.
        results: The study's.
        quantity: One of the results'.
        x: Factor from left to right.
        y: Factor from below upward.
        by: A third, a panel per level; what else varies is taken together.
    """
    levels = [None] if by is None else list(range(len(by.levels)))
    tables = [_table(results, quantity, x, y, by, level) for level in levels]
    about = results.quantities[quantity]
    scale = scale_of(about, np.concatenate([table.ravel() for table in tables]))
    across = abreast(min(len(levels), ACROSS))
    down = -(-len(levels) // across)
    height = 0.7 + down * (0.75 + max(0.3 * len(y.levels), 0.9, LETTER * len(y.title)))
    with figure(path, height, f"{results.name}: {about.heading}") as canvas:
        grid, shown = panels(canvas, len(levels), across, sharex=True, sharey=True)
        image: Any = None
        for axes, level, table in zip(shown, levels, tables, strict=True):
            image = _panel(axes, scale.factor * table, scale, about, x, y)
            if by is not None and level is not None:
                axes.set_title(f"{by.name} = {by.levels[level]}")
        for axes in shown[-across:]:
            axes.set_xlabel(x.title)
        for axes in grid[:, 0]:
            axes.set_ylabel(y.title)
        bar = canvas.colorbar(image, ax=list(grid.ravel()), fraction=0.035, pad=0.015, aspect=25)
        unit = f"[{scale.unit}]" if scale.unit else ""
        untitled = f"{about.heading} {unit}".strip()  # the title says it otherwise
        bar.set_label(unit if present().title else textwrap.fill(untitled, int(0.7 * height / LETTER)))
        if scale.log:
            logarithmic(bar.ax.yaxis)
        bar.outline.set_visible(False)


def _table(
    results: Results, quantity: str, x: Factor, y: Factor, by: Factor | None, level: int | None
) -> Array:
    """Share or median per level of both factors, shape (levels of y, levels of x); NaN for none."""
    places = {"row": results.levels[y.name], "column": results.levels[x.name]}
    runs = pandas.DataFrame({"value": results.values(quantity), **places})
    inside = runs if by is None else runs[results.levels[by.name] == level]
    found = inside.groupby([*places])["value"].agg("mean" if quantity in RATES else "median").unstack()
    return found.reindex(index=range(len(y.levels)), columns=range(len(x.levels))).to_numpy()


def _panel(axes: Axes, table: Array, scale: Scale, quantity: Quantity, x: Factor, y: Factor) -> Any:
    """One heat map; its numbers stand in its cells where they have room."""
    colors = matplotlib.colormaps["cividis" if quantity.more_is_better else "cividis_r"]
    norm = (LogNorm if scale.log else Normalize)(scale.low, scale.high)
    axes.set_facecolor(NOTHING)
    image = axes.pcolormesh(
        np.ma.masked_invalid(table), cmap=colors, norm=norm, edgecolors="white", linewidth=0.8
    )
    axes.grid(visible=False)
    axes.spines[:].set_visible(False)
    axes.tick_params(length=0)
    below = ticks_of(x)
    axes.set_xticks(np.arange(len(below)) + 0.5, below)
    axes.set_yticks(np.arange(len(y.levels)) + 0.5, ticks_of(y))
    if max(map(len, below)) * len(below) > 40:
        axes.tick_params(axis="x", labelrotation=30)
    if table.size <= MOST_WORDS:
        for (row, column), value in np.ndenumerate(table):
            red, green, blue, _ = colors(norm(value)) if np.isfinite(value) else (1.0, 1.0, 1.0, 1.0)
            dark = 0.3 * red + 0.59 * green + 0.11 * blue < 0.5
            axes.text(
                column + 0.5,
                row + 0.5,
                readable(value),
                ha="center",
                va="center",
                fontsize=6.5,
                color="white" if dark else "#222222",
            )
    return image
