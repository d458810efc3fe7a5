"""A recorded run as plain arrays in space, to be read at any time between its samples."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from escort_mj import palette
from escort_mj.errors import RenderError
from escort_mj.metrics.reading import escorts, lost
from escort_mj.metrics.tethers import tethers
from escort_mj.record.episodes import touched
from escort_mj.record.recording import Recorded
from escort_mj.record.team import kept_radius, rings
from escort_mj.report.figures.links import heard_links, links, links_at
from escort_mj.report.figures.teams import recorded_targets

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
OVER_TIME = (  # which fields of a replay have a row per sample
    *("time", "qpos", "robots", "target", "goals", "avoiding", "touching", "obstacles", "lost", "estimates"),
    *("seen", "heard", "returns", "kept", "members", "team_centers", "team_radius", "target_teams"),
    *("wish", "ruling"),
)

GHOST = 0.8  # size of a ghost in that of the target: it hides in the target where the estimate is good
TICK = 1.0  # length of the end of a ray of a lidar that is drawn, in radii of the robot


@dataclass(frozen=True)
class Moment:
    """The mission at one time.

    Attributes:
        time: [s].
        sample: Index of the sample at or before this time.
        share: How far the time is from that sample to the next, 0..1.
        qpos: MuJoCo's generalized positions.
        robots: Positions, shape (n, 3) [m].
        target: Position, shape (3,) [m].
        obstacles: Centers, shape (m, 3) [m].
        kept: Distance that each robot keeps from the target, shape (n,) [m].
    """

    time: float
    sample: int
    share: float
    qpos: Array
    robots: Array
    target: Array
    obstacles: Array
    kept: Array


@dataclass(frozen=True)
class Replay:
    """What a video needs of a run.

    Planar missions happen at one height, that of their robots' centers; of missions in more than three axes
    this is what happens along x, y, z.

    Attributes:
        time: Times of the samples, shape (T,) [s].
        qpos: MuJoCo's generalized positions, shape (T, coordinates).
        robots: Positions, shape (T, n, 3) [m].
        target: Positions, shape (T, 3) [m]; without a target the middle of what happens.
        goals: Where each robot goes, shape (T, n, 3) [m]; (T, 0, 3) where robots have no goals.
        avoiding: Whether obstacle avoidance rules a robot, shape (T, n).
        touching: Whether a robot touched something since the previous sample, shape (T, n).
        robot_radius: Shape (n,) [m].
        target_radius: [m]; 0 without a target.
        obstacles: Centers, shape (T, m, 3) [m].
        obstacle_radius: Shape (m,) [m].
        opponents: How many of the obstacles, the last ones, are opponents.
        outlines: Points around each, relative to its center, shape (m, k, 3) [m]; (m, 0, 3) where all are
            spheres.
        safe_radius: How near to each obstacle's center a robot's center may come, shape (m,) [m].
        radius: Largest distance to keep from the target; without a target the size of the mission [m].
        kept: Distance that each robot keeps from the target, shape (T, n) [m].
        lost: Whether the team has lost a robot, shape (T, n).
        formations: From which sample on who is whose neighbor: pairs of robots from 0, shape (edges, 2).
        tethers: Between which bodies tethers are: robots from 1, 0 for the target, shape (tethers, 2).
        estimates: Where each robot believes the target to be, shape (T, n, 3) [m]; (T, 0, 3) where all know.
        seen: Whether a robot sees the target, shape (T, n); (T, 0) where all know where it is.
        heard: Whom each robot hears, numbered from 1, 0 for none, shape (T, n, slots); no slots without a
            radio.
        returns: Distances along the rays of lidars, shape (T, n, rays) [m]; no rays where not recorded.
        rays: Unit vectors along them, shape (rays, 3).
        members: Team of each robot, from 1, shape (T, n); (T, 0) where all are one team.
        targets: Which obstacles are targets of teams, by name.
        target_teams: Team that escorts each of these, from 1, 0 for none, shape (T, targets).
        team_centers: Middle of the targets of each team, shape (T, teams, 3) [m].
        team_radius: Distance that each keeps from there, shape (T, teams) [m].
        ghost_radius: Of what shows where a robot believes its target: that of the smallest target [m].
        wish: Velocities that the tasks ask for, shape (T, n, 3) [m/s].
        ruling: Task that rules a robot, from 0, negative for none, shape (T, n).
        behaviors: Names of the tasks.
        borders: Point and normal of each line or plane that robots do not cross, shape (borders, 2, 3).
        planar: Whether the mission has two axes.
    """

    time: Array
    qpos: Array
    robots: Array
    target: Array
    goals: Array
    avoiding: Flags
    touching: Flags
    robot_radius: Array
    target_radius: float
    obstacles: Array
    outlines: Array
    obstacle_radius: Array
    opponents: int
    safe_radius: Array
    radius: float
    kept: Array
    lost: Flags
    formations: list[tuple[int, NDArray[np.int64]]]
    tethers: NDArray[np.int64]
    estimates: Array
    seen: Flags
    heard: NDArray[np.int16]
    returns: Array
    rays: Array
    members: NDArray[np.int8]
    targets: tuple[str, ...]
    target_teams: NDArray[np.int8]
    team_centers: Array
    team_radius: Array
    ghost_radius: float
    wish: Array
    ruling: Array
    behaviors: tuple[str, ...]
    borders: Array
    planar: bool

    @property
    def count(self) -> int:
        """Number of robots."""
        return self.robots.shape[1]

    def colors(self, sample: int) -> list[palette.Color]:
        """Return the color of each robot at a sample: its own, or that of its team."""
        if not self.members.size:
            return palette.robot_colors(self.count)
        return [palette.team_color(int(number) - 1) for number in self.members[sample]]

    def target_colors(self, sample: int) -> list[palette.Color]:
        """Return the color of each target of teams at a sample: that of the team that escorts it."""
        return [palette.target_color(int(team)) for team in self.target_teams[sample]]

    def aims(self, moment: Moment) -> Array:
        """Return where the target of each robot is, or the middle of its team's, shape (n, 3) [m]."""
        if not self.members.size:
            return np.broadcast_to(moment.target, moment.robots.shape)
        return np.asarray(self.team_centers[moment.sample, self.members[moment.sample].astype(int) - 1])

    def rings(self, moment: Moment) -> list[float]:
        """Return the distances from the target that robots keep, each once; none without a target [m]."""
        return rings(moment.kept, self.lost[moment.sample]) if self.escorts else []

    @property
    def escorts(self) -> bool:
        """Whether there is a target."""
        return self.target_radius > 0.0

    @property
    def end(self) -> float:
        """Time of the last sample [s]."""
        return float(self.time[-1])

    def at(self, time: float) -> Moment:
        """The mission at a time, straight between the samples around it."""
        last = len(self.time) - 1
        sample = int(np.clip(np.searchsorted(self.time, time, side="right") - 1, 0, max(last - 1, 0)))
        after = min(sample + 1, last)
        gap = self.time[after] - self.time[sample]
        share = float(np.clip((time - self.time[sample]) / gap, 0.0, 1.0)) if gap > 0 else 0.0

        def between(values: Array) -> Array:
            return (1.0 - share) * values[sample] + share * values[after]

        qpos = between(self.qpos)
        obstacles, kept = between(self.obstacles), between(self.kept)
        return Moment(time, sample, share, qpos, between(self.robots), between(self.target), obstacles, kept)

    def returned(self, moment: Moment) -> tuple[Array, NDArray[np.int64]]:
        """Return the ends of rays that met something, shape (k, 2, 3) [m], and whose they are, shape (k,)."""
        lengths = self.returns[moment.sample]
        whose, which = np.nonzero(np.isfinite(lengths))
        shown = np.stack([np.maximum(lengths - TICK * self.robot_radius[:, None], 0.0), lengths], axis=-1)
        ways = shown[whose, which, :, None] * self.rays[which, None]
        return self.robots[moment.sample, whose, None] + ways, whose

    @property
    def communicates(self) -> bool:
        """Whether robots hear each other over a radio."""
        return self.heard.shape[2] > 0

    def linked(self, sample: int) -> NDArray[np.int64]:
        """Robots that hear each other; without a radio neighbors: pairs from 0, shape (edges, 2)."""
        if self.communicates:
            return heard_links(self.heard[sample], self.lost[sample])
        return links_at(self.formations, sample)

    def between(self, start: float, end: float) -> Replay:
        """Return the part of the run between two times, with the samples around them."""
        first = max(int(np.searchsorted(self.time, start, side="right")) - 1, 0)
        part = slice(first, max(int(np.searchsorted(self.time, end, side="left")), first) + 1)
        return replace(
            self,
            formations=[(max(begun - first, 0), pairs) for begun, pairs in self.formations],
            **{name: getattr(self, name)[part] for name in OVER_TIME},
        )

    def past(self, values: Array, moment: Moment, duration: float, pieces: int) -> Array:
        """Where something was lately, at evenly spaced times that stay put as time goes on.

        Args:
            values: Shape (T, ...).
            moment: Now.
            duration: How far back to look [s].
            pieces: How many times to look at most.

        Returns:
            Shape (k, ...), oldest first, without the present.
        """
        step = duration / pieces
        first = max(np.ceil((moment.time - duration) / step), np.ceil(self.time[0] / step))
        times = np.arange(first, np.ceil(moment.time / step)) * step
        rows = np.clip(np.searchsorted(self.time, times), 0, len(self.time) - 1)
        return values[rows]

    def lately(self, moment: Moment, duration: float) -> tuple[Flags, Flags]:
        """Which robots avoided something lately, and which touched something: a short event stays visible.

        Args:
            moment: Now.
            duration: How far back to look [s].

        Returns:
            Shape (n,) each.
        """
        first = int(np.searchsorted(self.time, moment.time - duration, side="left"))
        part = slice(min(first, moment.sample), moment.sample + 1)
        return np.any(self.avoiding[part], axis=0), np.any(self.touching[part], axis=0)


