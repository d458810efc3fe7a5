"""What robots know of the target and from whom: over time, and as marks on their paths."""

from __future__ import annotations

from collections.abc import Callable
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
    DASHED,
    beside_curves,
    curve_keys,
    lanes,
    lanes_height,
    log_scale,
    robot_curves,
    running_mean,
    running_rms,
    timeline,
)
from escort_mj.report.figures.drawing.style import Key, name_robots
from escort_mj.report.figures.links import heard_links, lost_keys
from escort_mj.report.figures.teams import colored, colors_at

Array = NDArray[np.float64]
Panels = list[tuple[float, Callable[[Axes, str, Recorded], list[Key]]]]
"""Heights of panels [inches], and what draws them and returns further legend entries."""

KNOWN = 1e-9  # error of an estimate of who knows his target, by rounding [m]

APART: dict[str, Any] = {"color": palette.CONTACT, "alpha": 0.10, "linewidth": 0}
SIGHT: dict[str, Any] = {"linestyle": (0, (2, 1.2)), "linewidth": 0.9}
DRIFT: dict[str, Any] = {"linewidth": 0.8, "alpha": 0.6, "zorder": 2.9}  # beneath the way of the target
GHOST: dict[str, Any] = {"linestyle": "none", "marker": "+", "markersize": 7, "alpha": 0.55}


def knowledge_height(trace: Recorded, width: float) -> float:
    """Height of `knowledge` [inches]."""
    return 1.7 + sum(height for height, _ in _panels(trace))


def knowledge(figure: Figure, trace: Recorded) -> None:
    """Errors and ages of estimates, who sees the target, whom each robot hears, and which messages are lost.

    Of robots that know their target, the first three are left out.
    """
    panels, count = _panels(trace), trace.sizes["robot"]
    averaged = len(panels) > 2 or count > palette.MOST_LINES
    keys = curve_keys(count, "running rms (error), mean (age)") if averaged else []
    heights = [height for height, _ in panels]
    grid = figure.subplots(len(panels), 1, sharex=True, height_ratios=heights, squeeze=False)[:, 0]
    for letter, axes, (_, draw) in zip("abcde", grid, panels, strict=False):
        keys += draw(axes, f"({letter})", trace)
    if "heard_from" in trace:
        views: list[Recorded] = [of_team(trace, name) for name in team_names(trace)] or [trace]
        apart = np.any([parts(view) > 1 for view in views], axis=0)
        if apart.any():
            _shade(grid, trace["time"].values, apart)
            keys.append(("a team in parts" if team_names(trace) else "team in parts", Patch(**APART)))
    timeline(grid, trace["time"].values)
    name_robots(figure, grid, count, [*keys, *lost_keys(trace)])


def _panels(trace: Recorded) -> Panels:
    """The panels of a mission: those of the target only where a robot does not know it."""
    lane, ages, gone = lanes_height(trace.sizes["robot"]), trace["information_age"].values, lost(trace)
    told = (
        _errors(trace).max(initial=0.0) < KNOWN
        and not ages.any()
        and trace["target_seen"].values[~gone].all()
    )
    found: Panels = [(lane, _hearing), (1.3, _losses)] if "heard_from" in trace else []
    return found if found and told else [(2.0, _estimates), (1.3, _ages), (lane, _sight), *found]


def _errors(trace: Recorded) -> Array:
    """Distance of each robot's estimate from its target [m]."""
    return np.linalg.norm(trace["target_estimate"].values - own_targets(trace), axis=2)


def _estimates(axes: Axes, letter: str, trace: Recorded) -> list[Key]:
    title = f"{letter} Error of the estimated target position"
    robot_curves(axes, trace, _errors(trace), running_rms, title=title, ylabel="error [m]")
    variance, keys = np.trace(trace["target_covariance"].values, axis1=2, axis2=3), list[Key]()
    if variance.any():
        mean = np.apply_along_axis(lambda one: running_mean(trace["time"].values, one), 0, variance)
        beside_curves(axes, trace, 2.0 * np.sqrt(mean), **DASHED)
        dash = Line2D([], [], color="#777777", linestyle=DASHED["linestyle"])
        keys.append(("2σ that the robot expects", dash))
    log_scale(axes)
    return keys


def _ages(axes: Axes, letter: str, trace: Recorded) -> list[Key]:
    age, title = trace["information_age"].values, f"{letter} Age of the newest measurement of the target"
    robot_curves(axes, trace, age, running_mean, title=title, ylabel="age [s]", ylim=(0.0, None))
    return []


def _sight(axes: Axes, letter: str, trace: Recorded) -> list[Key]:
    sees = (trace["target_seen"].values > 0) & ~lost(trace)
    lanes(axes, trace["time"].values, sees, f"{letter} Sees the target")
    return []


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


def _hearing(axes: Axes, letter: str, trace: Recorded) -> list[Key]:
    """How many teammates each robot hears, with teams robots of all of them."""
    heard = (trace["heard_from"].values > 0).sum(axis=2)
    heard[lost(trace)] = 0
    count, title = trace.sizes["robot"], f"{letter} {'Robots' if team_names(trace) else 'Teammates'} heard"
    if count <= palette.MOST_DISTINCT:
        most = trace.sizes["slot"]
        lanes(axes, trace["time"].values, heard / most, f"{title} (a full lane: {most})")
    else:
        robot_curves(axes, trace, heard.astype(float), gray_lost=False)
        axes.set(title=title, ylabel="robots", ylim=(0.0, None))
    return []


def _losses(axes: Axes, letter: str, trace: Recorded) -> list[Key]:
    """The share of all messages to each robot so far that are lost on the way."""
    gone, heard = trace["messages_lost"].values, trace["messages_heard"].values
    share = 100.0 * gone / np.maximum(gone + heard, 1.0)
    title = f"{letter} Messages to the robot that were lost so far"
    robot_curves(axes, trace, share, gray_lost=False, title=title, ylabel="share [%]", ylim=(0.0, None))
    return []


def _shade(grid: NDArray[np.object_], time: Array, apart: NDArray[np.bool_]) -> None:
    """Shade the time during which the team is in parts that do not hear each other."""
    apart = np.append(apart[:1], apart[1:] | apart[:-1])  # each sample lasts until the next
    for axes in grid:
        area = {"where": apart, "step": "post", "transform": axes.get_xaxis_transform(), "zorder": 0.5}
        axes.fill_between(time, 0.0, 1.0, **area, **APART)
