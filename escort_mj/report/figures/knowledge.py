"""What robots know of the target and from whom: over time, and as marks on their paths."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from mpl_toolkits.mplot3d.art3d import Line3DCollection
from numpy.typing import NDArray

from escort_mj import palette
from escort_mj.metrics.knowledge import parts
from escort_mj.metrics.reading import lost
from escort_mj.record.recording import Recorded
from escort_mj.record.team import of_team, own_targets, team_names
from escort_mj.report.figures.drawing.curves import (
    SECOND,
    curve_keys,
    dashed_curves,
    draw_curves,
    lanes,
    lanes_height,
    log_scale,
    running_mean,
    running_rms,
    timeline,
)
from escort_mj.report.figures.drawing.style import Key, name_robots
from escort_mj.report.figures.losses import heard_links, lost_keys
from escort_mj.report.figures.teams import colored, colors_at

Array = NDArray[np.float64]

APART: dict[str, Any] = {"color": palette.CONTACT, "alpha": 0.10, "linewidth": 0}
SIGHT: dict[str, Any] = {"linestyle": (0, (2, 1.2)), "linewidth": 0.9}
DRIFT: dict[str, Any] = {"linewidth": 0.8, "alpha": 0.6, "zorder": 2.9}  # beneath the way of the target
GHOST: dict[str, Any] = {"linestyle": "none", "marker": "+", "markersize": 7, "alpha": 0.55}


def knowledge_height(trace: Recorded, width: float) -> float:
    """Height of `knowledge` [inches]."""
    return 5.0 + (1 + ("heard_from" in trace)) * lanes_height(trace.sizes["robot"])


def knowledge(figure: Figure, trace: Recorded) -> None:
    """Errors and ages of estimates, who sees the target, and how many teammates each robot hears."""
    time, count, gone = trace["time"].values, trace.sizes["robot"], lost(trace)
    colors, radio = palette.robot_colors(count), "heard_from" in trace
    lane = lanes_height(count)
    grid = figure.subplots(3 + radio, 1, sharex=True, height_ratios=[2.0, 1.3, *[lane] * (1 + radio)])
    keys = curve_keys(count, "running rms (a), mean (b)")
    grid[0].set_title("(a) Error of the estimated target position")
    grid[0].set_ylabel("error [m]")
    error = np.linalg.norm(trace["target_estimate"].values - own_targets(trace), axis=2)
    draw_curves(grid[0], time, error, colors, running_rms, lost=gone)
    variance = np.trace(trace["target_covariance"].values, axis1=2, axis2=3)
    if variance.any():
        expected = 2.0 * np.sqrt(np.apply_along_axis(lambda one: running_mean(time, one), 0, variance))
        dashed_curves(grid[0], time, expected, colors)
        keys.append(("2σ that the robot expects", Line2D([], [], color="#777777", linestyle=SECOND)))
    log_scale(grid[0])
    grid[1].set_title("(b) Age of the newest measurement of the target")
    grid[1].set_ylabel("age [s]")
    draw_curves(grid[1], time, trace["information_age"].values, colors, running_mean, lost=gone)
    grid[1].set_ylim(bottom=0.0)
    lanes(grid[2], time, (trace["target_seen"].values > 0) & ~gone, "(c) Sees the target")
    if radio:
        _hearing(grid[3], trace)
        views: list[Recorded] = [of_team(trace, name) for name in team_names(trace)] or [trace]
        apart = np.any([parts(view) > 1 for view in views], axis=0)
        if apart.any():
            _shade(grid, time, apart)
            keys.append(("a team in parts" if team_names(trace) else "team in parts", Patch(**APART)))
    timeline(grid, time)
    name_robots(figure, grid, count, [*keys, *lost_keys(trace)])


def mark_known(axes: Axes, trace: Recorded, moment: int) -> None:
    """Marks at a sample: who hears whom, who sees the target, and where each robot believes it to be.

    Args:
        axes: Of two axes of the mission, or in space.
        trace: With those axes.
        moment: The sample.
    """
    if "target_estimate" not in trace:
        return
    q, gone = trace["q"].values[moment], lost(trace)[moment]
    lines: Any = Line3DCollection if q.shape[1] == 3 else LineCollection
    if "heard_from" in trace:
        pairs = q[heard_links(trace["heard_from"].values[moment], gone)]
        axes.add_collection(lines(pairs, colors=[palette.RADIO], linewidths=0.5, alpha=0.6, zorder=2.5))
    targets, estimates = own_targets(trace)[moment], trace["target_estimate"].values[moment]
    sees = (trace["target_seen"].values[moment] > 0) & ~gone
    for index, color in enumerate(colors_at(trace, moment)):
        if sees[index]:
            axes.plot(*np.stack([q[index], targets[index]], axis=1), color=color, zorder=2.7, **SIGHT)
        if not gone[index]:
            axes.plot(*estimates[index][:, None], color=color, zorder=3.2, **GHOST)


def estimate_ways(axes: Axes, trace: Recorded, rows: NDArray[np.int64], low: Array, high: Array) -> None:
    """The way of each robot's estimate, to be seen where it leaves the target's.

    Args:
        axes: As of `mark_known`.
        trace: As of `mark_known`.
        rows: Samples to draw.
        low: Corner of what is seen, shape (axes,) [m].
        high: The other corner.
    """
    if "target_estimate" not in trace:
        return
    estimates, gone = trace["target_estimate"].values, lost(trace)
    seen = ((estimates >= low) & (estimates <= high)).all(axis=2) & ~gone
    estimates, team = np.where(seen[..., None], estimates, np.nan), gone
    if "member_of" in trace:
        team = trace["member_of"].values
    for index in range(trace.sizes["robot"]):
        for color, kept in colored(trace, index, rows):
            same = kept[team[kept, index] == team[kept[0], index]]  # no line from one target to another
            axes.plot(*estimates[same, index].T, color=color, **DRIFT)


def known_keys(trace: Recorded) -> list[Key]:
    """Legend entries of those marks, where there are any."""
    if "target_estimate" not in trace or trace.sizes["robot"] > palette.MOST_LINES:
        return []
    grey = "#555555"
    keys: list[Key] = [
        ("sees the target", Line2D([], [], color=grey, **SIGHT)),
        ("estimate of the target", Line2D([], [], color=grey, **(DRIFT | GHOST | {"linestyle": "-"}))),
    ]
    if "heard_from" in trace:
        keys.append(("hear each other", Line2D([], [], color=palette.RADIO, linewidth=0.8)))
    return keys


def _hearing(axes: Axes, trace: Recorded) -> None:
    """How many teammates each robot hears, with teams robots of all of them."""
    heard = (trace["heard_from"].values > 0).sum(axis=2)
    heard[lost(trace)] = 0
    count, title = trace.sizes["robot"], "(d) Robots heard" if team_names(trace) else "(d) Teammates heard"
    if count <= palette.MOST_DISTINCT:
        most = trace.sizes["slot"]
        title = f"{title} (a full lane: {most})"
        lanes(axes, trace["time"].values, heard / most, title)
    else:
        draw_curves(axes, trace["time"].values, heard.astype(float), palette.robot_colors(count))
        axes.set_title(title)
        axes.set_ylabel("robots")
        axes.set_ylim(bottom=0.0)


def _shade(grid: NDArray[np.object_], time: Array, apart: NDArray[np.bool_]) -> None:
    """Shade the time during which the team is in parts that do not hear each other."""
    apart = np.append(apart[:1], apart[1:] | apart[:-1])  # each sample lasts until the next
    for axes in grid:
        axes.fill_between(
            time,
            0.0,
            1.0,
            where=apart,
            step="post",
            transform=axes.get_xaxis_transform(),
            zorder=0.5,
            **APART,
        )
