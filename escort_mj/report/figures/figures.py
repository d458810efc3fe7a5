"""Draws the figures of a run folder."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from matplotlib.figure import Figure

from escort_mj.errors import RenderError, UsageError
from escort_mj.files import remove_left
from escort_mj.record.folder import FIGURES, StoredRun, read_run
from escort_mj.record.recording import LOG, Recorded, is_log, not_logged
from escort_mj.report.figures import (
    dominance,
    gap,
    knowledge,
    memory,
    nearness,
    paths,
    tasks,
    timelines,
    truth,
)
from escort_mj.report.figures.drawing.look import WIDTH, check_formats, present
from escort_mj.report.figures.drawing.style import canvas_of, figure, png_of

NOTHING = "the trace holds no sample, so there is nothing to draw"
THUMBNAIL_DPI = 60


class Plot(NamedTuple):
    """One figure of a run.

    Attributes:
        name: File name without suffix.
        title: What it shows.
        height: In inches, for this trace and width [inches].
        draw: Draws it.
        applies: Whether this trace has something to show.
    """

    name: str
    title: str
    height: Callable[[Recorded, float], float]
    draw: Callable[[Figure, Recorded], None]
    applies: Callable[[Recorded], bool] = lambda trace: True


PLOTS: tuple[Plot, ...] = (
    Plot("panels", "distances and tracking errors", timelines.panels_height, timelines.panels),
    Plot("paths", "paths", paths.plan_height, paths.plan_view, lambda trace: trace.sizes["axis"] == 2),
    Plot("paths", "paths", paths.space_height, paths.space_view, lambda trace: trace.sizes["axis"] > 2),
    Plot(
        "obstacle_distances",
        "distances to obstacles",
        nearness.obstacle_distances_height,
        nearness.obstacle_distances,
        lambda trace: trace.sizes["obstacle"] > 0,
    ),
    Plot(
        "clearances",
        "clearances and contacts",
        nearness.clearances_height,
        nearness.clearances,
        lambda trace: bool(nearness.spaces(trace)),
    ),
    Plot("tasks", "behaviors and their conflicts", tasks.tasks_height, tasks.tasks),
    Plot(
        "truth",
        "what the law does not know",
        truth.truth_height,
        truth.truth,
        lambda trace: "mass_matrix" in trace,
    ),
    Plot(
        "memory",
        "what components keep of their own",
        memory.memory_height,
        memory.memory,
        lambda trace: "component_memory" in trace or "policy_memory" in trace,
    ),
    Plot(
        "knowledge",
        "what robots know",
        knowledge.knowledge_height,
        knowledge.knowledge,
        lambda trace: "target_estimate" in trace,
    ),
    Plot("gap", "gaps of the team", lambda trace, width: gap.HEIGHT, gap.gap, gap.may_escape),
    Plot(
        "dominance",
        "what each side reaches first",
        dominance.dominance_height,
        dominance.dominance,
        dominance.has_sides,
    ),
    Plot(
        "forces",
        "forces of the motors",
        timelines.forces_height,
        timelines.forces,
        lambda trace: "force" not in not_logged(trace),
    ),
)


def draw_figures(
    folder: str | os.PathLike[str], formats: Sequence[str] = ("png",), only: Sequence[str] = ()
) -> list[Path]:
    """Draw the figures that a run folder has data for, into its `figures/`.

    Args:
        folder: A run folder.
        formats: File formats: `png`, `pdf`, `svg`.
        only: Names of figures; empty for all.

    Returns:
        The files written.

    Raises:
        UsageError: If there is no such format, or the run has no such figure.
        RunFolderError: If the folder cannot be read.
        RenderError: If there is no sample to draw.
        WriteError: If a file cannot be written.
    """
    formats = check_formats(formats)
    run = read_run(folder)
    if run.recording.sizes["time"] == 0:
        raise RenderError(f"{run.path}: {NOTHING}")
    names = [check_figure(run.recording, name) for name in only] or plots_of(run.recording)
    remove_left(run.path / FIGURES)
    return [draw_plot(run, name, suffix) for name in names for suffix in formats]


def draw_plot(run: StoredRun, name: str, suffix: str = "png") -> Path:
    """Draw one figure of a run that was opened, into its folder.

    Args:
        run: With a sample at least.
        name: Which, of `plots_of`.
        suffix: File format.

    Returns:
        The file.

    Raises:
        WriteError: If it cannot be written.
    """
    trace, plot = run.recording, plots_of(run.recording)[name]
    path = run.path / FIGURES / f"{name}.{suffix}"
    with figure(path, _height(plot, trace), _title(trace, plot), _note(run)) as canvas:
        plot.draw(canvas, trace)
    return path


def plots_of(trace: Recorded) -> dict[str, Plot]:
    """The figures that a trace has data for, by their names."""
    return {plot.name: plot for plot in PLOTS if plot.applies(trace)}


def check_figure(trace: Recorded, name: str) -> str:
    """Return the name of a figure.

    Raises:
        UsageError: If the run has no such figure.
    """
    if name not in (known := plots_of(trace)):
        raise UsageError(f"{name}: is not a figure of this run; allowed are {', '.join(known)}")
    return name


def figure_of(trace: Recorded, name: str | None = None, note: str = "") -> Figure:
    """Draw one figure of a trace.

    Args:
        trace: Of a run.
        name: Which, of `plots_of`; None for the first.
        note: What a reader must know of the run; empty for nothing.

    Raises:
        UsageError: If the run has no such figure.
        RenderError: If there is no sample to draw.
    """
    if trace.sizes["time"] == 0:
        raise RenderError(NOTHING)
    plots = plots_of(trace)
    plot = next(iter(plots.values())) if name is None else plots[check_figure(trace, name)]
    with canvas_of(_height(plot, trace), _title(trace, plot), note) as canvas:
        plot.draw(canvas, trace)
    return canvas


def thumbnail_of(trace: Recorded) -> bytes:
    """The paths of a trace as a small PNG.

    Raises:
        RenderError: If there is no sample to draw.
    """
    return png_of(figure_of(trace, "paths"), THUMBNAIL_DPI)


def _height(plot: Plot, trace: Recorded) -> float:
    return plot.height(trace, present().width or WIDTH)


def _title(trace: Recorded, plot: Plot) -> str:
    log = f", log {trace.attrs[LOG]}" if is_log(trace) else ""
    return f"{trace.attrs['title']}{log}: {plot.title}"


def _note(run: StoredRun) -> str:
    """What a reader must know of a run that did not end well."""
    words = str(run.outcome["outcome"])
    return "" if words == "completed" else f"{words}: {run.outcome['message']}"
