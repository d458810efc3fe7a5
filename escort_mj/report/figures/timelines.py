"""Figures over time: the paper's four panels, and the forces."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from escort_mj import palette
from escort_mj.metrics.arrival import goal_distance
from escort_mj.metrics.energy_ratio import energy_ratios
from escort_mj.metrics.reading import escorts, lost
from escort_mj.metrics.spacing import even_spacing
from escort_mj.record.recording import Recorded, not_logged
from escort_mj.record.team import kept_radius
from escort_mj.report.figures.drawing.curves import (
    BOUND,
    TWIN,
    curve_keys,
    draw_curves,
    limit_line,
    log_scale,
    robot_curves,
    running_mean,
    running_rms,
    timeline,
)
from escort_mj.report.figures.drawing.look import NARROW
from escort_mj.report.figures.drawing.style import Key, name_robots, narrow
from escort_mj.report.figures.links import lost_keys

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

MOST_LIMITS = 4  # wanted distances that have a line each
NO_LIMIT = 1e100  # [N]; the trace writes 1e300 where a motor has no limit


def panels_height(trace: Recorded, width: float) -> float:
    """Height of `panels` [inches]: two columns, or one where the figure is narrow."""
    return 6.4 if width > NARROW else 8.4


def panels(figure: Figure, trace: Recorded) -> None:
    """The paper's figs. 5, 6, 8, 12, 13, 15: distances to target and neighbors, and tracking errors."""
    count = trace.sizes["robot"]
    colors = palette.robot_colors(count)
    time = trace["time"].values
    if not narrow(figure):
        grid = figure.subplots(3, 2, sharex=True, height_ratios=(1.25, 0.8, 1.25))
    else:
        rows = figure.subplots(6, 1, sharex=True, height_ratios=(1.25, 0.8, 1.25, 0.8, 1.25, 1.25))
        grid = rows[[[0, 2], [1, 3], [4, 5]]]
    radius, spacing = kept_radius(trace), even_spacing(trace)

    offset = trace["q"].values - trace["target_position"].values[:, None]
    distance = np.linalg.norm(offset, axis=2)
    ends, edges = _neighbors(trace)
    gone = lost(trace)
    if escorts(trace):
        _above_and_below(grid[:2, 0], time, distance, radius, colors, "(a) Distance to the target", "R", gone)
    elif "goal" in trace:
        _to_goal(grid[:2, 0], trace)
    else:
        for axes in grid[:2, 0]:
            axes.set_axis_off()
    if gone.any():
        _nearest_robot(grid[0, 1], trace)
        _evenness(grid[1, 1], trace)
        ends = ends[:0]
    elif len(ends):
        pairs, name = _edge_colors(ends, colors), "(b) Distance between neighbors"
        _above_and_below(grid[:2, 1], time, edges, spacing, pairs, name, "ℓ")
    else:
        _nearest_robot(grid[0, 1], trace)
        grid[1, 1].set_axis_off()
    for axes, name, title, unit in (
        (grid[2, 0], "e", "(c) Position tracking error |e|", "m"),
        (grid[2, 1], "e_dot", "(d) Velocity tracking error |ė|", "m/s"),
    ):
        axes.set_title(title)
        if name in not_logged(trace):
            axes.text(0.5, 0.5, "not in the log", transform=axes.transAxes, ha="center", va="center")
            axes.set_yticks([])
            continue
        error = np.linalg.norm(trace[name].values, axis=2)
        error[1:][gone[:-1]] = np.nan  # a lost robot is not asked to follow
        robot_curves(axes, trace, error, running_rms, ylabel=f"error [{unit}]")
        log_scale(axes)
    for axes in grid[2] if not narrow(figure) else grid[2, 1:]:
        axes.set_xlabel("time [s]")
    timeline(grid.ravel(), time)
    keys: list[Key] = []
    if escorts(trace) or len(ends):
        keys.append(("wanted", Line2D([], [], color=palette.LIMIT, linestyle=BOUND)))
    keys += curve_keys(count, "running rms")
    if count <= palette.MOST_DISTINCT:
        if len(ends):
            both = [
                Line2D([], [], color=colors[i], linestyle=dash)
                for i, dash in zip(ends[0], ("-", TWIN), strict=True)
            ]
            keys.append((f"neighbors {ends[0, 0] + 1}, {ends[0, 1] + 1}", tuple(both)))
    keys += lost_keys(trace)
    name_robots(figure, grid.ravel(), count, keys)


