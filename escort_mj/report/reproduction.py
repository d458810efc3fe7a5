"""The paper's figures, drawn from the run folders of its simulations under the paper's numbers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from mpl_toolkits.mplot3d.axes3d import Axes3D

from escort_mj import palette
from escort_mj.record.folder import read_run
from escort_mj.record.recording import Recorded
from escort_mj.report.figures import nearness, paths, timelines
from escort_mj.report.figures.drawing.curves import log_ticks, running_rms
from escort_mj.report.figures.drawing.style import FAILED, WIDTH, figure
from escort_mj.study.compare.measured import QUANTITIES, Measured
from escort_mj.study.compare.reproduction import CASES, LAWS, READINGS, SHOWN, PaperFigure, PaperRun

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from escort_mj.record.folder import StoredRun

VISIBLE = 0.03  # of what a figure spans: runs that stay closer to each other look alike
LOUDER = 1.5  # times: tracking errors that differ by less look alike
AT_ONCE = 0.02  # [s], one sample: where a logarithmic scale puts zero
ZOOM = 1.18  # of a view in space
HEADROOM = 0.35  # inches, for the reading's name over each of two
COLORS = {law: palette.from_hex(code) for law, code in zip(LAWS, ("0072B2", "D55E00", "7A7A7A"), strict=True)}
MARKS = {"unlimited": "^", "limited": "s", "anti_windup": "o"}
COMPARED = ("tracking_time", "settling_time", "radius_error", "true_e_rms", "e_dot_rms", "force_rms")


class Kind(NamedTuple):
    """How a kind of figure is drawn: its height in inches for a trace, and the drawing itself."""

    words: str
    height: Callable[[Recorded, float], float]
    draw: Callable[[Any, Recorded], None]


def draw_reproduction(folder: Path, runs: Sequence[Measured], shown: PaperFigure) -> Path:
    """Draw one figure into `figures/` and return its file.

    Args:
        folder: That of the reproduction.
        runs: What was measured, for the comparison of the laws.
        shown: Which figure.

    Raises:
        RunFolderError: If a run that it shows is missing.
    """
    path = folder / "figures" / f"{shown.file}.png"
    if shown.kind == "laws":
        with figure(path, 8.2, "The laws compared, case by case") as canvas:
            compare_laws(canvas, runs)
        return path
    stored = {reading: read_run(folder / PaperRun(shown.case, shown.law, reading).name) for reading in SHOWN}
    first, second = (stored[reading] for reading in SHOWN)
    if not differ(first.trace, second.trace, shown.kind):
        del stored[SHOWN[1]]
    kind = _kind(shown.kind, first.trace)
    title = f"Fig. {shown.key}: {LAWS[shown.law]}, {CASES[shown.case]}: {kind.words}"
    height = max(kind.height(run.recording, WIDTH) for run in stored.values()) + HEADROOM
    with figure(path, height, title, width=WIDTH * len(stored)) as canvas:
        parts = canvas.subfigures(1, len(stored), wspace=0.03, squeeze=False)[0]
        for part, (reading, run) in zip(parts, stored.items(), strict=True):
            part.suptitle(READINGS[reading].words + _ending(run), fontsize=9.0, color=_ink(run))
            kind.draw(part, run.recording)
            for axes in part.axes:
                if isinstance(axes, Axes3D):  # its labels need more room in half of a figure
                    limits = np.array([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()])
                    axes.set_box_aspect(np.ptp(limits, axis=1), zoom=ZOOM)
        if shown.kind != "paths" and all(run.outcome["outcome"] == "completed" for run in stored.values()):
            _same_scales([part.axes for part in parts])
    return path


def differ(one: Recorded, other: Recorded, kind: str) -> bool:
    """Whether two readings of one simulation look different.

    Args:
        one: A trace.
        other: Another of the same scenario but for its reading.
        kind: The figure's kind: what it spans, and whether it shows tracking errors.
    """
    if one.sizes["time"] != other.sizes["time"]:
        return True
    low, high = paths.bounds(one)
    span = float((high - low).max()) if kind == "paths" else 2.0 * float(one.attrs["mission_radius"])
    apart = np.linalg.norm(one["q"].values - other["q"].values, axis=2)
    if kind == "obstacles":  # far from obstacles nothing is shown
        shown = one["obstacle_distance"].values.min(axis=2) < span
        apart = apart[shown] if shown.any() else apart
    if apart.max() > VISIBLE * span:
        return True
    time = one["time"].values
    for name in ("e", "e_dot") if kind == "panels" else ():
        # What the bold curves show: the loudest robot's running rms.
        sizes = [np.linalg.norm(trace[name].values, axis=2).T for trace in (one, other)]
        loudest = [np.max([running_rms(time, curve) for curve in curves], axis=0) + 1e-6 for curves in sizes]
        ratio = loudest[0] / loudest[1]
        if max(ratio.max(), 1 / ratio.min()) > LOUDER:
            return True
    return False


def _same_scales(parts: Sequence[Sequence[Axes]]) -> None:
    """The same scale for the same panel of each part, so that they can be compared by eye."""
    for panels in zip(*parts, strict=True):
        low, high = zip(*(axes.get_ylim() for axes in panels), strict=True)
        inverted = low[0] > high[0]
        for axes in panels:
            axes.set_ylim((max if inverted else min)(low), (min if inverted else max)(high))
            if axes.get_yscale() == "log":
                log_ticks(axes, max(high) / min(low))


def compare_laws(canvas: Figure, runs: Sequence[Measured]) -> None:
    """One panel per quantity: cases from left to right, a color per law, a mark per reading."""
    grid = canvas.subplots(3, 2, sharex=True)
    heads = {
        "tracking_time": "Tracking time, |e| < 1 % of R (lowest: 0)",
        "settling_time": "Settling time, 5 % of R",
        "radius_error": "Tail error of the radius",
        "true_e_rms": "Tail rms |e|, without noise",
        "e_dot_rms": "Tail rms |ė|",
        "force_rms": "Tail rms force",
    }
    for axes, name in zip(grid.ravel(), COMPARED, strict=True):
        axes.set_title(heads[name])
        axes.set_ylabel(QUANTITIES[name].unit)
        _scatter(axes, name, runs)
    for axes in grid[-1]:
        names = [words.replace(", ", "\n") for words in CASES.values()]
        axes.set_xticks(range(len(CASES)), names, fontsize=6.5)
    dot: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 5}
    keys = [(LAWS[law], Line2D([], [], **dot, color=color)) for law, color in COLORS.items()]
    for reading, mark in MARKS.items():
        hollow = Line2D([], [], **(dot | {"marker": mark}), color="#555555", markerfacecolor="white")
        keys.append((READINGS[reading].words, hollow))
    keys.append(("never, or diverged", Line2D([], [], **(dot | {"marker": "x"}), color="#555555")))
    words, handles = zip(*keys, strict=True)
    canvas.legend(handles, words, loc="outside lower center", ncols=4, columnspacing=1.3)


def _scatter(axes: Axes, name: str, runs: Sequence[Measured]) -> None:
    """One quantity of every run; what has no finite value stands as a cross on top."""
    for column in range(1, len(CASES)):
        axes.axvline(column - 0.5, color="#E3E5E8", linewidth=0.6)
    axes.grid(axis="x", visible=False)
    top = axes.get_xaxis_transform()
    for run in runs:
        case, law, reading = run.simulation
        place = list(LAWS).index(law) * len(READINGS) + list(READINGS).index(reading)
        x = list(CASES).index(case) + (place - 4 + 0.6 * (place // 3 - 1)) * 0.095
        value = run.values[name]
        if value is None or not np.isfinite(value):
            axes.plot(x, 0.965, "x", transform=top, color=COLORS[law], markersize=4, clip_on=False)
        else:
            value = max(value, AT_ONCE) if QUANTITIES[name].unit == "s" else value
            axes.plot(x, value, MARKS[reading], color=COLORS[law], markersize=3.4, markerfacecolor="white")
    axes.set_yscale("log")
    axes.set_xlim(-0.55, len(CASES) - 0.45)
    low, high = axes.get_ylim()
    axes.set_ylim(low, high * (high / low) ** 0.1)
    log_ticks(axes, (high / low) ** 1.1)


def _kind(name: str, trace: Recorded) -> Kind:
    if name == "panels":
        return Kind("distances and tracking errors", timelines.panels_height, timelines.panels)
    if name == "obstacles":
        height = nearness.obstacle_distances_height
        return Kind("distances to obstacles", height, nearness.obstacle_distances)
    if trace.sizes["axis"] == 2:
        return Kind("paths", paths.plan_height, paths.plan_view)
    return Kind("paths", paths.space_height, paths.space_view)


def _ending(run: StoredRun) -> str:
    """What a reader must know of a run that did not end well."""
    ended = str(run.outcome["outcome"])
    return "" if ended == "completed" else f": {ended}, {run.outcome['message']}"


def _ink(run: StoredRun) -> Any:
    return "#222222" if run.outcome["outcome"] == "completed" else FAILED
