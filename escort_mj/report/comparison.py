"""Laws and outer loops side by side: the figures of a comparison, drawn from its results and run folders."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from escort_mj import palette
from escort_mj.metrics.radius_error import radius_error
from escort_mj.record.folder import read_run
from escort_mj.record.window import Span
from escort_mj.report.figures.drawing.curves import draw_curves, log_scale, running_rms, timeline
from escort_mj.report.figures.drawing.scales import heading
from escort_mj.report.figures.drawing.style import FAILED, figure
from escort_mj.scenario import Scenario
from escort_mj.study.compare.comparison import (
    LAWS,
    OUTERS,
    QUANTITIES,
    Combination,
    Result,
    quantities_over,
    rows,
    title_of,
)
from escort_mj.study.compare.comparison_table import subject

DRAWN = (
    "settling_time",
    "radius_error_mean",
    "true_error_rms",
    "true_error_max",
    "velocity_error_rms",
    "force_rms",
    "chattering",
    "obstacle_clearance_min",
    "robot_clearance_min",
)
DASHES: tuple[Any, ...] = ("-", (0, (5, 1.5)), (0, (1.5, 1.2)))
BAR = 0.19  # inches of height
MILLI = 1000.0


def _colors(laws: Iterable[str]) -> dict[str, palette.Color]:
    """A color for each law: those that come with the package, and the plugins' after them."""
    names = list(dict.fromkeys([*LAWS, *laws]))
    return dict(zip(names, palette.robot_colors(len(names)), strict=True))


def draw_comparison(
    out: Path, scenario: Scenario, results: Sequence[Result], over: Span | None = None
) -> list[Path]:
    """Draw the figures of a comparison into `figures/` of its folder and return their files.

    Args:
        out: The folder, with the run folders of what completed.
        scenario: What was run.
        results: What came of it.
        over: The part of each run that quantities look at; None for that of each.

    Raises:
        RunFolderError: If a run that completed is missing.
    """
    files = [draw_bars(out, scenario, results, over)]
    if any(result.completed for result in results):
        files.append(draw_curves_of(out, scenario, results))
    return files


def draw_bars(out: Path, scenario: Scenario, results: Sequence[Result], over: Span | None = None) -> Path:
    """One panel per quantity, a bar per combination, a dot per seed."""
    table = rows(results)
    quantities = quantities_over(over)
    names = [name for name in DRAWN if any(row.spreads[name].known for row in table)]
    path, lines = out / "figures" / "comparison.png", -(-max(len(names), 1) // 3)
    height = lines * (0.76 + BAR * len(table)) + 0.4
    with figure(path, height, f"{scenario.name}: {subject(results)} compared", width=9.6) as canvas:
        grid = canvas.subplots(lines, 3, squeeze=False, sharey=True)
        for axes, name in zip(grid.ravel(), names, strict=False):
            _bars(axes, name, table)
            axes.set_title(heading(quantities[name], "\n"))
        for axes in grid.ravel()[len(names) :]:
            axes.set_visible(False)
        for axes in grid[:, 0]:
            axes.set_yticks(range(len(table)), [_label(row, table) for row in table], fontsize=7.5)
        grid[0, 0].set_ylim(len(table) - 0.4, -0.6)
    return path


def _label(row: Combination, table: Sequence[Combination]) -> str:
    """Law and outer loop, the latter only where there are several."""
    return row.title if len({other.outer for other in table}) > 1 else title_of(row.law)


def _bars(axes: Axes, name: str, table: Sequence[Combination]) -> None:
    """One quantity; what has no value says why."""
    unit, colors = QUANTITIES[name].unit, _colors(row.law for row in table)
    means = [row.spreads[name].mean for row in table]
    small = unit in ("m", "m/s") and max((abs(mean) for mean in means if mean is not None), default=1.0) < 1.0
    scale = MILLI if small else 1.0
    axes.set_xlabel(("m" if small else "") + unit, labelpad=1.0)
    axes.grid(axis="y", visible=False)
    axes.axvline(0.0, color="#555555", linewidth=0.7)
    axes.xaxis.set_major_locator(MaxNLocator(5))
    for place, row in enumerate(table):
        spread = row.spreads[name]
        if spread.mean is None:
            words = "never" if spread.never else ("-" if row.completed else row.results[0].outcome)
            axes.annotate(
                words,
                (0.0, place),
                (3, 0),
                textcoords="offset points",
                va="center",
                fontsize=7.0,
                color=FAILED,
            )
            continue
        color = colors[row.law]
        axes.barh(place, scale * spread.mean, 0.72, color=color, alpha=0.55)
        values = [result.values[name] for result in row.results]
        dots = [scale * value for value in values if value is not None and np.isfinite(value)]
        if len(dots) > 1:
            axes.plot(dots, [place] * len(dots), "o", color=color, markersize=2.6, clip_on=False)
        if spread.never:
            axes.annotate(
                f"never in {spread.never}",
                (scale * spread.mean, place),
                (4, 0),
                textcoords="offset points",
                va="center",
                fontsize=7.0,
                color=FAILED,
            )


def draw_curves_of(out: Path, scenario: Scenario, results: Sequence[Result]) -> Path:
    """The first seed over time: error of the worst robot's radius, and tracking error without noise."""
    first = results[0].trial.seed
    runs = [result for result in results if result.trial.seed == first and result.completed]
    path, outers = out / "figures" / "curves.png", list(dict.fromkeys(run.trial.outer for run in results))
    colors = _colors(result.trial.law for result in results)
    with figure(path, 5.6, f"{scenario.name}: {subject(results)} over time, seed {first}") as canvas:
        upper, lower = canvas.subplots(2, 1, sharex=True)
        time = np.zeros(1)
        for run in runs:
            trace = read_run(out / run.trial.name).trace
            time = trace["time"].values
            drawn = len(upper.lines)
            radius = np.nanmax(np.abs(radius_error(trace)), axis=1)
            error = np.linalg.norm(trace["q_d"].values - trace["q"].values, axis=2).max(axis=1)
            color = [colors[run.trial.law]]
            draw_curves(upper, time, radius[:, None], color)
            draw_curves(lower, time, running_rms(time, error)[:, None], color)
            for line in [*upper.lines[drawn:], *lower.lines[drawn:]]:
                line.set_linestyle(DASHES[outers.index(run.trial.outer) % len(DASHES)])
        upper.set_title("Largest error of the radius, any robot")
        upper.set_ylabel("| |q - c| - R | [m]")
        lower.set_title("Largest tracking error without noise, any robot, running rms")
        lower.set_ylabel("|q_d - q| [m]")
        for axes in (upper, lower):
            log_scale(axes)
        timeline([upper, lower], time)
        laws = list(dict.fromkeys(run.trial.law for run in runs))
        keys = [(title_of(law), Line2D([], [], color=colors[law], linewidth=2.0)) for law in laws]
        if len(outers) > 1:
            keys += [
                (OUTERS[outer], Line2D([], [], color="#555555", linestyle=DASHES[index % len(DASHES)]))
                for index, outer in enumerate(outers)
            ]
        words, handles = zip(*keys, strict=True)
        canvas.legend(handles, words, loc="outside lower center", ncols=3, columnspacing=1.3)
    return path
