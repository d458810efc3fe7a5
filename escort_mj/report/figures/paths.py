"""Where everyone went: a plan of a planar mission, or a view in space."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch, Polygon
from matplotlib.patheffects import Normal, Stroke
from matplotlib.ticker import MaxNLocator, MultipleLocator
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection
from mpl_toolkits.mplot3d.axes3d import Axes3D
from numpy.typing import NDArray

from escort_mj import palette
from escort_mj.metrics.reading import escorts, lost
from escort_mj.palette import LOST, MOST_DISTINCT, MOST_LINES
from escort_mj.record.recording import Recorded
from escort_mj.record.team import kept_radius, rings
from escort_mj.report.figures import teams
from escort_mj.report.figures.drawing.curves import BOUND
from escort_mj.report.figures.drawing.style import WIDTH, Key, fit_marks, narrow, room_in_space
from escort_mj.report.figures.knowledge import estimate_ways, known_keys, mark_known
from escort_mj.report.figures.links import links, links_at, lost_keys
from escort_mj.report.figures.teams import draw_opponents, opponent_keys, opponents
from escort_mj.report.video.cuts import behind, cut
from escort_mj.report.video.replay import borders, outlines, safe_radius
from escort_mj.scenario.geometry.shapes import OUTLINE_POINTS, outward

Array = NDArray[np.float64]

MOMENTS = 5  # at which the formation is drawn
POINTS = 4000  # of a path at most
ESCORT = (0.45, 0.50, 0.56)
FORBIDDEN: dict[str, Any] = {"color": palette.CONTACT, "linewidth": 0}  # what is behind a border
RANGE = 1e7  # [m]; a run that diverged farther is cut there


def bounds(trace: Recorded) -> tuple[Array, Array]:
    """Lower and upper corner of everything that happens, shape (axes,) each [m]."""
    target, radius = trace["target_position"].values, kept_radius(trace).max(axis=1, keepdims=True)
    parts = [trace["q"].values[~lost(trace)]]
    if escorts(trace):
        parts += [target - radius, target + radius]
    if "goal" in trace:
        parts.append(trace["goal"].values.reshape(-1, trace.sizes["axis"]))
    came = opponents(trace)
    parts.append(trace["obstacle_position"].values[:, came].reshape(-1, trace.sizes["axis"]))
    if trace.sizes["obstacle"]:
        reach = np.maximum(safe_radius(trace).max(axis=0), trace["obstacle_radius"].values)[:, None]
        for center in trace["obstacle_position"].values[[0, -1]]:
            around = (center[:, None] + outlines(trace)[..., : center.shape[1]]).reshape(-1, center.shape[1])
            parts += [center - reach, center + reach, around]
    every = np.clip(np.concatenate(parts), -RANGE, RANGE)
    return np.nanmin(every, axis=0), np.nanmax(every, axis=0)  # nobody knows where a body was that is NaN


def plan_height(trace: Recorded, width: float = WIDTH) -> float:
    """Height of a figure whose plan view fills its width [inches]."""
    low, high = bounds(trace)
    shape = (high[1] - low[1]) / max(high[0] - low[0], 1e-9)
    wide = width - (0.6 if trace.sizes["robot"] <= MOST_DISTINCT else 1.4)
    return float(np.clip(wide * shape, 1.2, 5.0)) + 1.4


def plan_view(figure: Figure, trace: Recorded) -> None:
    """Paths on the plane: equal axes, obstacles to scale, the formation at a few moments."""
    axes = figure.subplots()
    moments = _moments(trace)
    _plan(axes, trace, moments)
    _words(axes, trace, moments)
    teams.name_all(figure, [axes], trace, _keys(trace, _borders(trace)))
    fit_marks(figure)


def space_height(trace: Recorded, width: float) -> float:
    """Height of `space_view` [inches]."""
    return 1.2 + 4.0 * min(width / WIDTH, 1.0)


def _plan(axes: Axes, trace: Recorded, moments: list[int]) -> None:
    """Paths along the two axes of a trace, with the formations at some samples."""
    low, high = bounds(trace)
    span = float((high - low).max())
    margin, step = 0.03 * span, _step(span)
    low, high = low - margin, high + margin
    across, up = trace["axis"].values
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel=f"{across} [m]", ylabel=f"{up} [m]")
    axes.set_aspect("equal", anchor="S")  # its label stays where the layout puts it
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MultipleLocator(step))

    for way, radius, clear, points in _obstacles(trace):
        _obstacle(axes, way, radius, clear, points[:, :2])

    for _, point, normal in _borders(trace):
        axes.add_patch(Polygon(behind(point, normal, low, high), **FORBIDDEN, alpha=0.1, zorder=0.8))
        axes.plot(*cut(point, normal, low, high).T, color=palette.CONTACT, linewidth=1.2, zorder=1.1)

    target = trace["target_position"].values
    rim: dict[str, Any] = {"fill": False, "color": ESCORT, "linewidth": 0.8, "linestyle": (0, (1, 2))}
    for moment in moments if escorts(trace) else ():
        for radius in rings(kept_radius(trace)[moment], lost(trace)[moment]):
            axes.add_patch(Circle(target[moment], radius, **rim, zorder=1.2))
    _everyone(axes, trace, moments)


def _everyone(axes: Any, trace: Recorded, moments: list[int]) -> None:
    """Ways of all that moves, with the formations at some samples, in the plane or in space."""
    rows = _rows(trace.sizes["time"])
    _formations(axes, trace, moments)
    if escorts(trace):
        way = trace["target_position"].values[rows]
        axes.plot(*way.T, color=palette.TARGET, linewidth=1.4, zorder=3)
    _goals(axes, trace)
    draw_opponents(axes, trace, rows)
    teams.draw_teams(axes, trace, rows, moments)
    _ways(axes, trace, rows)
    _ends(axes, trace)


def _goals(axes: Axes, trace: Recorded) -> None:
    """A square at each robot's last goal."""
    if "goal" not in trace or trace.sizes["robot"] > MOST_LINES:
        return
    for goal, color in zip(trace["goal"].values[-1], teams.colors_at(trace, -1), strict=True):
        axes.plot(*goal[:, None], "s", color=color, markersize=8, markerfacecolor="none", zorder=3.5)


