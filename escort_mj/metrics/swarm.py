"""The measures of a swarm that SwarmLab has (Soria, Schiano, Floreano 2020), each a mean over time.

As in its `compute_swarm_performance.m`, union is (n - c) / (n - 1) for n robots whose graph has c connected
components; connectivity is the second-smallest eigenvalue of the graph's Laplacian, divided by n; safety is
the share of pairs that are not too near. Order is the mean over all pairs of the cosine of the angle between
the two velocities; there, only over those that are neighbors. The graph is that of `graphs`. Too near is less
than the distance that avoidance keeps, or a touch without it; there, two radii, and a center in an obstacle.

E. Soria, F. Schiano, D. Floreano: SwarmLab: a Matlab Drone Swarm Simulator, IROS 2020, arXiv 2005.02769.
MATLAB's `uavFormationMetrics` (UAV Toolbox, R2024b) has measures of the same names.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from escort_mj.metrics.distances import UNOBSTRUCTED
from escort_mj.metrics.graphs import (
    algebraic_connectivity,
    blocks,
    components,
    has_graph,
    near_pairs,
    of_graphs,
    sums_of_radii,
    takes_long,
)
from escort_mj.metrics.measure import Measure
from escort_mj.metrics.metric import metric
from escort_mj.metrics.reading import ALONE, lost, safe_gap
from escort_mj.metrics.watching import Course, Fold, Watch, mean_of, nothing, simple
from escort_mj.monitor.signals import OBSTACLES, ROBOTS
from escort_mj.record.recording import Recorded

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

STILL = 0.01  # of its radius, per second: a robot that is slower has no heading
UNLINKED = "robots see each other at any distance, and do not communicate"
RESTING = "no two robots move at a time"


def _order(trace: Recorded) -> Array:
    """Mean cosine between the headings of two robots, shape (time, 1); NaN where fewer than two move."""
    v = trace["v"].values
    speed = np.linalg.norm(v, axis=2, keepdims=True)
    moves = (speed > STILL * trace["robot_radius"].values[:, None]) & ~lost(trace)[..., None]
    heading = np.divide(v, speed, out=np.zeros_like(v), where=moves)
    n, together = moves.sum(axis=(1, 2)), (heading.sum(axis=1) ** 2).sum(axis=1)
    pairs = n * (n - 1)  # |sum of headings|^2 is n, and the cosines of all pairs
    return np.divide(together - n, pairs, out=np.full(len(n), np.nan), where=pairs > 0)[:, None]


def _union(trace: Recorded) -> Array:
    """How far the team is one, shape (time, 1)."""

    def union(left: Mask) -> float:
        n = len(left)
        return (n - components(left)) / (n - 1) if n > 1 else math.nan

    return of_graphs(trace, union)[:, None] if has_graph(trace) else nothing(trace.sizes["time"])


def _connectivity(trace: Recorded) -> Array:
    """Algebraic connectivity as a share of its largest, that of the complete graph, shape (time, 1)."""

    def share(left: Mask) -> float:
        return algebraic_connectivity(left) / max(len(left), 1)

    return of_graphs(trace, share)[:, None] if has_graph(trace) else nothing(trace.sizes["time"])


def _apart(trace: Recorded) -> Array:
    """Share of the pairs of robots that are not too near to each other, shape (time, 1)."""
    if trace.sizes["robot"] < 2:
        return nothing(trace.sizes["time"])
    touching = sums_of_radii(trace)
    safe = touching + np.maximum(safe_gap(trace, touching, ROBOTS), 0.0)
    near = [near_pairs(trace, rows, safe).mean(axis=1) for rows in blocks(trace)]
    return 1.0 - np.concatenate(near)[:, None]


def _clear(trace: Recorded) -> Array:
    """Share of the pairs of a robot and an obstacle that are not too near to each other, shape (time, 1)."""
    if not trace.sizes["obstacle"]:
        return nothing(trace.sizes["time"])
    touching = trace["robot_radius"].values[:, None] + trace["obstacle_radius"].values
    safe = touching + np.maximum(safe_gap(trace, touching, OBSTACLES), 0.0)
    near: Array = (trace["obstacle_distance"].values < safe).mean(axis=(1, 2))
    return 1.0 - near[:, None]


GRAPH = ("q", "heard_from", "lost")
ORDER = Watch(Course("order", ("v", "lost"), simple(_order)), Fold.MEAN)
UNION = Watch(Course("union", GRAPH, simple(_union)), Fold.MEAN)
CONNECTIVITY = Watch(Course("connectivity_share", GRAPH, simple(_connectivity)), Fold.MEAN)
APART = Watch(Course("robots_apart", ("q",), simple(_apart)), Fold.MEAN)
CLEAR = Watch(Course("obstacles_apart", ("obstacle_distance",), simple(_clear)), Fold.MEAN)


def _mean(trace: Recorded, watch: Watch, reason: str) -> Measure:
    """Mean of a course over time; the reason where it says nothing of any sample."""
    if trace.sizes["robot"] < 2 and watch is not CLEAR:
        return Measure(None, reason=ALONE)
    with np.errstate(invalid="ignore"):
        value = mean_of(trace, watch)
    return Measure(None, reason=reason) if math.isnan(value) else Measure(value)


@metric(
    unit="1",
    least=-1.0,
    most=1.0,
    watched=False,
    more_is_better=True,
    rank=84,
    of_team=True,
    watches=(ORDER,),
)
def order(trace: Recorded) -> Measure:
    """Mean over time and pairs of robots of the cosine between their velocities; 1 if all fly one way."""
    return _mean(trace, ORDER, RESTING)


@metric(
    unit="1",
    most=1.0,
    watched=False,
    more_is_better=True,
    dear=takes_long,
    rank=85,
    of_team=True,
    watches=(UNION,),
    needs=("links",),
)
def union(trace: Recorded) -> Measure:
    """Mean over time of (n - c) / (n - 1), if n robots hear or see each other in c groups; 1 if in one.

    The groups are the connected components of the graph of who hears whom; where robots do not communicate,
    of who is within `sensing.radius.robots` of whom.
    """
    return _mean(trace, UNION, UNLINKED)


@metric(
    unit="1",
    most=1.0,
    watched=False,
    more_is_better=True,
    dear=takes_long,
    rank=86,
    of_team=True,
    watches=(CONNECTIVITY,),
    needs=("links",),
)
def connectivity(trace: Recorded) -> Measure:
    """Mean algebraic connectivity of the graph of `union`, divided by the number of robots; 1 if complete."""
    return _mean(trace, CONNECTIVITY, UNLINKED)


@metric(unit="1", most=1.0, watched=False, more_is_better=True, dear=takes_long, rank=172, watches=(APART,))
def safety_agents(trace: Recorded) -> Measure:
    """Mean share of pairs of robots that keep the safe distance to teammates; without one, do not touch."""
    return _mean(trace, APART, ALONE)


@metric(unit="1", most=1.0, watched=False, more_is_better=True, rank=174, watches=(CLEAR,))
def safety_obstacles(trace: Recorded) -> Measure:
    """Mean share of pairs of a robot and an obstacle that keep the safe distance, or else do not touch."""
    return _mean(trace, CLEAR, UNOBSTRUCTED)
