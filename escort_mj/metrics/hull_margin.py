"""How deep the target lies inside the team: the margin of the robots' convex hull around it.

With the robots relative to the target at x_1 ... x_n, the margin is the minimum over unit vectors u of
max_i u . x_i: the distance to the nearest facet if the target is inside, minus the distance to the hull if it
is outside. The minimum is at the normal of a hyperplane through p robots or, outside, at the direction to the
point of a flat through p robots or fewer that is nearest to the target. Any other direction gives more: no
candidate has to be checked for being a facet. A team that fits into a hyperplane has no inside.

Of few robots all candidates are tried, all samples at once. Of many the hull of their extremes in a few
directions, which is a part of the whole hull, gives a lower bound; samples are looked at in its order, with
Qhull or, outside, non-negative least squares, until the next bound is no better than the least margin so far.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray

from escort_mj.metrics.measure import Measure
from escort_mj.metrics.metric import metric
from escort_mj.metrics.reading import ALL_LOST, NO_TARGET, escorts, lost, stretches
from escort_mj.metrics.watching import Course, Fold, Starts, Watch, nothing, worst_of
from escort_mj.record.recording import Recorded

Array = NDArray[np.float64]

CANDIDATES = 256  # normals up to which all are tried: 22 robots in the plane, 12 in space
DEAR = 1_500_000  # products of a candidate and a robot, over all samples: 10 ms
FLAT = 1e-9  # of the team's extent: points nearer than this to a hyperplane lie in it
BLOCK = 2**15  # products at once: they stay in the processor's cache


def takes_long(trace: Recorded) -> bool:
    """Whether there are too many robots, axes and samples for every run."""
    robots, axes, samples = (trace.sizes[name] for name in ("robot", "axis", "time"))
    normals = math.comb(robots, axes)
    return normals > CANDIDATES or normals * robots * samples * max(1, axes - 2) ** 2 > DEAR


def teams(trace: Recorded) -> Iterator[tuple[int, Array]]:
    """Yield where the robots that are left are as seen from the target.

    One item for each stretch of samples with the same robots: its first sample, and shape (samples, robots,
    axes) [m].
    """
    around = trace["q"].values - trace["target_position"].values[:, None]
    for first, end, left in stretches(trace):
        team = around[first:end][:, left]
        if team.size:
            yield first, team


def over_time(trace: Recorded, of: Callable[[Array], Array]) -> Array:
    """Return a number of each sample's team, shape (time,); NaN where no robot is left.

    Args:
        trace: Of a mission with a target.
        of: The numbers of several teams, of an array as `teams` yields it.
    """
    found = np.full(trace.sizes["time"], np.nan)
    for first, team in teams(trace):
        found[first : first + len(team)] = of(team)
    return found


def _depth(trace: Recorded, starts: Starts | None) -> Array:
    return of_teams(trace, starts, margins, least_margin)


SIGNALS = ("q", "target_position", "lost")
DEPTH = Watch(Course("hull_margin", SIGNALS, _depth), Fold.LEAST)


@metric(
    unit="m",
    least=-math.inf,
    watched=False,
    more_is_better=True,
    dear=takes_long,
    of_team=True,
    watches=(DEPTH,),
)
def hull_margin(trace: Recorded) -> Measure:
    """Minimum depth of the target in the robots' convex hull; outside, the negative distance to the hull."""
    if not escorts(trace):
        return Measure(None, reason=NO_TARGET)
    if lost(trace).all():
        return Measure(None, reason=ALL_LOST)
    if np.isnan(trace["q"].values[~lost(trace)]).any():
        return Measure(math.nan)
    return worst_of(trace, DEPTH)


def of_teams(
    trace: Recorded,
    starts: Starts | None,
    of: Callable[[Array], Array],
    one: Callable[[Array], tuple[float, int]],
) -> Array:
    """Return a number of each sample's team, shape (time, 1); NaN where no robot is left.

    Of many robots, for which it takes long, only one of each stretch of samples; the others are NaN.

    Args:
        trace: Any.
        starts: First sample of each stretch, ascending from 0; None for no stretches, and all numbers.
        of: The numbers of several teams, of an array as `teams` yields it.
        one: The number that counts of several teams, and which has it.
    """
    if not escorts(trace):
        return nothing(trace.sizes["time"])
    if starts is None or math.comb(trace.sizes["robot"], trace.sizes["axis"]) <= CANDIDATES:
        return over_time(trace, of)[:, None]
    found = nothing(trace.sizes["time"])
    for first, team in teams(trace):
        inside = starts[(starts > first) & (starts < first + len(team))]
        for begin, end in pairwise([first, *inside.tolist(), first + len(team)]):
            value, row = one(team[begin - first : end - first])
            found[begin + row] = value
    return found


def least_margin(points: Array) -> tuple[float, int]:
    """Return the least margin of the origin in several hulls, and which has it, the first of equals.

    Args:
        points: Shape (hulls, points, axes) [m].
    """
    if math.comb(*points.shape[1:]) <= CANDIDATES:
        every = margins(points)
        return float(every.min()), int(every.argmin())
    bounds = margins(_extremes(points))
    best, which = math.inf, 0
    for row in np.argsort(bounds, kind="stable"):
        if bounds[row] > best:
            break
        value = margin(points[row])
        if value < best or (value == best and row < which):
            best, which = value, int(row)
    return best, which


