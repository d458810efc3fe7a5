"""Goals that robots have reached, and places of their formations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from escort_mj.behaviors.formation import SLOWEST, Formation
from escort_mj.behaviors.goal import Goal
from escort_mj.control.setup import Setup

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


class Places:
    """Where robots in formations are to be, step by step."""

    def __init__(self, setup: Setup) -> None:
        self._setup = setup
        self._phases = [phase for phase, _ in setup.numbered(Formation)]
        self._begun, self._lag = False, np.zeros(len(self._phases))
        self._way = [np.array([1.0, 0.0]) for _ in self._phases]

    def pace(self, b: int, q: Array, phase: NDArray[np.int64], lost: Mask, goals: GoalsReached) -> float:
        """Share of its speed at which frame b goes on: 1 while all are within reach."""
        formation = self._setup.numbered(Formation)[b][1]
        if formation.waits is None:
            return 1.0
        if not self._begun:
            return 0.0
        away = np.linalg.norm(goals.point - q, axis=1)[(phase == self._phases[b]) & ~lost]
        return float(np.interp(away.max(initial=0.0), (formation.reach, formation.waits), (1.0, 0.0)))

    def place(
        self,
        t: float,
        q: Array,
        lost: Mask,
        target: Array,
        velocity: Array,
        phase: NDArray[np.int64],
        goals: GoalsReached,
    ) -> None:
        """Writes the goals of the robots in formations.

        Args:
            t: Time [s].
            q: Measured positions of the robots, shape (n, p) [m].
            lost: Robots that have failed, shape (n,).
            target: Measured position of the target, shape (p,) [m].
            velocity: Measured velocity of the target, shape (p,) [m/s].
            phase: That rules each robot, shape (n,).
            goals: Their points, velocities and what is left are changed.
        """
        setup, p = self._setup, self._setup.axes
        for b, (number, frame) in enumerate(zip(self._phases, setup.formations, strict=True)):
            pace, then = self.pace(b, q, phase, lost, goals), t - self._lag[b]
            value, rate = frame.function.position(then), frame.function.velocity(then)
            center, drift, scale, growing = value[:p], rate[:p], value[p + 2], rate[p + 2]
            way, turning = value[p : p + 2], rate[p : p + 2]
            heading = drift[:2]
            if frame.follows:
                center, drift, heading = target, velocity * setup.target_feedforward, velocity[:2]
            if frame.along:
                way, turning = self._way[b], np.zeros(2)
                if np.linalg.norm(heading) > SLOWEST:
                    way = self._way[b] = heading / np.linalg.norm(heading)
                    later = frame.function.velocity(then + setup.timestep)[:2]
                    if not frame.follows and np.linalg.norm(later) > SLOWEST:
                        turning = (later / np.linalg.norm(later) - way) / setup.timestep
            turn, spin = np.eye(p), np.zeros((p, p))
            turn[:2, :2] = [[way[0], -way[1]], [way[1], way[0]]]
            spin[:2, :2] = [[turning[0], -turning[1]], [turning[1], turning[0]]]
            mine = (phase == number) | (b == 0 and not self._begun and not setup.goals)
            goals.point[mine] = (center + scale * frame.offsets @ turn.T)[mine]
            moves = drift + growing * frame.offsets @ turn.T + scale * frame.offsets @ spin.T
            goals.velocity[mine], goals.left[mine] = pace * moves[mine], 0
            self._lag[b] += (1.0 - pace) * setup.timestep
        self._begun = True


class GoalsReached:
    """The point that each robot goes to, step by step.

    Attributes:
        point: Shape (n, p) [m].
        velocity: How fast it moves, shape (n, p) [m/s].
        left: Waypoints after it, shape (n,).
    """

    def __init__(self, setup: Setup) -> None:
        self._stacks = setup.numbered(Goal)
        self._lists = setup.goals
        self._at = np.zeros((len(setup.goals), setup.count), dtype=int)
        self.point = np.zeros((setup.count, setup.axes))
        self.velocity = np.zeros((setup.count, setup.axes))
        self.left = np.zeros(setup.count)
        for i in range(setup.count if setup.goals else 0):
            self._go(i, 0)

    def choose(self, q: Array, phase: NDArray[np.int64]) -> None:
        """Moves on where a robot has come to its waypoint.

        Args:
            q: Measured positions, shape (n, p) [m].
            phase: That rules each robot, shape (n,).
        """
        for b, (number, goal) in enumerate(self._stacks):
            for i in np.flatnonzero(phase == number):
                points, at = self._lists[b][i], self._at[b, i]
                if np.linalg.norm(points[at] - q[i]) <= goal.reach and at + 1 < len(points):
                    self._at[b, i] += 1
                self._go(int(i), b)

    def _go(self, i: int, b: int) -> None:
        points, at = self._lists[b][i], self._at[b, i]
        self.point[i], self.left[i] = points[at], len(points) - 1 - at
