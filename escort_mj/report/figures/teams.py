"""Colors of teams, and what is drawn of their targets and of opponents."""

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
from escort_mj.components.movers import COMES, INTERCEPTED, REACHED
from escort_mj.record.recording import Recorded
from escort_mj.record.team import kept_radius, team_names
from escort_mj.report.figures.drawing.curves import BOUND
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


MARKS = {INTERCEPTED: ("intercepted", "X"), REACHED: ("reached the target", "*")}
SIZE = 8.0  # of a mark [points]


def opponents(trace: Recorded) -> NDArray[np.int64]:
    """Return which obstacles opponents are, the last ones, from 0."""
    count = trace.sizes.get("opponent", 0) if "opponent_status" in trace else 0
    return np.arange(trace.sizes["obstacle"] - count, trace.sizes["obstacle"])


def draw_opponents(axes: Axes, trace: Recorded, rows: NDArray[np.int64]) -> None:
    """Draw how opponents came, faintly how they left, and where robots or they themselves succeeded.

    Args:
        axes: Of a plan, or a view in space.
        trace: Of any mission.
        rows: Samples to draw, shape (samples,).
    """
    for number, obstacle in enumerate(opponents(trace)):
        way, status = (
            trace["obstacle_position"].values[:, obstacle],
            trace["opponent_status"].values[:, number],
        )
        look: dict[str, Any] = {"color": palette.OPPONENT, "zorder": 3.3}
        axes.plot(*way[rows[status[rows] <= COMES]].T, linewidth=1.3, **look)
        axes.plot(*way[rows[status[rows] > COMES]].T, linewidth=0.9, alpha=0.5, linestyle=BOUND, **look)
        axes.plot(*way[0][:, None], "o", markersize=5.0, markerfacecolor="white", **look)
        for end, (_, mark) in MARKS.items():
            when = np.flatnonzero(status == end)[:1]
            axes.plot(*way[when].T, mark, markersize=SIZE, markeredgecolor="white", **look | {"zorder": 4.1})


def opponent_keys(trace: Recorded) -> list[Key]:
    """Legend entries of opponents, and of what became of any of them."""
    if not len(opponents(trace)):
        return []
    keys: list[Key] = [("opponent", Line2D([], [], color=palette.OPPONENT))]
    for end, (word, mark) in MARKS.items():
        if (trace["opponent_status"].values == end).any():
            look: dict[str, Any] = {"linestyle": "none", "marker": mark, "markeredgecolor": "white"}
            keys.append((word, Line2D([], [], color=palette.OPPONENT, markersize=SIZE, **look)))
    return keys
