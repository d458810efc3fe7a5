"""How far a target or an opponent gets on straight lines before a robot can meet it: dominance regions."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Patch
from numpy.typing import NDArray

from escort_mj import palette
from escort_mj.components.movers import COMES
from escort_mj.metrics.reading import escorts, lost
from escort_mj.record.recording import Recorded
from escort_mj.report.figures import teams
from escort_mj.report.figures.drawing.look import NARROW
from escort_mj.report.figures.drawing.style import WIDTH, Key, narrow
from escort_mj.report.figures.paths import bounds
from escort_mj.report.figures.teams import opponents

Array = NDArray[np.float64]

MOMENTS, HEADINGS = 4, 721
LIGHT, EDGE = 0.18, 1.2  # opacity of a region, width of its edge


def has_sides(trace: Recorded) -> bool:
    """Whether a target with a policy, or an opponent, moves in the plane."""
    return trace.sizes["axis"] == 2 and ("target_speed" in trace.attrs or bool(len(opponents(trace))))


def dominance_height(trace: Recorded, width: float = WIDTH) -> float:
    """Height of the figure [inches]."""
    columns = 1 if width <= NARROW else 2
    low, high = _frame(trace)
    wide = width / columns - 0.8
    tall = float(np.clip(wide * (high[1] - low[1]) / (high[0] - low[0]), 1.2, 3.4)) + 0.8
    return tall * -(-MOMENTS // columns) + 0.8


def dominance(figure: Figure, trace: Recorded) -> None:
    """At four moments, how far the target, or an opponent, gets before a robot can meet it."""
    columns = 1 if narrow(figure) else 2
    grid = figure.subplots(-(-MOMENTS // columns), columns, sharex=True, sharey=True, squeeze=False)
    keys: list[Key] = []
    for place, (axes, moment) in enumerate(zip(grid.ravel(), _moments(trace), strict=True)):
        found = _draw(axes, trace, int(moment))
        keys += [key for key in found if key[0] not in [word for word, _ in keys]]
        time = float(trace["time"].values[moment])
        axes.set_title(f"({'abcd'[place]}) {time:.2f} s", loc="left")
    for axes, word in [*((each, "x") for each in grid[-1]), *((each, "y") for each in grid[:, 0])]:
        (axes.set_xlabel if word == "x" else axes.set_ylabel)(f"{word} [m]")
    teams.name_all(figure, grid.ravel(), trace, keys)


def robots_speed(trace: Recorded) -> float:
    """Return the mission's largest speed or, without a limit, the largest that a robot reached [m/s]."""
    return float(trace.attrs.get("max_speed", trace["speed_max"].values.max()))


def reaches(here: Array, robots: Array, ratio: float, headings: Array) -> Array:
    """Return how far a body gets on straight lines before a robot can meet it, shape (k,) [m].

    With d the vector from the body to a robot and u the unit vector of a heading, the robot is there as soon
    as the body after the length s with abs(s u - d) = ratio s (Isaacs, Differential Games, 1965).

    Args:
        here: Position of the body, shape (2,) [m].
        robots: Positions of the robots, shape (n, 2) [m].
        ratio: Speed of the robots over the body's.
        headings: Angles of the lines, shape (k,) [rad].
    """
    away = robots - here
    along = np.column_stack([np.cos(headings), np.sin(headings)]) @ away.T
    square = np.sum(away**2, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        whole = along + np.sqrt(along**2 - (1.0 - ratio**2) * square)
        lengths = np.where(whole > 0.0, square / whole, np.inf)
    return np.asarray(lengths.min(axis=1, initial=np.inf))


def _moments(trace: Recorded) -> NDArray[np.int64]:
    """Samples to draw: evenly spaced in the time in which opponents come, or in the whole run."""
    samples = np.arange(trace.sizes["time"])
    if len(opponents(trace)):
        coming = np.flatnonzero((trace["opponent_status"].values == COMES).any(axis=1))
        samples = coming if len(coming) else samples
    return samples[np.linspace(0, len(samples) - 1, MOMENTS).round().astype(int)]


def _frame(trace: Recorded) -> tuple[Array, Array]:
    """Lower and upper corner of every panel [m]."""
    low, high = bounds(trace)
    margin = 0.05 * float((high - low).max())
    return low - margin, high + margin


def _draw(axes: Axes, trace: Recorded, moment: int) -> list[Key]:
    """Draw the regions and bodies of a moment, and return what the legend says of them."""
    low, high = _frame(trace)
    robots = trace["q"].values[moment][~lost(trace)[moment]]
    headings, farthest = np.linspace(0.0, 2.0 * np.pi, HEADINGS), 2.0 * float(np.linalg.norm(high - low))
    keys: list[Key] = []

    def region(here: Array, speed: float, color: palette.Color, words: str) -> None:
        ratio = robots_speed(trace) / max(speed, 1e-9)
        length = np.minimum(reaches(here, robots, ratio, headings), farthest)[:, None]
        rim = here + length * np.column_stack([np.cos(headings), np.sin(headings)])
        axes.fill(*rim.T, facecolor=(*color, LIGHT), edgecolor=color, linewidth=EDGE)
        keys.append((words, Patch(facecolor=(*color, LIGHT), edgecolor=color)))

    came = opponents(trace)
    if len(came):
        came = came[trace["opponent_status"].values[moment] == COMES]
    there = trace["obstacle_position"].values[moment, came]
    for here, speed in zip(there, trace["obstacle_speed_max"].values[:, came].max(axis=0), strict=True):
        region(here, float(speed), palette.OPPONENT, "an opponent is first")
    target = trace["target_position"].values[moment]
    if "target_speed" in trace.attrs:
        region(target, float(trace.attrs["target_speed"]), palette.TARGET, "the target is first")
    axes.plot(*there.T, "^", color=palette.OPPONENT, markersize=6.0)
    for robot, color in zip(robots, _colors(trace, moment), strict=True):
        axes.plot(*robot[:, None], "o", color=color, markersize=5.0, markeredgecolor="white")
    for obstacle in teams.recorded_targets(trace):
        place = trace["obstacle_position"].values[moment, obstacle]
        color = palette.target_color(int(trace["obstacle_team"].values[moment, obstacle]))
        axes.plot(*place[:, None], "D", color=color, markersize=5.0, markeredgecolor=palette.TARGET)
    if escorts(trace):
        axes.add_patch(Circle(target, float(trace.attrs["target_radius"]), color=palette.TARGET))
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    return keys


def _colors(trace: Recorded, moment: int) -> list[palette.Color]:
    """Return the colors of the robots that are left at a moment."""
    colors, gone = teams.colors_at(trace, moment), lost(trace)[moment]
    return [color for color, away in zip(colors, gone, strict=True) if not away]
