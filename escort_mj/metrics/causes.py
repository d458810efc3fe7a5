"""Why robots touch something: rules that find a cause in the trace, or none, which is a defect of avoidance.

A touch is looked at from its *alarm* on: the first sample since when, without a break, the robot has seen the
body and their gap has been at most safe_distance + c^2 / a, but at most FORESIGHT before the touch. c is
the speed at which they close, a what the motors can give beyond the disturbance, (force limit -
|disturbance|) / mass, or what they gave where they gave all most of the time. A body that moves by itself
gives the alarm only since its way, straight on, has led into half the safe distance of where the robot was at
the time, and once to where it was at the touch, within a t^2 / 4, as far as half of the motors move the robot
in the time t between: from one that turns or speeds up faster, no way to flee stays right. The robot can
answer the alarm once it does not accelerate against all that its motors give, as one that skids or has to
turn around first does. From then on the rules fly the robot again, among the bodies as they moved: its
velocity turns at the rate a into a constant one of at most max_speed. A flight is clear if it touches nothing
until BEYOND the touch, and neither the body if that had gone straight on. A robot is boxed in where, besides,
no velocity of at most max_speed satisfied the half planes r . (v - u) >= -approach(gap) of all bodies, with
their velocities u. What avoidance asked for is followed from the alarm itself, whether the robot could answer
or not, with what the force limit gives: a robot is overtaxed where that was clear, and the motors gave all.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.control.outer_loops.nearest_velocity import STIFFNESS
from escort_mj.control.outer_loops.passing import Rules, approach
from escort_mj.metrics.contacts import touches_within
from escort_mj.metrics.measure import Bodies, Measure
from escort_mj.metrics.metric import metric
from escort_mj.metrics.reading import escorts, radii_of, safe_gap
from escort_mj.monitor.signals import OBSTACLES, ROBOTS
from escort_mj.record.episodes import pair
from escort_mj.record.recording import Recorded, require_places
from escort_mj.record.window import rate_of

Array = NDArray[np.float64]

PUSHED, FAILED, STARTED, DISTURBED, MISLED = "pushed", "failed", "started", "disturbed", "misled"
OUTRUN, BOXED_IN, OVERTAXED, UNEXPLAINED = "outrun", "boxed in", "overtaxed", "unexplained"
CAUSES = {
    PUSHED: "an earlier touch, whose cause is known, still moves one of the robots: it ended no longer ago "
    "than |v| / a, with the velocity that it left the robot with, and a tenth of a second, or the robot has "
    "been faster than max_speed ever since; likewise a push from outside beyond the force limit, unless what "
    "it threw the robot at is another one with motors, which has to make room",
    FAILED: "the team knows that the motors of every robot in it have failed: no other robot could make room",
    STARTED: "the start is the alarm, and no flight is clear",
    DISTURBED: "|disturbance| exceeded the force limit of the robot on an axis since the alarm",
    MISLED: "errors of measured positions, |q_measured - q|, of both robots where two meet, reached the safe "
    "distance since the alarm",
    OUTRUN: "the body moves by itself, or is a robot faster than max_speed, and no flight is clear of it, "
    "both as it moved and going straight on",
    BOXED_IN: "no flight is clear of all bodies, and at some time no velocity within max_speed satisfied the "
    "half planes of all",
    OVERTAXED: "the flight that follows the reference velocities from the alarm on, as the force limit "
    "allows, is clear, and most of the time since the motors gave all they can",
}
"""Causes in the order in which they are looked for, with their rules."""
FORESIGHT = 1.0  # s
SETTLING = 0.1  # s
MOSTLY = 0.5  # share of the time in which motors give all they can
DEAR = 100_000  # touches times bodies times samples
BEYOND = 0.5  # s
FINEST = 50  # parts of a step between samples in which fast bodies are looked for
SPEEDS = (1.0, 0.5, 0.0)  # of the flights that are tried first, as shares of the largest
DENSELY = np.linspace(1.0, 0.0, 9)  # likewise, where none of those is clear
AT_ONCE = 256  # flights
RATE = 4.0  # 1/s, of approach
GIVES = 1e-2  # share of a velocity by which a half plane that could be kept gives way


class Touch(NamedTuple):
    """A touch of a robot and its cause.

    Attributes:
        time: When it began [s].
        bodies: Who.
        cause: One of `CAUSES`, or `UNEXPLAINED`.
    """

    time: float
    bodies: Bodies
    cause: str


def _dear(trace: Recorded) -> bool:
    """Whether there are too many touches, bodies and samples around each to look at them unasked."""
    samples = min(trace.sizes["time"], (FORESIGHT + BEYOND) * (rate_of(trace) or 0.0))
    return trace.sizes["episode"] * trace.sizes["body"] * samples > DEAR


@metric(unit="1", grows=True, watched=False, rank=185, dear=_dear)
def touches_unexplained(trace: Recorded) -> Measure:
    """Number of touches that involve a robot and have no known cause (see the page on avoidance)."""
    found = [touch for touch in causes_of(trace) if touch.cause == UNEXPLAINED]
    return Measure(float(len(found)), found[0].time, found[0].bodies) if found else Measure(0.0)


def causes_of(trace: Recorded) -> list[Touch]:
    """Return the touches of robots within a trace and their causes, the first touch first."""
    return list(_causes(trace))


def _causes(trace: Recorded) -> Iterator[Touch]:
    require_places(trace)
    met = touches_within(trace)
    first, second = met["episode_first"].values, met["episode_second"].values
    start, end = met["episode_start"].values, met["episode_end"].values
    of_robots = np.flatnonzero(np.minimum(first, second) < trace.sizes["robot"])
    if not len(of_robots):
        return
    scene, known = _Scene(trace), dict[int, float]()
    for k in of_robots:
        couple = int(first[k]), int(second[k])
        cause = scene.cause(couple, float(start[k]), known)
        if cause != UNEXPLAINED:
            known |= {
                body: max(float(end[k]), known.get(body, 0.0)) for body in couple if body < scene.robots
            }
        yield Touch(float(start[k]), pair(met, int(k)), cause)


class _Scene:
    """A trace as the rules look at it: where every body is in every sample."""

    def __init__(self, trace: Recorded) -> None:
        self.trace, self.time = trace, trace["time"].values
        self.q, self.v = trace["q"].values, trace["v"].values
        self.robots, self.axes = self.q.shape[1:]
        self._fastest = float(trace.attrs.get("max_speed", math.inf))
        self._pushes = np.reshape(trace.attrs.get("pushes", ()), (-1, 4)).tolist()
        names = [str(name) for name in trace["body"].values]
        outlines = trace["obstacle_outline"].values if "obstacle_outline" in trace else None
        self.place = {i: self.q[:, i] for i in range(self.robots)}
        self.radius = radii_of(trace).tolist()
        self.outline: dict[int, Array] = {}
        if escorts(trace):
            self.place[names.index("target")] = trace["target_position"].values
        for j, name in enumerate(trace["obstacle"].values):
            body = names.index(str(name))
            self.place[body] = trace["obstacle_position"].values[:, j]
            if self.radius[body] == 0.0 and outlines is not None:
                self.outline[body] = (outlines[j] @ all_directions(self.axes).T).max(axis=0)

    def cause(self, couple: tuple[int, int], start: float, known: dict[int, float]) -> str:
        """Return the cause of a touch.

        Args:
            couple: The two bodies, by their index in `body`; the first is a robot.
            start: When it began [s].
            known: When each robot last had a touch with a cause [s].
        """
        row = max(int(np.searchsorted(self.time, start - 0.5 * float(self.trace.attrs["timestep"]))) - 1, 0)
        sides = [(i, b) for i, b in (couple, couple[::-1]) if i < self.robots]
        if any(self._moves_on(i, known.get(i, -math.inf), row, start) for i, _ in sides):
            return PUSHED
        thrown = [i for i, _ in sides if self._is_thrown(i, row, start)]
        sides = [(i, b) for i, b in sides if not self.trace["lost"].values[row, i]]
        if not (able := [(i, b) for i, b in sides if i not in thrown]):
            return PUSHED if thrown else FAILED
        found = [self._from_alarm(i, b, row) for i, b in able]
        return min(found, key=[*CAUSES, UNEXPLAINED].index)

    def _moves_on(self, i: int, ended: float, row: int, start: float) -> bool:
        """Whether what ended at a time still moves a robot at the start of a touch."""
        left = min(int(np.searchsorted(self.time, ended)), row)
        moved = float(np.linalg.norm(self.v[left, i])) / max(self._thrust(i, left, row), 1e-9)
        faster = np.linalg.norm(self.v[left : row + 1, i], axis=1) > self._fastest
        return bool(start - ended <= moved + SETTLING or (math.isfinite(ended) and faster.all()))

    def _is_thrown(self, i: int, row: int, start: float) -> bool:
        """Whether a push from outside that the motors could not hold moves a robot, as an intervention is."""
        limit = float(self.trace["force_limit"].values[i])
        return any(
            robot == i
            and force > limit
            and begun < start
            and self._moves_on(i, min(until, start), row, start)
            for robot, begun, until, force in self._pushes
        )

    def _from_alarm(self, i: int, b: int, row: int) -> str:
        """Return the cause for a robot that met a body in a sample."""
        told, alarm, end = self._alarm(i, b, row)
        rows = slice(alarm, row + 1)
        if (np.abs(self.trace["disturbance"].values[rows, i]) > self.trace["force_limit"].values[i]).any():
            return DISTURBED
        wrong = np.linalg.norm(self.trace["q_measured"].values - self.q, axis=2)[rows]
        if wrong[:, i].max() + (wrong[:, b].max() if b < self.robots else 0.0) >= max(self._safe(i, b), 1e-9):
            return MISLED
        thrust = self._thrust(i, alarm, row)
        most = self._fastest
        if not math.isfinite(most):
            most = float(np.linalg.norm(self.v[alarm, i])) + thrust * float(self.time[end] - self.time[alarm])
        around = all_directions(self.axes)[:: max(len(all_directions(self.axes)) // 32, 1)]
        first = np.vstack([share * most * around for share in SPEEDS])
        every = np.vstack([share * most * all_directions(self.axes) for share in DENSELY])
        wanted = [first, *np.split(every, range(AT_ONCE, len(every), AT_ONCE))]
        moves = alarm > 0 and (self._moves(b) or self._rushes(b, rows))
        if moves and not any(self._evades(i, b, alarm, end, each, thrust).any() for each in wanted):
            return OUTRUN
        if not any(self._escapes(i, b if moves else None, alarm, end, each, thrust) for each in wanted):
            if alarm == 0:
                return STARTED
            if self._boxed_in(i, rows, most, thrust):
                return BOXED_IN
        return OVERTAXED if self._overtaxed(i, slice(told, row + 1), end) else UNEXPLAINED

    def _overtaxed(self, i: int, rows: slice, end: int) -> bool:
        """Whether a robot's motors gave all since the alarm, and its reference velocities led clear."""
        if self._full(i, rows).mean() <= MOSTLY:
            return False
        followed = self._followed(i, rows, end, self._can(i, rows))
        return all(self._clear(i, body, rows.start, end, followed).all() for body in self.place)

    def _evades(
        self, i: int, b: int, alarm: int, end: int, wanted: Array, thrust: float
    ) -> NDArray[np.bool_]:
        """Whether each flight of a robot is clear of a body, as it moved and going straight on."""
        flights = self._flights(i, alarm, end, wanted, thrust)
        went = self.place[b][alarm : end + 1] - self.place[b][alarm]
        straight = self._velocity(b, alarm) * (self.time[alarm : end + 1] - self.time[alarm])[:, np.newaxis]
        clear = self._clear(i, b, alarm, end, flights)
        return np.asarray(clear & self._clear(i, b, alarm, end, flights + went - straight))

    def _escapes(self, i: int, b: int | None, alarm: int, end: int, wanted: Array, thrust: float) -> bool:
        """Whether a flight of a robot is clear of all bodies, and of one that moves by itself as above."""
        flights = self._flights(i, alarm, end, wanted, thrust)
        clear = np.ones(len(wanted), dtype=bool)
        if b is not None:
            clear &= self._evades(i, b, alarm, end, wanted, thrust)
        for body in self.place:
            if not clear.any():
                return False
            clear &= self._clear(i, body, alarm, end, flights)
        return bool(clear.any())

    def _boxed_in(self, i: int, rows: slice, most: float, thrust: float) -> bool:
        """Whether in one of some samples no velocity within a limit satisfies all half planes."""
        rules = Rules(RATE, max(0.5 * thrust, 1e-9), 0.0, 1.0, 0.0, 0.0)
        others = [body for body in self.place if body != i]
        away, u, gap = [], [], []
        for body in others:
            normal, distance = self._apart(body, rows, self.q[rows, i])
            away.append(normal)
            gap.append(distance - self.radius[i])
            u.append(self._velocity(body, rows))
        for k in range(len(gap[0]) if others else 0):
            r = np.array([each[k] for each in away])
            allowed = np.array([approach(float(each[k]), rules) for each in gap])
            if not some_velocity(r, (r * np.array([each[k] for each in u])).sum(axis=1) - allowed, most):
                return True
        return False

    def _rushes(self, b: int, rows: slice) -> bool:
        """Whether a body is a robot that was faster than any may be."""
        return b < self.robots and bool((np.linalg.norm(self.v[rows, b], axis=1) > self._fastest).any())

    def _alarm(self, i: int, b: int, row: int) -> tuple[int, int, int]:
        """Return the samples of the alarm, when it can be answered, and until when flights run."""
        first = int(np.searchsorted(self.time, self.time[row] - FORESIGHT))
        rows = slice(first, row + 1)
        normal, gap = self._apart(b, rows, self.q[rows, i])
        gap = gap - self.radius[i]
        moved = self._velocity(b, rows)
        closing = np.maximum(((moved - self.v[rows, i]) * normal).sum(axis=1), 0.0)
        braking = closing**2 / max(self._thrust(i, first, row), 1e-9)  # with half of the motors
        sees = self.trace.attrs.get("sensing_robots" if b < self.robots else "sensing_obstacles", math.inf)
        quiet = np.flatnonzero((gap > self._safe(i, b) + braking) | (gap > float(sees)))
        alarm = min(first + int(quiet[-1]) + 1, row) if len(quiet) else first
        if self._moves(b):
            alarm = max(alarm, self._turned(i, b, first, row))
        told, able = (
            self._foreseen(b, each, row, self._thrust(i, each, row)) if self._moves(b) and each > 0 else each
            for each in (alarm, max(alarm, self._answered(i, first, row)))
        )
        end = int(np.searchsorted(self.time, self.time[row] + BEYOND))
        return told, able, min(end, len(self.time) - 1)

    def _velocity(self, b: int, rows: int | slice) -> Array:
        """How fast a body came to where it is in some samples; 0 in the first [m/s]."""
        step = np.diff(self.place[b], axis=0, prepend=self.place[b][:1])
        return np.asarray((step / np.diff(self.time, prepend=self.time[0] - 1.0)[:, np.newaxis])[rows])

    def _turned(self, i: int, b: int, first: int, row: int) -> int:
        """Return the first sample since when a body's straight way has led to where a robot was."""
        rows = slice(first, row + 1)
        step = float(self.time[row] - self.time[row - 1])  # in the next one, it touches
        time = np.append(self.time[rows], self.time[row] + step)[:, np.newaxis]
        robot = np.vstack([self.q[rows, i], self.q[row, i] + self.v[row, i] * step])
        place, moved = self.place[b][rows], self._velocity(b, rows)
        for k in range(row - first, -1, -1):
            way = robot[k:] - place[k] - moved[k] * (time[k:] - time[k])
            if self._beyond(b, way)[1].min() - self.radius[i] > 0.5 * self._safe(i, b):
                return min(first + k + 1, row)
        return first

    def _foreseen(self, b: int, alarm: int, row: int, thrust: float) -> int:
        """Return the first sample from which a body's straight way leads to where it was in the last."""
        ahead = (self.time[row] - self.time[alarm : row + 1])[:, np.newaxis]
        way = self.place[b][alarm : row + 1] + self._velocity(b, slice(alarm, row + 1)) * ahead
        missed = np.linalg.norm(self.place[b][row] - way, axis=1)
        return alarm + int(np.argmax(missed <= 0.25 * thrust * ahead[:, 0] ** 2))  # with half of them

    def _answered(self, i: int, first: int, row: int) -> int:
        """Return the first sample since when a robot has not accelerated against motors that give all."""
        most = (1.0 - 1e-9) * float(self.trace["force_limit"].values[i])
        for k in range(row, first, -1):
            start = min(int(np.searchsorted(self.time, self.time[k] - SETTLING - 1e-9)), k - 1)
            given = self._force(i, slice(start, k)).mean(axis=0)
            if np.abs(given).max() >= most and (self.v[k, i] - self.v[start, i]) @ given < 0.0:
                return k
        return first

    def _followed(self, i: int, rows: slice, end: int, thrust: float) -> Array:
        """Where a robot is that turns its velocity into the reference ones, shape (1, time, axis)."""
        wanted, way, v = self.trace["v_d"].values[rows, i], [self.q[rows.start, i]], self.v[rows.start, i]
        for k, step in enumerate(np.diff(self.time[rows.start : end + 1])):
            change = wanted[min(k, len(wanted) - 1)] - v
            v = v + change * min(thrust * step / max(float(np.linalg.norm(change)), 1e-9), 1.0)
            way.append(way[-1] + v * step)
        return np.array([way])

    def _flights(self, i: int, alarm: int, end: int, wanted: Array, thrust: float) -> Array:
        """Where a robot is that turns its velocity into each of some others, shape (flight, time, axis)."""
        now, change = self.v[alarm, i], wanted - self.v[alarm, i]
        takes = np.linalg.norm(change, axis=1) / max(thrust, 1e-9)
        t = (self.time[alarm : end + 1] - self.time[alarm])[np.newaxis]
        takes = np.maximum(takes, 1e-9)[:, np.newaxis]
        share = np.where(t < takes, 0.5 * t * t / takes, t - 0.5 * takes)
        return np.asarray(
            self.q[alarm, i] + now * t[..., np.newaxis] + change[:, np.newaxis] * share[..., np.newaxis]
        )

    def _clear(self, i: int, body: int, alarm: int, end: int, flights: Array) -> NDArray[np.bool_]:
        """Whether each flight of a robot keeps clear of a body."""
        way = self.place[body][alarm : end + 1] - self.q[alarm, i]
        size = self.radius[i] + (self.outline[body].max() if body in self.outline else self.radius[body])
        reach = np.linalg.norm(flights - self.q[alarm, i], axis=2).max()
        if body == i or np.linalg.norm(way, axis=1).min() > size + reach:
            return np.ones(len(flights), dtype=bool)
        way = flights - self.place[body][alarm : end + 1]
        step = np.diff(way, axis=1)
        parts = min(math.ceil(np.linalg.norm(step, axis=2).max(initial=0.0) / (0.5 * size)), FINEST)
        shares = np.arange(1, parts)[:, np.newaxis] / max(parts, 1)
        between = way[:, :-1, np.newaxis] + shares * step[:, :, np.newaxis]
        way = np.concatenate([way, between.reshape(len(way), -1, self.axes)], axis=1)
        return np.asarray((self._beyond(body, way)[1] > self.radius[i]).all(axis=1))

    def _apart(self, body: int, rows: int | slice, points: Array) -> tuple[Array, Array]:
        """Unit vectors from a body's surface to points, and how far those are from it [m]."""
        return self._beyond(body, points - self.place[body][rows])

    def _beyond(self, body: int, way: Array) -> tuple[Array, Array]:
        """Return the same for points that are given from the body's center."""
        if body not in self.outline:
            length = np.linalg.norm(way, axis=-1)
            return way / np.maximum(length, 1e-12)[..., np.newaxis], length - self.radius[body]
        support = way @ all_directions(self.axes).T - self.outline[body]
        return all_directions(self.axes)[support.argmax(axis=-1)], support.max(axis=-1)

    def _thrust(self, i: int, first: int, last: int) -> float:
        """Acceleration that a robot's motors can give in some samples [m/s^2].

        That is what the force limit gives beyond the disturbance. Where the motors have given all they can
        most of the time, and less came of it, it is that: a vessel has to turn first.
        """
        rows, can = slice(first, last + 1), self._can(i, slice(first, last + 1))
        force, full = self._force(i, slice(first, last)), self._full(i, slice(first, last))
        if not len(full) or full.mean() <= MOSTLY:
            return can
        got = np.diff(self.v[rows, i], axis=0) / np.diff(self.time[rows])[:, np.newaxis]
        along = (got * force).sum(axis=1) / np.maximum(np.linalg.norm(force, axis=1), 1e-12)
        return min(can, max(float(along[full].mean()), 0.0))

    def _can(self, i: int, rows: slice) -> float:
        """Acceleration that the force limit of a robot gives beyond the disturbance [m/s^2]."""
        push = float(np.abs(self.trace["disturbance"].values[rows, i]).max())
        beyond = float(self.trace["force_limit"].values[i]) - push
        return max(beyond, 0.0) / float(self.trace["robot_mass"].values[i])

    def _force(self, i: int, rows: slice) -> Array:
        """Return what a robot's motors are asked for in some samples, as far as they can give it [N]."""
        limit = float(self.trace["force_limit"].values[i])
        return np.asarray(np.clip(self.trace["tau"].values[rows, i], -limit, limit))

    def _full(self, i: int, rows: slice) -> NDArray[np.bool_]:
        """Whether they give all they can."""
        most = np.abs(self._force(i, rows)).max(axis=1, initial=0.0)
        return np.asarray(most >= float(self.trace["force_limit"].values[i]))

    def _safe(self, i: int, b: int) -> float:
        """Distance that avoidance keeps between a robot and a body, surface to surface [m]."""
        group = ROBOTS if b < self.robots else OBSTACLES
        return safe_gap(self.trace, self.radius[i] + self.radius[b], group)

    def _moves(self, b: int) -> bool:
        """Whether a body moves by itself: no wall, and no teammate, which does its part of avoidance."""
        lost = b < self.robots and bool(self.trace["lost"].values[:, b].any())
        return lost or (b >= self.robots and bool(np.ptp(self.place[b], axis=0).any()))