def replay_of(trace: Recorded) -> Replay:
    """A trace as a replay.

    Raises:
        RenderError: If the trace holds no sample.
    """
    if trace.sizes["time"] == 0:
        raise RenderError("the trace holds no sample, so there is nothing to draw")
    planar = trace.sizes["axis"] == 2
    robot_radius = trace["robot_radius"].values
    height = float(trace.attrs.get("height", robot_radius.max()))

    def in_space(name: str) -> Array:
        values = trace[name].values[..., :3]
        return (
            np.concatenate([values, np.full((*values.shape[:-1], 1), height)], axis=-1) if planar else values
        )

    def recorded(name: str, *absent: int, kind: type[np.generic] = np.float64) -> NDArray[Any]:
        return trace[name].values if name in trace else np.zeros(absent, kind)

    wish = trace["v_d"].values[..., :3]
    robots, target = in_space("q"), in_space("target_position")
    goals = in_space("goal") if "goal" in trace else robots[:, :0]
    targets, samples, count = recorded_targets(trace), len(robots), robots.shape[1]
    rays = recorded("lidar_ray", 0, 3)
    if not escorts(trace):
        places = np.concatenate([robots[0], *goals[[0, -1]]])
        target = np.broadcast_to(0.5 * (places.min(axis=0) + places.max(axis=0)), target.shape)
    return Replay(
        time=trace["time"].values,
        qpos=trace["qpos"].values,
        robots=robots,
        target=target,
        goals=goals,
        avoiding=trace["avoidance_active"].values > 0,
        touching=touched(trace),
        robot_radius=robot_radius,
        target_radius=float(trace.attrs["target_radius"]),
        obstacles=in_space("obstacle_position"),
        outlines=outlines(trace),
        obstacle_radius=trace["obstacle_radius"].values,
        opponents=trace.sizes.get("opponent", 0),
        safe_radius=safe_radius(trace).max(axis=0, initial=0.0),
        radius=float(kept_radius(trace).max() if escorts(trace) else trace.attrs["mission_radius"]),
        kept=kept_radius(trace),
        lost=lost(trace),
        formations=links(trace),
        tethers=tethers(trace),
        estimates=in_space("target_estimate") if "target_estimate" in trace else robots[:, :0],
        seen=recorded("target_seen", samples, 0) > 0,
        heard=recorded("heard_from", samples, count, 0, kind=np.int16),
        returns=recorded("lidar_range", samples, count, 0),
        rays=np.pad(rays, ((0, 0), (0, robots.shape[2] - rays.shape[1]))),
        members=recorded("member_of", samples, 0, kind=np.int8),
        targets=tuple(map(str, trace["obstacle"].values[targets])),
        target_teams=recorded("obstacle_team", samples, 0, kind=np.int8)[:, targets],
        team_centers=in_space("team_center") if "team_center" in trace else robots[:, :0],
        team_radius=recorded("team_radius", samples, 0),
        ghost_radius=GHOST * _target_size(trace, targets),
        wish=wish if not planar else np.pad(wish, ((0, 0), (0, 0), (0, 1))),
        ruling=trace["ruling"].values,
        behaviors=tuple(map(str, trace["behavior"].values)),
        borders=np.pad(borders(trace), ((0, 0), (0, 0), (0, int(planar)))),
        planar=planar,
    )


