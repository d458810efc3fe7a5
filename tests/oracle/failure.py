"""Who is left of a team, in which formation, and what failing motors do."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from escort_mj.control.setup import Setup
from escort_mj.numerics.noise import TAG
from escort_mj.numerics.reform import ALTERNATIONS, SAME

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

HOLD = 0.5  # how long a mad motor keeps a force [s]


@dataclass(frozen=True)
class KnownRobots:
    """The robots as the controller knows them.

    Attributes:
        lost: Robots that have failed, as is known, shape (n,).
        predecessors: Of chords, shape (cycles, n).
        chord_length: Of chords [m].
        vertices: Unit vector of each robot's vertex, shape (n, p).
    """

    lost: Mask
    predecessors: NDArray[np.int64]
    chord_length: float
    vertices: Array

    @classmethod
    def whole(cls, setup: Setup) -> KnownRobots:
        """Everybody, as the mission starts."""
        arrangement, n = setup.arrangement, setup.count
        return cls(
            np.zeros(n, dtype=bool),
            arrangement.predecessors if arrangement else np.zeros((0, n), dtype=np.int64),
            arrangement.length if arrangement else 0.0,
            setup.figure.vertices if setup.figure else np.zeros((n, setup.axes)),
        )

    @property
    def left(self) -> int:
        """How many robots are left."""
        return int((~self.lost).sum())

    def at(self, t: float, q: Array, c: Array, rotation: Array, setup: Setup) -> tuple[KnownRobots, Array]:
        """The team at a time, and the rotation of its figure; it re-forms when a failure becomes known.

        Args:
            t: Time [s].
            q: Measured positions, shape (n, p) [m].
            c: Position of the target, shape (p,) [m].
            rotation: Of the figure so far, shape (p, p).
            setup: Gives the failures and the smaller figures.
        """
        lost = self.lost.copy()
        for failure in setup.failures:
            lost[failure.robot - 1] |= t + 0.5 * setup.timestep >= failure.at + failure.notice
        if (lost == self.lost).all():
            return self, rotation
        left = int((~lost).sum())
        predecessors, vertices = self.predecessors, self.vertices
        if setup.arrangement is not None and setup.axes == 2:
            (ring,) = setup.arrangement.predecessors
            order = [0]
            while ring[order[-1]] != 0:
                order.append(int(ring[order[-1]]))
            kept = [robot for robot in order if not lost[robot]]
            closed = ring.copy()
            closed[kept] = np.roll(kept, -1)
            predecessors = closed[None]
        if setup.reforming is not None and not setup.teams:
            offset = q[~lost] - c
            directions = offset / np.linalg.norm(offset, axis=1, keepdims=True)
            points = setup.reforming.figures[len(lost) - left - 1]
            vertices = np.zeros_like(vertices)
            vertices[~lost] = placed(points, directions, np.concatenate([[rotation], setup.reforming.turns]))
            rotation = np.eye(len(rotation))
        length = 2.0 * setup.radius * float(np.sin(np.pi / left))
        return replace(
            self, lost=lost, predecessors=predecessors, vertices=vertices, chord_length=length
        ), rotation


def motors(t: float, tau: Array, applied_before: Array, setup: Setup) -> Array:
    """Return the command of the motors: tau, and where they have failed what is left of it, shape (n, p) [N].

    Args:
        t: Time [s].
        tau: The law's demand, shape (n, p) [N].
        applied_before: What they gave in the step before, shape (n, p) [N].
        setup: Gives the failures.
    """
    command = tau.copy()
    for failure in setup.failures:
        robot = failure.robot - 1
        since = t + 0.5 * setup.timestep - failure.at
        if since < 0.0:
            continue
        if failure.kind == "dead":
            command[robot] = 0.0
        elif failure.kind == "stuck":
            command[robot] = applied_before[robot]
        else:
            most = setup.force_limit[robot] if failure.force is None else failure.force
            command[robot] = most * throw(setup.seed, robot, int(since / HOLD), setup.axes)
    return command


def throw(seed: int, robot: int, draw: int, axes: int) -> Array:
    """Numbers uniform in (-1, 1) from the robot's stream, from block 2^32 on, shape (axes,)."""
    generator = np.random.Philox(
        key=np.array([seed, TAG], dtype=np.uint64),
        counter=np.array([2**32 - 1, 0, robot, draw], dtype=np.uint64),  # it counts before it gives
    )
    words = generator.random_raw(4 * (axes // 8 + 1))
    halves = np.stack([words & np.uint64(2**32 - 1), words >> np.uint64(32)], axis=1).ravel()
    return np.asarray((halves.astype(np.float64) + 0.5) * 2.0**-31 - 1.0)[:axes]


def placed(points: Array, directions: Array, turns: Array) -> Array:
    """Points turned and dealt so that each direction has one near, shape (k, p): assignment, then Kabsch.

    Args:
        points: Of the even figure, shape (k, p).
        directions: Of the robots from the target, shape (k, p).
        turns: Rotations to start from, shape (tries, p, p).
    """
    best, highest = points, -np.inf
    for rotation in turns:
        taken = np.full(len(points), -1)
        for _ in range(ALTERNATIONS):
            turned = points @ rotation.T
            found = linear_sum_assignment(directions @ turned.T, maximize=True)[1]
            if (found == taken).all():
                break
            taken = found
            u, _, vt = np.linalg.svd(directions.T @ points[taken])
            u[:, -1] *= np.sign(np.linalg.det(u @ vt))
            rotation = u @ vt
        alignment = float((directions * turned[taken]).sum())
        if alignment > highest + SAME:
            best, highest = turned[taken], alignment
    return best
