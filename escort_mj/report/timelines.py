"""Figures over time: the paper's four panels, distances, clearances, forces."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from escort_mj import palette
from escort_mj.report.curves import (
    BOUND,
    average_handles,
    draw_curves,
    limit_line,
    log_scale,
    running_mean,
    running_rms,
    timeline,
)
from escort_mj.report.replay import safe_radius
from escort_mj.report.style import name_robots

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]

MOST_PANELS = 4  # obstacles with a panel of their own
NO_LIMIT = 1e100  # [N]; the trace writes 1e300 where a motor has no limit


def panels(figure: Figure, trace: xarray.Dataset) -> None:
    """The paper's figs. 5, 6, 8, 12, 13, 15: distances to target and neighbors, and tracking errors."""
    count = trace.sizes["robot"]
    colors = palette.robot_colors(count)
    time = trace["time"].values
    grid = figure.subplots(3, 2, sharex=True, height_ratios=(1.25, 0.8, 1.25))
    radius, spacing = float(trace.attrs["mission_radius"]), float(trace.attrs["spacing"])

    offset = trace["q"].values - trace["target_position"].values[:, None]
    distance = np.linalg.norm(offset, axis=2)
    ends, edges = _neighbors(trace)
    _above_and_below(grid[:2, 0], time, distance, radius, colors, "(a) Distance to the target", "R")
    if len(ends):
        name = "(b) Distance between neighbors, in both colors"
        if count > palette.MOST_DISTINCT:
            name = "(b) Distance between neighbors"
        _above_and_below(grid[:2, 1], time, edges, spacing, _edge_colors(ends, colors), name, "ℓ")
    else:
        _nearest_robot(grid[0, 1], trace, colors)
        grid[1, 1].set_axis_off()
    for axes, name, title, unit in (
        (grid[2, 0], "e", "(c) Position tracking error |e|", "m"),
        (grid[2, 1], "e_dot", "(d) Velocity tracking error |ė|", "m/s"),
    ):
        draw_curves(axes, time, np.linalg.norm(trace[name].values, axis=2), colors, running_rms)
        axes.set_title(title)
        axes.set_ylabel(unit)
        log_scale(axes)
        axes.set_xlabel("time [s]")
    timeline(grid.ravel(), time)
    handles = [Line2D([], [], color=palette.LIMIT, linestyle=BOUND, label="wanted")]
    if count <= palette.MOST_DISTINCT:
        handles += average_handles("its running rms")
    name_robots(figure, grid.ravel(), count, handles)


def _above_and_below(
    pair: NDArray[np.object_],
    time: Array,
    values: Array,
    wanted: float,
    colors: Sequence[Any],
    title: str,
    symbol: str,
) -> None:
    """Distances as they are, and below how far they are from the wanted one, down to millimeters."""
    above, below = pair
    above.set_title(title)
    draw_curves(above, time, values, colors)
    limit_line(above, wanted, f"{symbol} = {wanted:.4g}")
    above.set_ylabel("m")
    above.set_ylim(bottom=0.0)
    draw_curves(below, time, np.abs(values - wanted), colors, running_rms)
    below.set_ylabel(f"from {symbol} [m]")
    log_scale(below)


def _nearest_robot(axes: Axes, trace: xarray.Dataset, colors: Sequence[palette.Color]) -> None:
    """What stands in for neighbors where the mission has no formation."""
    if "robot_distance_min" not in trace:
        axes.set_axis_off()
        return
    axes.set_title("(b) Distance to the nearest robot")
    draw_curves(axes, trace["time"].values, trace["robot_distance_min"].values, colors)
    axes.set_ylabel("m")
    axes.set_ylim(bottom=0.0)


def obstacle_distances(figure: Figure, trace: xarray.Dataset) -> None:
    """The paper's fig. 10: how near the robots come to each obstacle, and when avoidance ruled whom."""
    time, count = trace["time"].values, trace.sizes["robot"]
    colors = palette.robot_colors(count)
    distance, safe = trace["obstacle_distance"].values, safe_radius(trace)
    touch = trace["robot_radius"].values[:, None] + trace["obstacle_radius"].values
    obstacles = trace.sizes["obstacle"]
    rows = obstacles if obstacles <= MOST_PANELS else 1
    grid = figure.subplots(rows + 1, 1, sharex=True, height_ratios=[2.0] * rows + [_lanes_height(count)])
    others: list[Any] = [Line2D([], [], color=palette.CONTACT, linestyle=BOUND, label="safe distance")]
    if rows == obstacles:
        for j, axes in enumerate(grid[:rows]):
            axes.set_title(f"To {trace['obstacle'].values[j]}")
            draw_curves(axes, time, distance[:, :, j], colors)
            top = _window(distance[:, :, j], 4.0 * max(safe[:, j].max(), touch[:, j].max()))
            axes.set_ylim(0.0, top)
            axes.axhspan(0.0, float(touch[:, j].min()), color=palette.OBSTACLE, alpha=0.45, linewidth=0)
            limit_line(axes, float(safe[:, j].max()), f"{safe[:, j].max():.3g} m", palette.CONTACT)
            axes.set_ylabel("centers apart [m]")
        others.append(Patch(color=palette.OBSTACLE, alpha=0.45, label="would touch"))
    else:
        beyond = (distance - safe).min(axis=2)
        grid[0].set_title(f"Beyond the safe distance of the nearest of {obstacles} obstacles")
        draw_curves(grid[0], time, beyond, colors)
        grid[0].set_ylim(min(0.0, float(beyond.min())) - 0.2, _window(beyond, 3.0 * float(safe.max()) + 1.0))
        limit_line(grid[0], 0.0, "", palette.CONTACT)
        grid[0].set_ylabel("m")
    _lanes(grid[-1], trace)
    timeline(grid, time)
    name_robots(figure, grid, count, others)


