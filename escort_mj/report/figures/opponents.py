"""Where opponents went, and what became of them."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from escort_mj import palette
from escort_mj.components.movers import COMES, INTERCEPTED, REACHED
from escort_mj.record.recording import Recorded
from escort_mj.report.figures.drawing.curves import BOUND
from escort_mj.report.figures.drawing.style import Key

MARKS = {INTERCEPTED: ("intercepted", "X"), REACHED: ("reached the target", "*")}
SIZE = 8.0  # of a mark [points]


def opponents(trace: Recorded) -> NDArray[np.int64]:
    """Return which obstacles opponents are, the last ones, from 0."""
    count = trace.sizes.get("opponent", 0) if "opponent_status" in trace else 0
    return np.arange(trace.sizes["obstacle"] - count, trace.sizes["obstacle"])


def draw_opponents(axes: Axes, trace: Recorded, rows: NDArray[np.int64]) -> None:
    """Draw how opponents came, faintly how they left, and where robots or they themselves succeeded.

    Args:
        axes: Of a plan, or a view in space.
        trace: Of any mission.
        rows: Samples to draw, shape (samples,).
    """
    for number, obstacle in enumerate(opponents(trace)):
        way, status = (
            trace["obstacle_position"].values[:, obstacle],
            trace["opponent_status"].values[:, number],
        )
        look: dict[str, Any] = {"color": palette.OPPONENT, "zorder": 3.3}
        axes.plot(*way[rows[status[rows] <= COMES]].T, linewidth=1.3, **look)
        axes.plot(*way[rows[status[rows] > COMES]].T, linewidth=0.9, alpha=0.5, linestyle=BOUND, **look)
        axes.plot(*way[0][:, None], "o", markersize=5.0, markerfacecolor="white", **look)
        for end, (_, mark) in MARKS.items():
            when = np.flatnonzero(status == end)[:1]
            axes.plot(*way[when].T, mark, markersize=SIZE, markeredgecolor="white", **look | {"zorder": 4.1})


def opponent_keys(trace: Recorded) -> list[Key]:
    """Legend entries of opponents, and of what became of any of them."""
    if not len(opponents(trace)):
        return []
    keys: list[Key] = [("opponent", Line2D([], [], color=palette.OPPONENT))]
    for end, (word, mark) in MARKS.items():
        if (trace["opponent_status"].values == end).any():
            look: dict[str, Any] = {"linestyle": "none", "marker": mark, "markeredgecolor": "white"}
            keys.append((word, Line2D([], [], color=palette.OPPONENT, markersize=SIZE, **look)))
    return keys
