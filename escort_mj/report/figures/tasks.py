"""Figure of the tasks: which behavior rules whom, how far each is from done, and what conflicts cost."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from escort_mj import palette
from escort_mj.record.recording import Recorded
from escort_mj.report.figures.drawing.curves import (
    average_keys,
    draw_curves,
    log_scale,
    running_mean,
    timeline,
)
from escort_mj.report.figures.drawing.style import Key, legend, narrow

Array = NDArray[np.float64]

CELLS = 1200  # columns of a strip; more cannot be seen
STILL = 1e-9  # [m/s]; of a task that wants less, no share is taken


def tasks_height(trace: Recorded, width: float) -> float:
    """In inches: strips grow with the team."""
    return 6.4 + _strip_height(trace) * (2.0 if _phases(trace) else 1.0)


def tasks(figure: Figure, trace: Recorded) -> None:
    """Who rules whom, task errors, and the conflicts of tasks (eq. 19, remark 5)."""
    time, names = trace["time"].values, [str(name) for name in trace["behavior"].values]
    colors = [palette.BEHAVIORS.get(name, palette.LIMIT) for name in names]
    phases, strip = _phases(trace), _strip_height(trace)
    heights = [strip, *([strip] if phases else []), 1.5, 1.3, 1.3]
    grid = figure.subplots(len(heights), 1, sharex=True, height_ratios=heights)
    panels = iter(zip(grid, "abcde", strict=False))

    axes, letter = next(panels)
    axes.set_title(f"({letter}) Behavior that rules each robot")
    _strips(axes, time, trace["ruling"].values, [palette.from_hex("FFFFFF"), *colors], -1)
    if phases:
        axes, letter = next(panels)
        axes.set_title(f"({letter}) Phase of each robot")
        _strips(axes, time, trace["phase"].values, _phase_colors(len(phases)), 0)

    axes, letter = next(panels)
    draw_curves(axes, time, trace["task_error"].values.max(axis=1), colors)
    axes.set(title=f"({letter}) Error of each task: the team's largest", ylabel="error [m]")
    log_scale(axes)
    axes, letter = next(panels)
    wish, removed = trace["task_wish"].values.sum(axis=1), trace["task_removed"].values.sum(axis=1)
    share = np.divide(removed, wish, out=np.zeros_like(wish), where=wish > STILL)
    draw_curves(axes, time, 100.0 * share, colors, running_mean)
    title = f"({letter}) Share of each task's velocity that higher priorities removed, all robots"
    axes.set(title=title, ylabel="removed [%]", ylim=(0.0, None))
    axes, letter = next(panels)
    draw_curves(axes, time, np.degrees(trace["task_angle"].values.min(axis=1)), colors, running_mean)
    title = f"({letter}) Smallest angle to a higher task: 90° is no conflict"
    axes.set(title=title, ylabel="angle [°]", ylim=(-3.0, 93.0), yticks=[0, 30, 60, 90])
    timeline(grid, time)
    _legend(figure, names, colors, phases)


def _legend(figure: Figure, names: list[str], colors: list[palette.Color], phases: list[str]) -> None:
    """Behaviors in the first row, phases, if there are any, in the second."""
    above: list[Key] = [
        (name, Line2D([], [], color=color, linewidth=2.5)) for name, color in zip(names, colors, strict=True)
    ]
    above += average_keys("running mean")
    below: list[Key] = [
        (name, Patch(facecolor=color, edgecolor="#999999", linewidth=0.5))
        for name, color in zip(phases, _phase_colors(len(phases)), strict=True)
    ]
    blank: Key = ("", Line2D([], [], linewidth=0.0))
    if not below or narrow(figure):
        legend(figure, above + below)
        return
    columns = max(len(above), len(below))
    above += [blank] * (columns - len(above))
    below += [blank] * (columns - len(below))
    keys = [key for pair in zip(above, below, strict=True) for key in pair]  # legends fill by columns
    words, handles = zip(*keys, strict=True)
    figure.legend(handles, words, loc="outside lower center", ncols=columns, columnspacing=1.3)


def _phases(trace: Recorded) -> list[str]:
    """Names of the phases, the mission's own first; none where there is no other."""
    names = [name for name in str(trace.attrs.get("phases", "")).split(", ") if name]
    return names if len(names) > 1 else []


def _phase_colors(count: int) -> list[palette.Color]:
    """A color per phase; those of many phases repeat."""
    own, *others = palette.PHASES
    return [own, *(others[k % len(others)] for k in range(count - 1))][:count]


def _strip_height(trace: Recorded) -> float:
    return float(np.clip(0.11 * trace.sizes["robot"], 0.35, 1.5))


def _strips(axes: Axes, time: Array, values: Any, colors: list[palette.Color], lowest: int) -> None:
    """One row per robot, colored by what it holds over time; values begin at `lowest`."""
    count = values.shape[1]
    rows = np.unique(np.linspace(0, len(time) - 1, min(len(time), CELLS)).round().astype(int))
    step = time[rows[1]] - time[rows[0]] if len(rows) > 1 else 1.0
    edges = np.append(time[rows], time[rows[-1]] + step)
    axes.pcolormesh(
        edges,
        np.arange(count + 1) + 0.5,
        values[rows].T,
        cmap=ListedColormap(colors),
        vmin=lowest - 0.5,
        vmax=lowest + len(colors) - 0.5,
        rasterized=True,
    )
    axes.set_ylim(count + 0.5, 0.5)
    axes.yaxis.set_major_locator(MaxNLocator(min(count, 6), integer=True))
    axes.set_ylabel("robot")
    axes.grid(False)
