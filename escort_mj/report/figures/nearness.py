"""Figures of how near robots come to obstacles, to each other and to the target."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from escort_mj import palette
from escort_mj.record.episodes import apart_from, pair
from escort_mj.record.recording import Recorded
from escort_mj.record.team import kept_radius
from escort_mj.report.figures.drawing.curves import (
    BOUND,
    curve_keys,
    lanes,
    lanes_height,
    limit_line,
    robot_curves,
    timeline,
)
from escort_mj.report.figures.drawing.style import Key, name_robots
from escort_mj.report.figures.links import lost_keys
from escort_mj.report.video.replay import safe_radius

Array = NDArray[np.float64]

MOST_PANELS = 4  # obstacles with a panel of their own


def obstacle_distances(figure: Figure, trace: Recorded) -> None:
    """The paper's fig. 10: how near the robots come to each obstacle, and when avoidance ruled whom."""
    time, count = trace["time"].values, trace.sizes["robot"]
    distance, safe = trace["obstacle_distance"].values, safe_radius(trace)
    touch = trace["robot_radius"].values[:, None] + trace["obstacle_radius"].values
    obstacles = trace.sizes["obstacle"]
    rows = obstacles if obstacles <= MOST_PANELS else 1
    grid = figure.subplots(rows + 1, 1, sharex=True, height_ratios=[2.0] * rows + [lanes_height(count)])
    others: list[Key] = [("safe distance", Line2D([], [], color=palette.CONTACT, linestyle=BOUND))]
    if rows == obstacles:
        for j, axes in enumerate(grid[:rows]):
            top = _window(distance[:, :, j], 4.0 * max(safe[:, j].max(), touch[:, j].max()))
            shape = trace["obstacle_radius"].values[j] == 0.0  # distances are to its nearest point
            label = "to surface [m]" if shape else "centers apart [m]"
            robot_curves(axes, trace, distance[:, :, j], ylabel=label, ylim=(0.0, top))
            axes.set_title(f"To {trace['obstacle'].values[j]}")
            axes.axhspan(0.0, float(touch[:, j].min()), color=palette.OBSTACLE, alpha=0.45, linewidth=0)
            limit_line(axes, float(safe[:, j].max()), f"{safe[:, j].max():.3g} m", palette.CONTACT)
        others.append(("would touch", Patch(color=palette.OBSTACLE, alpha=0.45, linewidth=0)))
    else:
        beyond = (distance - safe).min(axis=2)
        window = min(0.0, float(beyond.min())) - 0.2, _window(beyond, 3.0 * float(safe.max()) + 1.0)
        robot_curves(grid[0], trace, beyond, ylabel="beyond [m]", ylim=window)
        grid[0].set_title(f"Beyond the safe distance of the nearest of {obstacles} obstacles")
        limit_line(grid[0], 0.0, "", palette.CONTACT)
    lanes(grid[-1], time, trace["avoidance_active"].values > 0, "Avoidance active")
    timeline(grid, time)
    name_robots(figure, grid, count, [*others, *curve_keys(count, ""), *lost_keys(trace)])


def clearances(figure: Figure, trace: Recorded) -> None:
    """Least free space around each robot, surface to surface, and how hard bodies touched."""
    time, count = trace["time"].values, trace.sizes["robot"]
    free, pushed = spaces(trace), _pushed(trace)
    rows = len(free) + pushed
    heights = [2.0] * rows + [lanes_height(count)]
    grid = np.atleast_1d(figure.subplots(rows + 1, 1, sharex=True, height_ratios=heights))
    for axes, (whom, space) in zip(grid, free.items(), strict=False):
        top = _window(space, 4.0 * float(kept_radius(trace).max()))
        window = min(0.0, float(space.min())) - 0.03 * top, top
        robot_curves(axes, trace, space, lowest=True)
        axes.set(title=f"Clearance to {whom}", ylabel="surfaces apart [m]", ylim=window)
        limit_line(axes, 0.0, "contact", palette.CONTACT)
    if pushed:
        axes, touches = grid[len(free)], _touches(trace)
        axes.set(title="Contacts: mean force (the area is the impulse) and peaks", ylabel="force [N]")
        start, lasts, impulse, when, force = (
            touches[f"episode_{name}"].values
            for name in ("start", "touch_time", "impulse", "peak_time", "peak_force")
        )
        axes.bar(start, impulse / lasts, lasts, align="edge", color=palette.CONTACT, alpha=0.35, linewidth=0)
        axes.vlines(when, 0.0, force, color=palette.CONTACT, linewidth=0.8)
        axes.plot(when, force, ".", color=palette.CONTACT, ms=5)
        axes.set_ylim(0.0, 1.1 * max(float(force.max()), 1e-3))
    lanes(grid[-1], time, trace["avoidance_active"].values > 0, "Avoidance active")
    timeline(grid, time)
    name_robots(figure, grid, count, [*curve_keys(count, ""), *lost_keys(trace)])


def clearances_height(trace: Recorded, width: float) -> float:
    """Height of `clearances` [inches]."""
    return _height(trace, len(spaces(trace)) + _pushed(trace))


def obstacle_distances_height(trace: Recorded, width: float) -> float:
    """Height of `obstacle_distances` [inches]."""
    return _height(trace, trace.sizes["obstacle"] if trace.sizes["obstacle"] <= MOST_PANELS else 1)


def _height(trace: Recorded, rows: int) -> float:
    """Height of so many panels above the lanes [inches]."""
    count = trace.sizes["robot"]
    return 1.4 + 1.5 * rows + (0.11 * count if count <= palette.MOST_DISTINCT else 1.0)


def spaces(trace: Recorded) -> dict[str, Array]:
    """Free space around each robot, surface to surface, by what is around it, shape (T, n) each [m]."""
    names = {"other robots": "robots", "obstacles": "obstacles", "walls": "walls"}
    if any("target" in pair(trace, episode) for episode in range(trace.sizes["episode"])):
        names["the target"] = "target"
    groups = list(trace["group"].values)
    found = {whom: trace["clearance"].values[:, :, groups.index(name)] for whom, name in names.items()}
    return {whom: space for whom, space in found.items() if np.isfinite(space).any()}


def _touches(trace: Recorded) -> Recorded:
    """Contact episodes but those with the floor."""
    return trace.isel(episode=apart_from(trace, "floor"))


def _pushed(trace: Recorded) -> bool:
    """Whether anything touched with a force: beyond three axes bodies go through one another."""
    return bool(_touches(trace).sizes["episode"]) and trace.sizes["axis"] <= 3


def _window(values: Array, most: float) -> float:
    """Top of a scale that shows what is near; what is farther leaves the panel."""
    return max(min(float(np.nanmax(values, initial=0.0)) * 1.05, most), 1e-3)