def _target_size(trace: Recorded, targets: list[int]) -> float:
    """Return the radius of the target, or of the smallest one of teams [m]."""
    return float(trace["obstacle_radius"].values[targets].min() if targets else trace.attrs["target_radius"])


def outlines(trace: Recorded) -> Array:
    """Points around each obstacle, relative to its center, shape (m, k, 3) [m]; k is 0 for spheres only."""
    if "obstacle_outline" not in trace:
        return np.zeros((trace.sizes["obstacle"], 0, 3))
    points = trace["obstacle_outline"].values
    return np.asarray(np.pad(points, ((0, 0), (0, 0), (0, 3 - points.shape[2]))))


def safe_radius(trace: Recorded) -> Array:
    """How near avoidance lets a robot's center come to an obstacle's, shape (n, m) [m]; 0 without it.

    To one that is no sphere: to its nearest point.
    """
    shape = trace.sizes["robot"], trace.sizes["obstacle"]
    safe = float(trace.attrs["safe_distance"])
    if safe > 0.0 and trace.attrs["safe_distance_measure"] == "surface":
        return safe + trace["robot_radius"].values[:, None] + trace["obstacle_radius"].values
    return np.full(shape, safe)


def borders(trace: Recorded) -> Array:
    """Point and normal of each line or plane that robots do not cross, shape (borders, 2, axes).

    None in more than three axes, of which pictures show three.
    """
    if "border" not in trace or trace.sizes["axis"] > 3:
        return np.zeros((0, 2, trace.sizes["axis"]))
    return np.stack([trace["border_point"].values, trace["border_normal"].values], axis=1)