def margins(points: Array) -> Array:
    """Return the margin of the origin in each of several hulls, shape (hulls,) [m].

    Args:
        points: Shape (hulls, points, axes) [m].
    """
    count, axes = points.shape[1:]
    if math.comb(count, axes) > CANDIDATES:
        return np.array([margin(hull) for hull in points])
    step = max(1, BLOCK // (count * sum(math.comb(count, size) for size in range(1, axes + 1))))
    return np.concatenate([_margins(points[k : k + step]) for k in range(0, len(points), step)])


def _margins(points: Array) -> Array:
    """The same of as many hulls as memory is for."""
    corners = np.ascontiguousarray(points.transpose(1, 2, 0))  # loops over hulls come last: they are long
    depth = _depths(corners)
    outside = ~((depth > 0.0) & (depth < np.inf))
    if outside.any():
        depth[outside] = -_distances(corners[:, :, outside])
    return depth


def _depths(points: Array) -> Array:
    """Least support of all normals of hyperplanes through points; infinite where there is no such plane."""
    count, axes, hulls = points.shape
    if count <= axes:
        return np.full(hulls, np.inf)
    edges = points[_choices(count, axes)]
    normals = _normals(edges[:, 1:] - edges[:, :1])
    length = np.linalg.norm(normals, axis=1)
    extent = np.abs(points - points[:1]).max(axis=(0, 1))
    flat = length <= FLAT * extent ** (axes - 1)
    along = _along(normals / np.where(flat, 1.0, length)[:, None], points)
    least: Array = np.where(flat, np.inf, np.minimum(along.max(axis=1), -along.min(axis=1))).min(axis=0)
    return least


def _distances(points: Array) -> Array:
    """Distance of the origin from each hull, 0 inside: the most by which a direction parts the two."""
    count, axes, hulls = points.shape
    apart = np.zeros(hulls)
    for size in range(1, min(count, axes) + 1):
        nearest = _nearest(points[_choices(count, size)])
        length = np.linalg.norm(nearest, axis=1)[:, None]
        along = _along(np.divide(nearest, length, out=np.zeros_like(nearest), where=length > 0.0), points)
        apart = np.maximum(apart, along.min(axis=1).max(axis=0))
    return apart


def _choices(count: int, size: int) -> NDArray[np.intp]:
    """All ways to choose so many of so many things, shape (ways, size)."""
    return np.array(list(combinations(range(count), size)))


def _along(directions: Array, points: Array) -> Array:
    """Products of directions (k, axes, hulls) and points (n, axes, hulls), shape (k, n, hulls)."""
    total = directions[:, None, 0] * points[:, 0]
    for axis in range(1, points.shape[1]):
        total += directions[:, None, axis] * points[:, axis]
    return total


def _normals(edges: Array) -> Array:
    """Vectors across p - 1 edges each, from shape (k, p - 1, p, hulls) to shape (k, p, hulls)."""
    axes = edges.shape[2]
    if axes == 2:
        return np.stack([-edges[:, 0, 1], edges[:, 0, 0]], axis=1)
    if axes == 3:
        return np.cross(edges[:, 0], edges[:, 1], axis=1)
    last = np.moveaxis(edges, 3, 1)
    minors = [np.linalg.det(np.delete(last, axis, axis=3)) * (-1) ** axis for axis in range(axes)]
    return np.stack(minors, axis=1)


def _nearest(corners: Array) -> Array:
    """Points of flats nearest to the origin, from corners (k, size, p, hulls) to shape (k, p, hulls)."""
    base = np.moveaxis(corners[:, 0], 2, 1)[..., None]
    edges = np.moveaxis(corners[:, 1:] - corners[:, :1], 3, 1).swapaxes(2, 3)
    square = edges.swapaxes(2, 3) @ edges
    most = square.max(axis=(2, 3), keepdims=True, initial=0.0)
    square += (1e-300 + 1e-15 * most) * np.eye(edges.shape[3])  # robots may be at one place
    nearest = base
    for _ in range(2):  # what the first leaves along the flat is small, but not beside a small distance
        nearest = nearest - edges @ np.linalg.solve(square, edges.swapaxes(2, 3) @ nearest)
    return np.moveaxis(nearest[..., 0], 1, 2)


def _distance(points: Array) -> float:
    """Return the distance of the origin from a hull, 0 if it is inside.

    The weights w >= 0 that minimize |sum w x|^2 + (sum w - 1)^2 are, but for a factor, those of the nearest
    point.
    """
    from scipy.optimize import nnls  # slow to import

    scale = float(np.linalg.norm(points, axis=1).min()) or 1.0
    system = np.vstack([points.T / scale, np.ones(len(points))])
    weights = nnls(system, np.append(np.zeros(points.shape[1]), 1.0))[0]
    return float(np.linalg.norm(weights @ points) / weights.sum())


def margin(points: Array) -> float:
    """Return the margin of the origin in a hull of any number of points, shape (points, axes) [m]."""
    from scipy.spatial import ConvexHull, QhullError  # slow to import

    depth = 0.0
    if len(points) > points.shape[1]:
        try:
            depth = float(-ConvexHull(points).equations[:, -1].max())
        except QhullError:  # they lie in a hyperplane
            depth = 0.0
    return depth if depth > 0.0 else -_distance(points)


def _extremes(points: Array) -> Array:
    """Return some of each hull's corners: those farthest in a few directions, shape (hulls, few, axes)."""
    axes = points.shape[2]
    few = max(k for k in range(axes + 1, 4 * axes + 1) if math.comb(k, axes) <= CANDIDATES)
    random = np.random.default_rng(few)
    directions = random.standard_normal((axes, few))
    places = np.argmax(points @ directions, axis=1)
    return np.take_along_axis(points, places[..., None], axis=1)