def _above_and_below(
    pair: NDArray[np.object_],
    time: Array,
    values: Array,
    wanted: Array,
    colors: Sequence[Any],
    title: str,
    symbol: str,
    gone: Flags | None = None,
) -> None:
    """Distances as they are, and below how far they are from the wanted ones, down to millimeters."""
    above, below = pair
    draw_curves(above, time, values, colors, lost=gone)
    lines = np.unique(np.round(wanted, 3))
    if wanted.ndim > 1 and (wanted != wanted[:1]).any():  # they change
        above.plot(time, wanted.mean(axis=1), color=palette.LIMIT, linestyle=BOUND, linewidth=1.0, zorder=2.6)
        lines = np.zeros(0)
    for value in lines if len(lines) <= MOST_LIMITS else [float(np.median(wanted))]:
        limit_line(above, float(value), f"{symbol} = {value:.4g} m")
    above.set(title=title, ylabel="distance [m]", ylim=(0.0, None))
    if gone is not None and gone.any():
        above.set_ylim(top=1.4 * float(values[~gone].max()))
    draw_curves(below, time, np.abs(values - wanted), colors, running_rms, lost=gone)
    below.set_ylabel(f"off {symbol} [m]")
    log_scale(below)


def _to_goal(pair: NDArray[np.object_], trace: Recorded) -> None:
    """Distances to goals as they are, and below down to millimeters."""
    above, below = pair
    for axes in pair:
        robot_curves(axes, trace, goal_distance(trace), ylabel="distance [m]")
    above.set(title="(a) Distance to the goal", ylim=(0.0, None))
    log_scale(below)


def _nearest_robot(axes: Axes, trace: Recorded) -> None:
    """What stands in for neighbors where the mission has no formation."""
    if "robot_distance_min" not in trace:
        axes.set_axis_off()
        return
    distance, gone = trace["robot_distance_min"].values, lost(trace)
    robot_curves(axes, trace, distance, title="(b) Distance to the nearest robot", ylabel="distance [m]")
    axes.set_ylim(0.0, 1.4 * float(distance[~gone].max()) if gone.any() else None)


def _evenness(axes: Axes, trace: Recorded) -> None:
    """How much more energy the directions of the robots that are left have than the least of that many."""
    ratios = energy_ratios(trace)
    if ratios is None:
        axes.set_axis_off()
        return
    draw_curves(axes, trace["time"].values, np.abs(ratios - 1.0)[:, None], [palette.TARGET])
    axes.set_ylabel("energy above\nleast [share]")
    log_scale(axes)


def forces_height(trace: Recorded, width: float) -> float:
    """Height of `forces` [inches]."""
    return 1.0 + 1.7 * trace.sizes["axis"]


def forces(figure: Figure, trace: Recorded) -> None:
    """Forces that the motors applied, one panel per axis as each axis has its motor, with the limit."""
    time, count = trace["time"].values, trace.sizes["robot"]
    limits = trace["force_limit"].values
    limits = np.unique(limits[limits < NO_LIMIT])
    grid = np.atleast_1d(figure.subplots(trace.sizes["axis"], 1, sharex=True, sharey=True))
    for place, (axes, name) in enumerate(zip(grid, trace["axis"].values, strict=True)):
        values = trace["force"].values[:, :, place]
        robot_curves(axes, trace, values, running_mean, title=f"Force along {name}", ylabel="force [N]")
        for limit in limits[:3]:
            limit_line(axes, float(limit), f"{limit:.4g} N")
            limit_line(axes, -float(limit), f"−{limit:.4g} N")  # noqa: RUF001
        peak = float(limits.max()) if len(limits) else _usual_peak(trace["force"].values)
        if peak > 0.0:
            axes.set_ylim(-1.08 * peak, 1.08 * peak)
        if (most := float(np.nanmax(np.abs(values)))) > 1.08 * peak:
            axes.set_title(f"largest: {most:.3g} N", loc="right", fontweight="normal")
    timeline(grid, time)
    keys: list[Key] = [("limit", Line2D([], [], color=palette.LIMIT, linestyle=BOUND))] if len(limits) else []
    keys += curve_keys(count, "running mean")
    keys += lost_keys(trace)
    name_robots(figure, grid, count, keys)


def _usual_peak(forces: Array) -> float:
    """A force that few samples exceed [N]: a jump at the start would hide the rest."""
    size = np.abs(forces[np.isfinite(forces)])
    most = float(size.max(initial=0.0))
    return min(most, 1.5 * float(np.percentile(size, 99.5))) or most


def _neighbors(trace: Recorded) -> tuple[NDArray[np.int64], Array]:
    """Neighbors as indices, shape (edges, 2), and their distances, shape (T, edges) [m]."""
    ends = trace["neighbors"].values.astype(np.int64) - 1
    q = trace["q"].values
    return ends, np.linalg.norm(q[:, ends[:, 0]] - q[:, ends[:, 1]], axis=2)


def _edge_colors(ends: NDArray[np.int64], colors: list[palette.Color]) -> list[tuple[palette.Color, ...]]:
    """Both ends' colors for each pair of neighbors; one is enough in a large team."""
    if len(colors) > palette.MOST_DISTINCT:
        return [(colors[i],) for i, _ in ends]
    return [(colors[i], colors[j]) for i, j in ends]
