"""Curves over time that stay readable: thinned without losing a peak, averaged where noise hides them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import LogFormatterSciNotation, LogLocator, NullFormatter, NullLocator
from numpy.typing import NDArray

from escort_mj import palette
from escort_mj.metrics.reading import lost
from escort_mj.palette import LOST
from escort_mj.record.recording import Recorded
from escort_mj.report.figures.drawing.style import Key

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

BINS = 1200  # points across a panel; more cannot be seen
AVERAGED = 1.0  # window of a running average [s]; less in a short run
BOUND: Any = (0, (4, 2))
TWIN: Any = (0, (4, 4))  # of the second color over the first
DASHED: Any = {"linestyle": (0, (3, 1.5)), "linewidth": 0.9}  # of what stands beside a robot's curve
CROWD = palette.from_hex("0072B2")
ALL, NINE_TENTHS = 0.18, 0.35  # opacity of the bands of a crowd
FAINT = 0.5  # width of a line that stands behind its own average
LEAST, MOST = 1e-7, 1e9  # what a plot shows of a quantity that goes to zero or diverges


def draw_curves(
    axes: Axes,
    time: Array,
    values: Array,
    colors: Sequence[Any],
    average: Callable[[Array, Array], Array] | None = None,
    lowest: bool = False,
    lost: Flags | None = None,
) -> None:
    """One curve per column; of a crowd the range of all columns, of most, and their median.

    Args:
        axes: Where to draw.
        time: Shape (T,) [s].
        values: Shape (T, curves).
        colors: A color per curve, or a pair of colors, the second dashed over the first.
        average: Draw the curve faintly, and this running average of it (over time, values) boldly.
        lowest: Keep the lowest of each bin only, for quantities of which only the worst matters.
        lost: Which robots, one per curve, the team has lost, shape (T, curves): behind a cross their
            curves are gray and faint.
    """
    many = values.shape[1] > palette.MOST_DISTINCT
    width = 0.6 if many else 1.1
    values = np.clip(values, -MOST, MOST)
    if values.shape[1] > palette.MOST_LINES:
        _draw_bands(axes, time, values if lost is None else np.where(lost, np.nan, values))
        return
    for column, color in enumerate(colors):
        curve = values[:, column]
        end = len(time) if lost is None else int((~lost[:, column]).sum())
        if end < len(time):
            axes.plot(*thin(time[end:], curve[end:]), color=LOST, linewidth=FAINT, zorder=1.8)
            axes.plot(time[end], curve[end], "x", color=color, markersize=6, markeredgewidth=1.6, zorder=3.2)
            curve = curve[:end]
        first, *second = color if isinstance(color[0], tuple) else (color,)
        style: dict[str, Any] = {"marker": "o", "markersize": 3} if len(curve) == 1 else {}
        if average is not None:
            if not many:
                axes.plot(*thin(time[:end], curve), color=first, linewidth=FAINT, alpha=0.3)
            curve = average(time[:end], curve)
        x, y = thin(time[:end], curve, lowest)
        axes.plot(x, y, color=first, linewidth=width, **style)
        for other in second:
            axes.plot(x, y, color=other, linewidth=width, linestyle=TWIN, **style)


def robot_curves(
    axes: Axes,
    trace: Recorded,
    values: Array,
    average: Callable[[Array, Array], Array] | None = None,
    lowest: bool = False,
    gray_lost: bool = True,
    **labels: Any,
) -> None:
    """Draw a curve for each robot, and label the panel.

    Args:
        axes: Where to draw.
        trace: Of the run.
        values: Shape (T, n).
        average: As of `draw_curves`.
        lowest: As of `draw_curves`.
        gray_lost: Whether curves are gray and faint from where the team has lost a robot.
        labels: As for `Axes.set`: `title`, `ylabel`, `ylim`.
    """
    colors = palette.robot_colors(trace.sizes["robot"])
    gone = lost(trace) if gray_lost else None
    draw_curves(axes, trace["time"].values, values, colors, average, lowest, gone)
    axes.set(**labels)


def beside_curves(axes: Axes, trace: Recorded, values: Array, **look: Any) -> None:
    """Draw a second curve for each robot in this look, shape (T, n); of a crowd the median."""
    colors: Sequence[palette.Color] = palette.robot_colors(trace.sizes["robot"])
    if len(colors) > palette.MOST_LINES:
        values, colors = np.median(values, axis=1, keepdims=True), [palette.LIMIT]
    for column, color in enumerate(colors):
        axes.plot(*thin(trace["time"].values, values[:, column]), color=color, **look)


def lanes(axes: Axes, time: Array, values: Array | Flags, title: str) -> None:
    """A lane per robot, filled while something holds; how many robots it holds for where there are many.

    Args:
        axes: Where to draw.
        time: Shape (T,) [s].
        values: Whether it holds, or up to which share of the lane's height it is filled, shape (T, n).
        title: What it is.
    """
    count = values.shape[1]
    axes.set_title(title)
    if count > palette.MOST_DISTINCT:
        busy = values.sum(axis=1)
        axes.fill_between(time, busy, step="post", color=palette.OBSTACLE, linewidth=0)
        axes.set_ylabel(f"robots\nof {count}")
        axes.set_ylim(0.0, max(1.1 * float(busy.max()), 1.0))
        return
    for index, color in enumerate(palette.robot_colors(count)):
        floor, height = index + 1.4, 0.8 * values[:, index]
        if values.dtype != bool:
            axes.axhspan(floor - 0.8, floor, color=color, alpha=0.15, linewidth=0)
        axes.fill_between(
            time, floor - height, floor, where=height > 0, step="post", color=color, linewidth=0
        )
    axes.set_ylim(count + 0.7, 0.3)
    axes.set_yticks(range(1, count + 1))
    axes.set_ylabel("robot")
    axes.grid(axis="y", visible=False)


def lanes_height(count: int) -> float:
    """Height of the lanes of so many robots [inches]."""
    return 0.5 + 0.09 * count if count <= palette.MOST_DISTINCT else 1.0


def _draw_bands(axes: Axes, time: Array, values: Array) -> None:
    """What a crowd does: the range of all, of 90 %, and the median at each time; lost robots are NaN."""
    gone = np.isnan(values).all(axis=1)
    rows = np.flatnonzero(~gone)[:: max(1, len(time) // BINS)]
    least, low, middle, high, most = np.nanpercentile(values[rows], [0, 5, 50, 95, 100], axis=1)
    for below, above, alpha in ((least, most, ALL), (low, high, NINE_TENTHS)):
        axes.fill_between(time[rows], below, above, color=CROWD, alpha=alpha, linewidth=0)
    axes.plot(time[rows], middle, color=CROWD, linewidth=1.3)


def curve_keys(count: int, words: str) -> list[Key]:
    """Legend entries that say how the curves of so many robots are drawn.

    Args:
        count: Number of robots.
        words: What the average of a robot's curve is, where robots have one.
    """
    if count > palette.MOST_LINES:
        return [
            ("median robot", Line2D([], [], color=CROWD, linewidth=1.3)),
            ("90 % of robots", Patch(color=CROWD, alpha=NINE_TENTHS, linewidth=0)),
            ("all robots", Patch(color=CROWD, alpha=ALL, linewidth=0)),
        ]
    return average_keys(words) if words and count <= palette.MOST_DISTINCT else []


def thin(time: Array, values: Array, lowest: bool = False) -> tuple[Array, Array]:
    """A curve with at most two points per bin: the least and the largest, so that no peak is lost.

    Args:
        time: Shape (T,).
        values: Shape (T,).
        lowest: Keep the least of each bin only.
    """
    size = len(time) // BINS
    if size < 3:
        return time, values
    rows = len(time) // size
    blocks = values[: rows * size].reshape(rows, size)
    picks = np.argmin(blocks, axis=1)[:, None]
    if not lowest:
        picks = np.sort(np.hstack([picks, np.argmax(blocks, axis=1)[:, None]]), axis=1)
    kept = (np.arange(rows)[:, None] * size + picks).ravel()
    kept = np.unique(np.append(kept, [0, len(time) - 1]))
    return time[kept], values[kept]


def running_rms(time: Array, values: Array) -> Array:
    """Root mean square over a window around each sample, shape (T,)."""
    return np.sqrt(np.maximum(running_mean(time, np.square(values)), 0.0))


def running_mean(time: Array, values: Array) -> Array:
    """Mean over a window around each sample, shape (T,)."""
    if len(time) < 3:
        return values
    window = min(AVERAGED, (time[-1] - time[0]) / 60)
    half = max(round(window / 2 / max(float(np.median(np.diff(time))), 1e-9)), 1)
    total = np.concatenate([[0.0], np.cumsum(values)])
    index = np.arange(len(values))
    low, high = np.maximum(index - half, 0), np.minimum(index + half + 1, len(values))
    return (total[high] - total[low]) / (high - low)


def average_keys(words: str) -> list[Key]:
    """Legend entries of curves drawn with their average."""
    grey = "#777777"
    return [
        ("recorded", Line2D([], [], color=grey, linewidth=FAINT, alpha=0.6)),
        (words, Line2D([], [], color=grey, linewidth=1.3)),
    ]


def limit_line(axes: Axes, value: float, words: str, color: palette.Color = palette.LIMIT) -> None:
    """A bound, named outside of the panel, where nothing is hidden by it."""
    axes.axhline(value, color=color, linestyle=BOUND, linewidth=1.0, zorder=2.6)
    axes.annotate(
        words,
        (1.0, value),
        xycoords=("axes fraction", "data"),
        xytext=(3, 0),
        textcoords="offset points",
        va="center",
        fontsize="small",
        color=color,
        annotation_clip=True,
    )


def log_scale(axes: Axes) -> None:
    """A logarithmic scale over what the bold curves span, at least a decade, at most nine.

    Linear where all is zero.
    """
    bold = [
        np.asarray(line.get_ydata(), float)
        for line in axes.lines
        if line.get_linewidth() > FAINT and line.get_marker() != "x"
    ]
    values = np.concatenate([*bold, np.zeros(0)])
    values = values[np.isfinite(values) & (values > 0.0)]
    if not len(values):  # nothing but zeros, which a logarithm cannot show
        return
    high = float(np.clip(values.max(initial=LEAST), 10 * LEAST, MOST))
    low = float(np.percentile(values, 1.0)) / 2
    low = float(np.clip(low, max(LEAST, high * 1e-9), high / 10))
    axes.set_yscale("log")
    axes.set_ylim(low, high * 1.8)
    log_ticks(axes, high / low)


def log_ticks(axes: Axes, span: float) -> None:
    """Readable ticks of a logarithmic scale: plain numbers where its largest value is few times its least."""
    axes.yaxis.set_minor_formatter(NullFormatter())
    if span < 100:
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=8))
        axes.yaxis.set_major_formatter("{x:g}")
        axes.yaxis.set_minor_locator(NullLocator())
    else:
        axes.yaxis.set_major_locator(LogLocator(numticks=6))
        axes.yaxis.set_minor_locator(LogLocator(subs=(2.0, 5.0)))  # eight a decade take as long as all else
        axes.yaxis.set_major_formatter(LogFormatterSciNotation())


def timeline(grid: Iterable[Axes], time: Array) -> None:
    """The same span of time for every panel; the last one names it."""
    panels = list(grid)
    end = float(time[-1])
    for axes in panels:
        axes.set_xlim(float(time[0]), end if end > time[0] else float(time[0]) + 1.0)
    panels[-1].set_xlabel("time [s]")
