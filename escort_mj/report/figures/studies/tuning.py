"""Figures of tuning: how it went, and what can be had of one objective for another."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from escort_mj.report.figures.drawing.style import figure
from escort_mj.study.search.tuned import Tuned, TunedPoint
from escort_mj.study.sweeps.searches import Objective, Tune

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
        for place, (axes, objective) in enumerate(zip(rows, search.objectives, strict=True)):
            for kept, color, words in ((False, BROKEN, "breaks a constraint"), (True, KEPT, "keeps them")):
                points = [
                    (number, trial.values[place])
                    for number, trial in enumerate(found.trials, 1)
                    if trial.values is not None and trial.feasible == kept
                ]
                if points:
                    axes.plot(*zip(*points, strict=True), "o", color=color, markersize=3.0, label=words)
            if found.own.values is not None:
                axes.axhline(found.own.values[place], color=OWN, linestyle="--", label="the scenario's own")
            sign = 1.0 if objective.goal == "minimize" else -1.0
            best = np.minimum.accumulate(
                [
                    sign * t.values[place] if t.values is not None and t.feasible else np.inf
                    for t in found.trials
                ]
            )
            reached = np.isfinite(best)
            numbers = np.arange(1, len(best) + 1)
            axes.step(numbers[reached], sign * best[reached], where="post", color=KEPT, label="best so far")
            axes.set_title(f"{objective.words}, to {objective.goal}")
            axes.set_ylabel(_labelled(objective))
            _scale(axes, [t.values[place] for t in found.trials if t.values is not None], "y")
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
            _scale(axes, [t.values[place] for t in found.trials if t.values is not None], name)
        canvas.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return path


def _scale(axes: Axes, values: Sequence[float], name: str) -> None:
    """A logarithmic axis where values lie far apart."""
    if values and min(values) > 0.0 and max(values) > SPREAD * min(values):
        getattr(axes, f"set_{name}scale")("log")


def _labelled(objective: Objective) -> str:
    """An objective with its unit, where that is known: it is not of a plugin's metric."""
    return f"{objective.words} [{objective.unit}]" if objective.unit else objective.words
