"""Colors of teams: of robots while they are in one, and of its targets; and what is drawn of targets."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle
from numpy.typing import NDArray

from escort_mj import palette
from escort_mj.record.recording import Recorded
from escort_mj.record.team import kept_radius, team_names
from escort_mj.report.figures.drawing.style import Key, legend, name_robots

Array = NDArray[np.float64]
SMALL, LARGE = 4.5, 7.0  # of marks, where another team escorts a target, and at the end [points]


def colors_at(trace: Recorded, sample: int) -> list[palette.Color]:
    """Return the color of each robot at a sample: its own, or that of its team."""
    if "member_of" not in trace:
        return palette.robot_colors(trace.sizes["robot"])
    return [palette.team_color(int(number) - 1) for number in trace["member_of"].values[sample]]


def colored(
    trace: Recorded, robot: int, rows: NDArray[np.int64]
) -> Iterator[tuple[palette.Color, NDArray[np.int64]]]:
    """Yield the parts of a robot's way, by its index: their color and samples, out of some samples."""
    if "member_of" not in trace or not len(rows):
        yield palette.robot_color(robot, trace.sizes["robot"]), rows
        return
    team = trace["member_of"].values[rows, robot]
    for first, end in pairwise([0, *(np.flatnonzero(np.diff(team)) + 1).tolist(), len(rows)]):
        yield palette.team_color(int(team[first]) - 1), rows[first : end + 1]


def recorded_targets(trace: Recorded) -> list[int]:
    """Return which obstacles are targets of teams at any time, from 0."""
    if "member_of" not in trace:
        return []
    return np.flatnonzero(trace["obstacle_team"].values.any(axis=0)).tolist()


def way_of_escort(trace: Recorded) -> tuple[Array, float]:
    """Return where the target is, or the middle of the first team's ones, and how far robots keep [m]."""
    if "member_of" in trace:
        return trace["team_center"].values[:, 0], float(trace["team_radius"].values.max())
    return trace["target_position"].values, float(kept_radius(trace).max())


def draw_teams(axes: Axes, trace: Recorded, rows: NDArray[np.int64], moments: list[int]) -> None:
    """Draw ways of targets, with marks at their ends and where they change teams, and in a plan circles.

    Args:
        axes: Where to draw.
        trace: Of the run.
        rows: Samples of ways.
        moments: Samples of circles.
    """
    for target in recorded_targets(trace):
        team, way = trace["obstacle_team"].values[:, target], trace["obstacle_position"].values[:, target]
        axes.plot(*way[rows].T, color=palette.TARGET, linewidth=1.4, zorder=3)
        changes = np.flatnonzero(np.diff(team)) + 1
        for sample, size in [*((change, SMALL) for change in changes.tolist()), (-1, LARGE)]:
            look: dict[str, Any] = {"markeredgecolor": palette.TARGET, "markersize": size, "zorder": 4.1}
            axes.plot(*way[sample][:, None], "D", color=palette.target_color(int(team[sample])), **look)
    for number in range(len(team_names(trace)) if trace.sizes["axis"] == 2 else 0):
        rim: dict[str, Any] = {"fill": False, "color": palette.team_color(number), "linewidth": 0.8}
        for moment in moments:
            center, radius = (trace[f"team_{each}"].values[moment, number] for each in ("center", "radius"))
            axes.add_patch(Circle(center, radius, **rim, linestyle=(0, (1, 2)), zorder=1.2))


def name_all(figure: Figure, axes: Iterable[Axes], trace: Recorded, others: Sequence[Key]) -> None:
    """Say which color is which robot or team; arguments as of `name_robots`."""
    names = team_names(trace)
    if not names:
        name_robots(figure, axes, trace.sizes["robot"], others, one_by_one=True)
        return
    keys: list[Key] = [
        (name, Line2D([], [], color=palette.team_color(number), linewidth=2.0))
        for number, name in enumerate(names)
    ]
    mark: dict[str, Any] = {"marker": "D", "markerfacecolor": "white", "markersize": 5}
    keys.append(("target", Line2D([], [], color=palette.TARGET, **mark)))
    if (trace["obstacle_team"].values[:, recorded_targets(trace)] == 0).any():
        mark["markerfacecolor"] = palette.target_color(0)
        keys.append(("without a team", Line2D([], [], color=palette.TARGET, **mark)))
    legend(figure, [*keys, *others])