def clearances(figure: Figure, trace: xarray.Dataset) -> None:
    """Least free space around each robot, surface to surface, and how hard bodies touched."""
    time, count = trace["time"].values, trace.sizes["robot"]
    colors = palette.robot_colors(count)
    names = {"robot_clearance_worst": "to other robots", "obstacle_clearance_worst": "to obstacles"}
    names = {name: words for name, words in names.items() if name in trace}
    touched = bool((trace["contacts"].values > 0).any())
    rows = len(names) + touched
    grid = np.atleast_1d(
        figure.subplots(rows + 1, 1, sharex=True, height_ratios=[2.0] * rows + [_lanes_height(count)])
    )
    for axes, (name, words) in zip(grid, names.items(), strict=False):
        values = trace[name].values
        axes.set_title(f"Clearance {words}")
        draw_curves(axes, time, values, colors, lowest=True)
        axes.set_ylim(
            min(0.0, float(values.min())) - 0.1, _window(values, 4.0 * float(trace.attrs["mission_radius"]))
        )
        limit_line(axes, 0.0, "contact", palette.CONTACT)
        axes.set_ylabel("surfaces apart [m]")
    if touched:
        axes = grid[len(names)]
        axes.set_title("Largest contact force")
        axes.fill_between(
            time, trace["contact_force"].values, step="pre", color=palette.CONTACT, alpha=0.6, linewidth=0
        )
        axes.set_ylabel("N")
    _lanes(grid[-1], trace)
    timeline(grid, time)
    name_robots(figure, grid, count)


def forces(figure: Figure, trace: xarray.Dataset) -> None:
    """Forces that the motors applied, one panel per axis as each axis has its motor, with the limit."""
    time, count = trace["time"].values, trace.sizes["robot"]
    limits = trace["force_limit"].values
    limits = np.unique(limits[limits < NO_LIMIT])
    grid = np.atleast_1d(figure.subplots(trace.sizes["axis"], 1, sharex=True, sharey=True))
    for axes, name in zip(grid, trace["axis"].values, strict=True):
        values = trace["force"].sel(axis=name).values
        draw_curves(axes, time, values, palette.robot_colors(count), running_mean)
        for limit in limits[:3]:
            limit_line(axes, float(limit), f"{limit:.4g} N")
            limit_line(axes, -float(limit), f"-{limit:.4g} N")
        axes.set_title(f"Force along {name}")
        axes.set_ylabel("N")
        if len(limits):
            axes.set_ylim(-1.08 * limits.max(), 1.08 * limits.max())
    timeline(grid, time)
    handles = [Line2D([], [], color=palette.LIMIT, linestyle=BOUND, label="limit")] if len(limits) else []
    if count <= palette.MOST_DISTINCT:
        handles += average_handles("its running mean")
    name_robots(figure, grid, count, handles)


def _neighbors(trace: xarray.Dataset) -> tuple[NDArray[np.int64], Array]:
    """Neighbors as indices, shape (edges, 2), and their distances, shape (T, edges) [m]."""
    ends = trace["neighbors"].values.astype(np.int64) - 1
    q = trace["q"].values
    return ends, np.linalg.norm(q[:, ends[:, 0]] - q[:, ends[:, 1]], axis=2)


def _edge_colors(ends: NDArray[np.int64], colors: list[palette.Color]) -> list[tuple[palette.Color, ...]]:
    """Both ends' colors for each pair of neighbors; one is enough in a large team."""
    if len(colors) > palette.MOST_DISTINCT:
        return [(colors[i],) for i, _ in ends]
    return [(colors[i], colors[j]) for i, j in ends]


def _window(values: Array, most: float) -> float:
    """Top of a scale that shows what is near; what is farther leaves the panel."""
    return max(min(float(np.nanmax(values, initial=0.0)) * 1.05, most), 1e-3)


def _lanes_height(count: int) -> float:
    return 0.5 + 0.09 * count if count <= palette.MOST_DISTINCT else 1.0


def _lanes(axes: Axes, trace: xarray.Dataset) -> None:
    """When avoidance ruled whom: a lane per robot, or how many robots where there are too many."""
    time, active = trace["time"].values, trace["avoidance_active"].values > 0
    count = active.shape[1]
    axes.set_title("Avoidance active")
    if count > palette.MOST_DISTINCT:
        axes.fill_between(time, active.sum(axis=1), step="post", color=palette.OBSTACLE, linewidth=0)
        axes.set_ylabel("robots")
        axes.set_ylim(0.0, count)
        return
    for index, color in enumerate(palette.robot_colors(count)):
        axes.fill_between(
            time, index + 0.6, index + 1.4, where=active[:, index], step="post", color=color, linewidth=0
        )
    axes.set_ylim(count + 0.7, 0.3)
    axes.set_yticks(range(1, count + 1))
    axes.set_ylabel("robot")
    axes.grid(axis="y", visible=False)


__all__ = ["clearances", "forces", "obstacle_distances", "panels"]
