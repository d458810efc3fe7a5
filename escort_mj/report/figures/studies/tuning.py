"""Figures of tuning: how it went, and what can be had of one objective for another."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from escort_mj.report.figures.drawing.style import figure
from escort_mj.study.search.tuned import Tuned, TunedPoint
from escort_mj.study.sweeps.definition import Objective, Tune

KEPT, BROKEN, OWN, FRONT = "#3B6FB6", "#B9BEC6", "#B00020", "#1E7B4F"
SPREAD = 8.0  # largest value over the least beyond which an axis is logarithmic


def draw_tuning(out: Path, search: Tune, found: Tuned) -> list[Path]:
    """Draws how tuning went into its folder.

    Args:
        out: The folder.
        search: What was sought.
        found: What came of it.

    Returns:
        The files: `history.png`, and `front.png` where there are several objectives.
    """
    drawn = [_history(out / "history.png", search, found)]
    if len(search.objectives) > 1:
        drawn.append(_front(out / "front.png", search, found))
    return drawn


def _history(path: Path, search: Tune, found: Tuned) -> Path:
    """Each objective, trial by trial."""
    count = len(search.objectives)
    with figure(path, 1.0 + 2.2 * count, f"{len(found.trials)} trials by {search.method}") as canvas:
        rows = canvas.subplots(count, 1, sharex=True, squeeze=False)[:, 0]
        feasible, numbers = np.array([t.feasible for t in found.trials]), np.arange(1, len(found.trials) + 1)
        for axes, objective, values in zip(rows, search.objectives, _values(found, count).T, strict=True):
            known = ~np.isnan(values)
            for kept, color, words in ((False, BROKEN, "breaks a constraint"), (True, KEPT, "keeps them")):
                if (some := known & (feasible == kept)).any():
                    axes.plot(numbers[some], values[some], "o", color=color, markersize=3.0, label=words)
            if found.own.values is not None:
                own = found.own.values[search.objectives.index(objective)]
                axes.axhline(own, color=OWN, linestyle="--", label="the scenario's own")
            sign = 1.0 if objective.goal == "minimize" else -1.0
            best = np.minimum.accumulate(np.where(feasible, sign * values, np.inf))
            reached = np.isfinite(best)
            axes.step(numbers[reached], sign * best[reached], where="post", color=KEPT, label="best so far")
            axes.set(title=f"{objective.words}, to {objective.goal}", ylabel=_labelled(objective))
            _scale(axes, values[known], "y")
        rows[-1].set_xlabel("trial")
        handles, words = rows[0].get_legend_handles_labels()
        canvas.legend(handles, words, loc="outside lower center", ncols=4)
    return path


def _front(path: Path, search: Tune, found: Tuned) -> Path:
    """The first two objectives against each other."""
    first, second = search.objectives[:2]
    with figure(path, 4.2, f"{second.words} against {first.words}, {len(found.trials)} trials") as canvas:
        axes = canvas.subplots()
        on_front = set(found.front)
        groups: list[tuple[str, str, list[TunedPoint]]] = [
            ("breaks a constraint", BROKEN, [t for t in found.trials if not t.feasible]),
            ("keeps them", KEPT, [t for k, t in enumerate(found.trials) if t.feasible and k not in on_front]),
            ("the front", FRONT, [found.trials[k] for k in found.front]),
            ("the scenario's own", OWN, [found.own]),
        ]
        for words, color, trials in groups:
            points = [trial.values[:2] for trial in trials if trial.values is not None]
            if points:
                line = "o-" if words == "the front" and len(search.objectives) == 2 else "o"
                size = 3.0 if color in (KEPT, BROKEN) else 5.0
                axes.plot(*zip(*points, strict=True), line, color=color, markersize=size, label=words)
        for name, objective, place in (("x", first, 0), ("y", second, 1)):
            getattr(axes, f"set_{name}label")(f"{_labelled(objective)}, {objective.goal}")
            values = _values(found, len(search.objectives))[:, place]
            _scale(axes, values[~np.isnan(values)], name)
        canvas.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return path


def _values(found: Tuned, count: int) -> NDArray[np.float64]:
    """The objectives of each trial, shape (trials, count); NaN where it has none."""
    return np.array([trial.values or [np.nan] * count for trial in found.trials], dtype=np.float64)


def _scale(axes: Axes, values: NDArray[np.float64], name: str) -> None:
    """A logarithmic axis where values lie far apart."""
    if len(values) and values.min() > 0.0 and values.max() > SPREAD * values.min():
        getattr(axes, f"set_{name}scale")("log")


def _labelled(objective: Objective) -> str:
    """An objective with its unit, where that is known: it is not of a plugin's metric."""
    return f"{objective.words} [{objective.unit}]" if objective.unit else objective.words