def _obstacles(trace: Recorded) -> list[tuple[Array, float, float, Array]]:
    """Way, radius, safe distance and outline of plain obstacles, see `_obstacle`."""
    ways, safe = trace["obstacle_position"].values, safe_radius(trace).max(axis=0, initial=0.0)
    radii, around = trace["obstacle_radius"].values, outlines(trace)
    others = {*opponents(trace).tolist(), *teams.recorded_targets(trace)}
    plain = [j for j in range(trace.sizes["obstacle"]) if j not in others]
    return [(ways[:, j], float(radii[j]), float(safe[j]), around[j]) for j in plain]


def _obstacle(axes: Axes, way: Array, radius: float, clear: float, points: Array) -> None:
    """An obstacle of a plan where it ends, with what keeps robots off it; where it moved also its way.

    Args:
        axes: Where to draw.
        way: Its center at the samples, shape (T, 2) [m].
        radius: Of a circle, 0 for another outline [m].
        clear: How near avoidance lets a robot's center come to a circle's center, or to the outline [m].
        points: Its outline relative to its center, shape (k, 2) [m]; not looked at where it is a circle.
    """

    def around(center: Array, beyond: float, **look: Any) -> None:
        if radius > 0.0:
            axes.add_patch(Circle((center[0], center[1]), beyond or radius, **look))
        else:
            axes.add_patch(Polygon(center + points + beyond * outward(2), closed=True, **look))

    start, end = way[0], way[-1]
    if (way != start).any():
        axes.plot(*way[_rows(len(way))].T, color=palette.OBSTACLE, linewidth=1.0, linestyle=BOUND, zorder=1.9)
        around(start, 0.0, color=palette.OBSTACLE, alpha=0.3, linewidth=0, zorder=1.8)
    around(end, 0.0, color=palette.OBSTACLE, linewidth=0, zorder=2)
    if clear > 0:
        around(end, clear, color=palette.CONTACT, alpha=0.06, linewidth=0, zorder=0.9)
        rim = {"fill": False, "color": palette.CONTACT, "linestyle": BOUND, "linewidth": 0.9}
        around(end, clear, **rim, zorder=1.0)


