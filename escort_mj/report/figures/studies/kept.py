"""Runs of a study that were kept, side by side in one figure."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from mpl_toolkits.mplot3d.axes3d import Axes3D

from escort_mj.errors import UsageError
from escort_mj.record.folder import StoredRun, read_run
from escort_mj.report.figures.drawing.curves import log_ticks
from escort_mj.report.figures.drawing.look import abreast, present
from escort_mj.report.figures.drawing.style import FAILED, WIDTH, figure
from escort_mj.report.figures.figures import plots_of
from escort_mj.scenario.findings import did_you_mean, listed
from escort_mj.study.sweeps.definition import KeptFigure
from escort_mj.study.sweeps.design import cells_where
from escort_mj.study.sweeps.results import Results

ZOOM = 1.18  # of a view in space
INK = "#222222"
HEADROOM = 0.35  # inches, for the name over each part


def kept_runs(results: Results, shown: KeptFigure, folder: Path) -> dict[int, Path]:
    """The folders of the runs that a figure shows, by their cells; empty where one was not kept."""
    found = {}
    for index in cells_where(results.cells, shown.where):
        run = next(run for run in results.runs if run.cell == index)
        row = results.rows.get(run.key)
        if row is None or row.folder is None or not (folder / row.folder).is_dir():
            return {}
        found[index] = folder / row.folder
    return found


def draw_kept(path: Path, results: Results, shown: KeptFigure, folder: Path) -> None:
    """Draw a figure of several runs side by side.

    Args:
        path: Where to save it.
        results: The study's.
        shown: Which figure.
        folder: Of the study.

    Raises:
        UsageError: If there is no such figure of these runs.
        RunFolderError: If a run cannot be read.
    """
    runs = {index: read_run(place) for index, place in kept_runs(results, shown, folder).items()}
    plots = []
    for run in runs.values():
        known = plots_of(run.recording)
        if shown.draw not in known:
            near = did_you_mean(shown.draw, known)
            words = f"found draw: {shown.draw}; figures of {run.path} are {listed([*known])}{near}"
            raise UsageError(f"figures: {shown.name}: {words}")
        plots.append(known[shown.draw])
    across = abreast(len(runs))
    down = len(runs) // across
    width = (present().width or WIDTH * len(runs)) / across
    height = HEADROOM + down * max(
        plot.height(run.recording, width) for plot, run in zip(plots, runs.values(), strict=True)
    )
    title = f"{shown.title or shown.name}: {plots[0].title}"
    with figure(path, height, title, width=WIDTH * len(runs)) as canvas:
        parts = canvas.subfigures(down, across, wspace=0.03, squeeze=False).ravel()
        for part, plot, (index, run) in zip(parts, plots, runs.items(), strict=True):
            ending = _ending(run)
            words = _apart(results, [*runs], index) + ending
            part.suptitle(words, fontsize=9.0, color=FAILED if ending else INK)
            plot.draw(part, run.recording)
            for axes in part.axes:
                if isinstance(axes, Axes3D):  # its labels need more room in half of a figure
                    limits = np.array([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()])
                    axes.set_box_aspect(np.ptp(limits, axis=1), zoom=ZOOM)
        if shown.draw != "paths" and all(run.outcome["outcome"] == "completed" for run in runs.values()):
            _same_scales([part.axes for part in parts])


def _apart(results: Results, cells: Sequence[int], index: int) -> str:
    """What tells a cell from others: levels that differ; all that a figure of one cell leaves open."""
    labels = [results.labels(cell) for cell in cells]
    differing = [name for name in labels[0] if len({one[name] for one in labels}) > 1]
    return ", ".join(results.labels(index)[name] for name in differing or [results.apart] if name)


def _same_scales(parts: Sequence[Sequence[Axes]]) -> None:
    """The same scale for the same panel of each part, so that they can be compared by eye."""
    for panels in zip(*parts, strict=True):
        low, high = zip(*(axes.get_ylim() for axes in panels), strict=True)
        inverted = low[0] > high[0]
        for axes in panels:
            axes.set_ylim((max if inverted else min)(low), (min if inverted else max)(high))
            if axes.get_yscale() == "log":
                log_ticks(axes, max(high) / min(low))


def _ending(run: StoredRun) -> str:
    """What a reader must know of a run that did not end well."""
    ended = str(run.outcome["outcome"])
    return "" if ended == "completed" else f": {ended}, {run.outcome['message']}"