def some_velocity(r: Array, b: Array, most: float) -> bool:
    """Return whether a velocity v of at most a speed satisfies r . v >= b.

    Args:
        r: Unit vectors, shape (k, p).
        b: Shape (k,) [m/s].
        most: [m/s].
    """
    slowest = least_change(r, b, STIFFNESS) if (b > 0.0).any() else np.zeros(r.shape[1])
    kept = (b - r @ slowest).max(initial=0.0) <= GIVES * max(float(np.linalg.norm(slowest)), 1e-9)
    return bool(kept and np.linalg.norm(slowest) <= most)


def least_change(rows: Array, missing: Array, stiffness: float) -> Array:
    """The change x of a velocity with slacks s, rows x + s >= missing, of least |x|^2 + stiffness |s|^2.

    Lawson and Hanson's least-distance programming: with z = (x, sqrt(stiffness) s) it is the shortest z in a
    polyhedron G z >= h, which the residual of a non-negative least-squares problem gives.

    Args:
        rows: Shape (k, p).
        missing: Shape (k,) [m/s].
        stiffness: Weight of violations.
    """
    from scipy.optimize import nnls

    weights = np.hstack([rows, np.eye(len(rows)) / np.sqrt(stiffness)])
    system = np.vstack([weights.T, missing])
    goal = np.zeros(len(system))
    goal[-1] = 1.0
    multipliers, _ = nnls(system, goal)
    residual = goal - system @ multipliers
    return -residual[: rows.shape[1]] / residual[-1]


@cache
def all_directions(axes: int) -> Array:
    """Unit vectors all around, evenly spread, shape (k, p)."""
    if axes == 2:
        turn = np.linspace(0.0, 2.0 * np.pi, 192, endpoint=False)
        return np.column_stack([np.cos(turn), np.sin(turn)])
    if axes > 3:  # obstacles are spheres there
        return np.vstack([np.eye(axes), -np.eye(axes)])
    height, spiral = np.linspace(1.0, -1.0, 512), np.arange(512) * np.pi * (3.0 - math.sqrt(5.0))
    across = np.sqrt(1.0 - height * height)
    return np.column_stack([across * np.cos(spiral), across * np.sin(spiral), height])
