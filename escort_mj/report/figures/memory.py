"""The figure of what components keep of their own, beside the truth that it estimates."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from escort_mj import palette
from escort_mj.record.recording import Recorded
from escort_mj.report.figures.drawing.curves import (
    beside_curves,
    curve_keys,
    robot_curves,
    thin,
    timeline,
)
from escort_mj.report.figures.drawing.style import Key, name_robots

Array = NDArray[np.float64]

BEHIND: Any = {"linewidth": 4.0, "alpha": 0.35, "zorder": 1.9}
MOST_AXES = 3
MOST_ROWS = 8


def memory_height(trace: Recorded, width: float) -> float:
    """Height of the figure [inches]."""
    return 1.1 + 1.9 * min(len(_integrated(trace)) + len(_kept(trace)), MOST_ROWS)


def memory(figure: Figure, trace: Recorded) -> None:
    """One row of panels for each number of robots, one panel for each axis; one panel for each of bodies."""
    time, names, kept = trace["time"].values, _integrated(trace), _kept(trace)
    axes = min(trace.sizes["axis"], MOST_AXES) if names else 1
    rows = min(len(names) + len(kept), MOST_ROWS)
    grid = figure.subplots(rows, axes, sharex=True, sharey="row", squeeze=False)
    compared = False
    for row, name in enumerate(names):
        own = trace["component_memory"].values[:, row]
        true = truth_of(trace, row)
        for k in range(axes):
            panel = grid[row, k]
            title = f"{name}, {trace['axis'].values[k]}"
            robot_curves(panel, trace, own[..., k], gray_lost=False, title=title)
            if true is not None:
                compared = True
                beside_curves(panel, trace, trace[true].values[..., k], **BEHIND)
        grid[row, 0].set_ylabel(str(trace["memory_unit"].values[row]))
    for panels, (name, column) in zip(grid[len(names) :], kept.items(), strict=False):
        panels[0].plot(*thin(time, trace["policy_memory"].values[:, column]), color=palette.LIMIT)
        panels[0].set(title=name, ylabel=str(trace["policy_unit"].values[column]))
        for panel in panels[1:]:
            panel.set_axis_off()
    timeline(grid.ravel(), time)
    for panel in grid[-1]:
        panel.set_xlabel("time [s]")
    pale: Any = Line2D([], [], color="#777777", **BEHIND)
    keys: list[Key] = [("what it estimates", pale)] if compared else []
    if names:
        count = trace.sizes["robot"]
        name_robots(figure, grid.ravel(), count, keys + curve_keys(count, ""))


def _integrated(trace: Recorded) -> list[str]:
    """Return the names of what laws and disturbances integrate."""
    return [str(name) for name in trace["memory"].values[:MOST_ROWS]] if "memory" in trace.sizes else []


def _kept(trace: Recorded) -> dict[str, int]:
    """Return where each number is that policies keep, by its name."""
    if "policy_memory" not in trace:
        return {}
    return {str(name): column for column, name in enumerate(trace["policy_value"].values)}


def truth_of(trace: Recorded, row: int) -> str | None:
    """Return the signal that a row of memory estimates, if its unit and shape are those of the row."""
    name = str(trace["memory_truth"].values[row])
    if name not in trace or trace[name].dims != ("time", "robot", "axis"):
        return None
    same = str(trace[name].attrs["units"]) == str(trace["memory_unit"].values[row])
    return name if same and bool(np.isfinite(trace[name].values).all()) else None