def space_view(figure: Figure, trace: Recorded) -> None:
    """Paths along x, y, z, seen from the side of the target's way, with their shadows below."""
    planes, trace = _borders(trace), trace.isel(axis=range(3))
    axes: Any = figure.add_subplot(projection="3d", computed_zorder=False)
    low, high = bounds(trace)
    middle, half = (low + high) / 2, np.maximum((high - low) / 2 * 1.03, 1e-3)
    for name, center, size in zip("xyz", middle, half, strict=True):
        getattr(axes, f"set_{name}lim")(center - size, center + size)
        getattr(axes, f"set_{name}label")(f"{name} [m]", labelpad=9.0 if name == "x" else 2.0)
        getattr(axes, f"{name}axis").set_pane_color((0.97, 0.975, 0.98, 1.0))
        ticks = int(np.clip(round((4 if narrow(figure) else 7) * size / half.max()), 2, 7))
        getattr(axes, f"{name}axis").set_major_locator(MaxNLocator(ticks))
    zoom = 1.05 + 0.3 * max(2.0 * half[0] / np.linalg.norm(half) - 1.0, 0.0)
    axes.set_box_aspect(half.copy(), zoom=zoom)  # it scales what it is given
    axes.view_init(elev=22, azim=-62)
    floor = middle[2] - half[2]
    for _, point, normal in planes:
        rim = cut(point, normal, middle - half, middle + half)
        axes.add_collection3d(Poly3DCollection([rim], **FORBIDDEN, alpha=0.1, zorder=0.8))
        axes.plot(*rim[[*range(len(rim)), 0]].T, color=palette.CONTACT, linewidth=1.2, zorder=0.9)

    q, target = trace["q"].values, trace["target_position"].values
    rows, count = _rows(len(q)), q.shape[1]
    colors = teams.colors_at(trace, 0)
    for index, color in enumerate(colors if count <= MOST_LINES else ()):
        x, y, _ = np.clip(q[rows, index][~lost(trace)[rows, index]], -RANGE, RANGE).T
        axes.plot(x, y, floor, color=color, linewidth=0.5, alpha=0.25, zorder=1)
    for way, radius, clear, points in _obstacles(trace):
        center = way[-1]
        if (way != center).any():
            axes.plot(*way[rows].T, color=palette.OBSTACLE, linewidth=1.0, linestyle=BOUND, zorder=1.9)
        if radius == 0.0:
            _solid(axes, center + points, palette.OBSTACLE, 1.0, 2.1)
            if clear > 0:
                _solid(axes, center + points + clear * outward(3), palette.CONTACT, 0.08, 2.0)
            continue
        if clear > 0:
            _ball(axes, center, clear, palette.CONTACT, 0.08, 2.0)
        _ball(axes, center, radius, palette.OBSTACLE, 1.0, 2.1)
    moments = sorted({_moments(trace)[(len(_moments(trace)) - 1) // 2], len(q) - 1})
    for moment in moments if escorts(trace) else ():
        for radius in rings(kept_radius(trace)[moment], lost(trace)[moment]):
            _globe(axes, target[moment], radius)
    _everyone(axes, trace, moments)
    for artist in (*axes.lines, *axes.collections):
        artist.set_clip_on(False)  # a long mission may be wider than the square that 3-D axes reserve
        artist.set_in_layout(False)
    teams.name_all(figure, [axes], trace, _keys(trace, planes))
    fit_marks(figure)
    axes.set_box_aspect(half, zoom=zoom * room_in_space(figure, axes))


def _step(span: float) -> float:
    """A round distance between ticks, the same along every axis of a plan [m]."""
    steps = MaxNLocator(12, steps=[1, 2, 5, 10]).tick_values(0.0, span)
    return float(steps[1] - steps[0])


def _width(count: int) -> float:
    return 1.3 if count <= MOST_DISTINCT else 0.7


def _rows(samples: int) -> NDArray[np.int64]:
    return np.unique(np.linspace(0, samples - 1, min(samples, POINTS)).astype(np.int64))


def _moments(trace: Recorded) -> list[int]:
    """Samples at which to draw the formation: fewer where the circles would lie on each other."""
    target, radius = teams.way_of_escort(trace)
    traveled = float(np.linalg.norm(np.diff(target, axis=0), axis=1).sum())
    count = int(np.clip(1 + traveled // (0.8 * radius), 1, MOMENTS))
    return np.linspace(0, len(target) - 1, count + 1).astype(int)[1:].tolist()


def _formations(axes: Axes, trace: Recorded, moments: list[int]) -> None:
    """Links between neighbors and the robots' places at a few moments; of a crowd also where it starts."""
    q, gone, formations = np.clip(trace["q"].values, -RANGE, RANGE), lost(trace), links(trace)
    crowd = q.shape[1] > MOST_LINES
    for moment in [0, *moments] if crowd else moments:
        pairs = q[moment][links_at(formations, moment)]
        if not crowd:
            mark_known(axes, trace, moment)
        if len(pairs) and not crowd and "heard_from" not in trace:
            look: dict[str, Any] = {"colors": [ESCORT], "linewidths": 0.7, "alpha": 0.7, "zorder": 2.5}
            lines = Line3DCollection if q.shape[2] == 3 else LineCollection
            axes.add_collection(lines(pairs, **look))
        if crowd:
            here = ~gone[moment]
            colors = np.array(teams.colors_at(trace, moment))[here]
            dots: dict[str, Any] = {"s": 4.0, "linewidths": 0, "zorder": 3.6, "c": colors}
            axes.scatter(*q[moment, here].T, **dots)
        if crowd or moment == moments[-1] or q.shape[1] > MOST_DISTINCT:
            continue
        for index, color in enumerate(teams.colors_at(trace, moment)):
            if not gone[moment, index]:
                axes.plot(*q[moment, index][:, None], "o", color=color, markersize=3.0, zorder=3.6)


def _ways(axes: Axes, trace: Recorded, rows: NDArray[np.int64]) -> None:
    """Every robot's path, none of a crowd's; gray and faint from where it was lost, to the picture's rim."""
    q, gone = np.clip(trace["q"].values, -RANGE, RANGE), lost(trace)
    if q.shape[1] > MOST_LINES:
        return
    low, high = bounds(trace)
    width = _width(q.shape[1])
    for index in range(q.shape[1]):
        for color, kept in teams.colored(trace, index, rows[~gone[rows, index]]):
            axes.plot(*q[kept, index].T, color=color, linewidth=width, zorder=3.5)
        drift = q[rows[gone[rows, index]], index]
        if len(drift):
            outside = ((drift < low) | (drift > high)).any(axis=1)
            seen = drift[: int(np.argmax(outside)) if outside.any() else len(drift)]
            axes.plot(*seen.T, color=LOST, linewidth=0.8, zorder=3.4)
    estimate_ways(axes, trace, rows, low, high)


def _ends(axes: Axes, trace: Recorded) -> None:
    """Start and end of every path."""
    q, target = np.clip(trace["q"].values, -RANGE, RANGE), trace["target_position"].values
    size = 6.5 if q.shape[1] <= MOST_DISTINCT else 3.5
    known = (~lost(trace)).sum(axis=0)
    colors = [teams.colors_at(trace, moment) if q.shape[1] <= MOST_LINES else () for moment in (0, -1)]
    for path, first, color, scale in [
        *[(target, palette.TARGET, palette.TARGET, 1.1)] * escorts(trace),
        *((q[: known[i] or 1, i], *both, 1.0) for i, both in enumerate(zip(*colors, strict=True))),
    ]:
        start, end = path[0][:, None], path[-1][:, None]
        axes.plot(
            *start, "o", color="white", markeredgecolor=first, markersize=0.75 * size * scale, zorder=3.8
        )
        shape = "o" if len(path) == len(q) else "x"
        (mark,) = axes.plot(*end, shape, color=color, markersize=size * scale, zorder=4.0, clip_on=False)
        mark.set_in_layout(False)


def _words(axes: Axes, trace: Recorded, moments: list[int]) -> None:
    """The time of each formation, beside its target."""
    for moment in moments if escorts(trace) else ():
        place = trace["target_position"].values[moment]
        axes.plot(*place[:, None], "o", color=palette.TARGET, markersize=3.0, zorder=3.1)
        axes.annotate(
            f"{float(trace['time'][moment]):.4g} s",
            place,
            xytext=(0, 6),
            textcoords="offset points",
            ha="center",
            fontsize="small",
            color="#333333",
            zorder=5,
            path_effects=[Stroke(linewidth=2.0, foreground="white"), Normal()],
        )


def _borders(trace: Recorded) -> list[tuple[str, Array, Array]]:
    """Behavior, point and normal of the lines or planes that robots do not cross, those within the bounds."""
    planes = borders(trace)
    if not len(planes):
        return []
    box, names = bounds(trace), map(str, trace["border"].values)
    found = [(name, point, normal) for name, (point, normal) in zip(names, planes, strict=True)]
    return [plane for plane in found if len(cut(*plane[1:], *box))]


def _keys(trace: Recorded, planes: list[tuple[str, Array, Array]]) -> list[Key]:
    """Legend entries of what is no robot."""
    dot: dict[str, Any] = {"linestyle": "none", "marker": "o"}
    keys: list[Key] = [
        ("start", Line2D([], [], **dot, color="#555555", markerfacecolor="white", markersize=5)),
        ("end", Line2D([], [], **dot, color="#555555", markersize=6.5)),
    ]
    if escorts(trace):
        keys.insert(0, ("target", Line2D([], [], color=palette.TARGET)))
        keys.append(("escort radius", Line2D([], [], color=ESCORT, linestyle=(0, (1, 2)))))
    if "goal" in trace:
        square = {"linestyle": "none", "marker": "s", "markerfacecolor": "none", "markersize": 7}
        keys.append(("goal", Line2D([], [], **square, color="#555555")))  # type: ignore[arg-type]
    keys += known_keys(trace) + lost_keys(trace)
    keys += opponent_keys(trace)
    if _obstacles(trace):
        keys.append(("obstacle", Line2D([], [], **dot, color=palette.OBSTACLE, markersize=7)))
        if float(trace.attrs["safe_distance"]) > 0:
            rim = Line2D([], [], color=palette.CONTACT, linestyle=BOUND)
            shade = Patch(color=palette.CONTACT, alpha=0.15, linewidth=0)
            keys.append(("safe distance", shade if trace.sizes["axis"] == 3 else rim))
    for name in dict.fromkeys(name for name, *_ in planes):
        rim = Line2D([], [], color=palette.CONTACT, linewidth=1.2)
        keys.append((name.replace("_", " "), (Patch(**FORBIDDEN, alpha=0.15), rim)))
    return keys


def _sphere(center: Array, radius: float, fine: int) -> tuple[Array, Array, Array]:
    around, down = np.meshgrid(np.linspace(0, 2 * np.pi, 2 * fine + 1), np.linspace(0, np.pi, fine + 1))
    unit = np.sin(down) * np.cos(around), np.sin(down) * np.sin(around), np.cos(down)
    x, y, z = (c + radius * u for c, u in zip(center, unit, strict=True))
    return x, y, z


def _ball(
    axes: Axes3D, center: Array, radius: float, color: palette.Color, alpha: float, zorder: float
) -> None:
    looks: dict[str, Any] = {"color": color, "alpha": alpha, "linewidth": 0, "zorder": zorder, "shade": False}
    axes.plot_surface(*_sphere(center, radius, 16), **looks, rstride=1, cstride=1)


def _solid(axes: Axes3D, points: Array, color: palette.Color, alpha: float, zorder: float) -> None:
    """A shape by the points around it, lit from the side, or an even halo of it."""
    grid = points.reshape(*OUTLINE_POINTS[3], 3)
    looks: dict[str, Any] = {"color": color, "alpha": alpha, "linewidth": 0, "zorder": zorder}
    axes.plot_surface(*np.moveaxis(grid, -1, 0), **looks, shade=alpha == 1.0)


def _globe(axes: Axes3D, center: Array, radius: float) -> None:
    """The escort sphere as three great circles."""
    angle = np.linspace(0, 2 * np.pi, 91)
    ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle])
    for order in ([0, 1, 2], [0, 2, 1], [2, 0, 1]):
        x, y, z = center[:, None] + radius * ring[order]
        axes.plot(x, y, z, color=ESCORT, linewidth=0.8, linestyle=(0, (1, 2)), zorder=1.5)
