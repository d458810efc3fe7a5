"""What robots observe and what is asked of them, for several missions of one scenario at once.

Everything is read from samples (`signals.py`), one of each mission, by operations on the arrays of all
missions: the first axis of every array here counts missions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from escort_mj.behaviors import AvoidObstacles
from escort_mj.errors import UsageError
from escort_mj.signals import columns
from escort_mj.world.model.build import World

Array = NDArray[np.float64]
Seen = NDArray[np.float32]
Command = Literal["velocity", "force"]

TEAMMATES = 4  # that a robot observes, the nearest ones
SPEED = 2.0  # largest commanded speed per axis where the mission has no limit [m/s]
FASTEST = 100.0  # largest observed velocity, in largest commanded speeds
BROKEN = -1e6  # reward where a state is no longer a number


@dataclass(frozen=True)
class Reward:
    """What is asked of each robot at each command, as weights of terms without units.

    Attributes:
        radius: Of the distance to the sphere around the target, in radii.
        spacing: Of the lack of distance to the nearest teammate, as a share of the even formation's spacing.
        command: Of the mean square of the scaled command.
        clearance: Of the lack of distance to anything, as a share of `avoid_obstacles`' safe distance.
        touch: Of having touched anything since the last command. A mission has thousands of commands: with
            less than this it pays to run into obstacles rather than to go around them.
    """

    radius: float = 1.0
    spacing: float = 1.0
    command: float = 0.01
    clearance: float = 1.0
    touch: float = 100.0


class Senses:
    """Observations and rewards of N missions with n robots in p axes.

    Attributes:
        count: N.
        robots: n.
        axes: p.
        width: How many numbers a robot observes.
        scale: What a command of 1 means, shape (N, n, 1) [m/s or N].
    """

    def __init__(self, worlds: Sequence[World], command: Command, reward: Reward) -> None:
        """Prepare for missions in worlds of the same sizes.

        Args:
            worlds: One of each mission.
            command: What is commanded.
            reward: Weights of what is asked.

        Raises:
            UsageError: If forces are to be commanded and there is no limit to scale them by.
        """
        world, self.count = worlds[0], len(worlds)
        self._command, self._weigh = command, reward
        self._sizes = world.sizes
        self.robots, self.axes = world.sizes["robot"], world.sizes["axis"]
        self._obstacles = len(world.setup.obstacle_radius)
        self._mates = min(self.robots - 1, TEAMMATES)
        self.width = (4 + self._mates) * self.axes
        self._radius = world.setup.radius
        self._speed = world.setup.max_speed if np.isfinite(world.setup.max_speed) else SPEED
        self._safe_distance = max(
            [b.safe_distance for b in world.setup.behaviors if isinstance(b, AvoidObstacles)], default=0.0
        )
        self.scale = np.full((self.count, self.robots, 1), self._speed)
        self._spacing = np.full((self.count, 1), np.inf)
        self._robot_radius = np.zeros((self.count, self.robots, 1))
        self._obstacle_radius = np.zeros((self.count, 1, self._obstacles))
        self._missions = np.arange(self.count)[:, None]
        self._each = np.arange(self.robots)
        for k, each in enumerate(worlds):
            self.enter(k, each)

    def enter(self, mission: int, world: World) -> None:
        """Let a mission take place in another world.

        Args:
            mission: Which one, from 0.
            world: Where.

        Raises:
            UsageError: If its sizes are others, if there is no target, or if forces are to be commanded
                without a limit.
        """
        if world.sizes != self._sizes:
            raise UsageError(f"missions of one environment have one size: {world.sizes}, not {self._sizes}")
        setup = world.setup
        if setup.target_radius is None:
            raise UsageError("target: found null; what robots of an environment observe is of a target")
        if self._command == "force":
            if not np.isfinite(setup.force_limit).all():
                raise UsageError("commands of force are shares of robots.force_limit, which is null")
            self.scale[mission, :, 0] = setup.force_limit
        spacing = setup.edges[1]
        self._spacing[mission] = spacing.min() if self.robots > 1 and len(spacing) else np.inf
        self._robot_radius[mission, :, 0] = setup.robot_radius
        self._obstacle_radius[mission, 0] = setup.obstacle_radius

    def limits(self, bound: float) -> Seen:
        """Return the largest size of each number that a robot observes, shape (width,).

        Args:
            bound: Distance to the target at which a mission ends [m]; teammates are at most twice as far.
        """
        lengths, speeds = 2.0 * bound / self._radius, FASTEST
        parts = [lengths, speeds, speeds, *[lengths] * (1 + self._mates)]
        return np.repeat(np.array(parts, dtype=np.float32), self.axes)

    def bounded(self, observed: Array, limits: Seen) -> Seen:
        """Return observations as learners take them: cut off at `limits`, and 0 where there is no number.

        Args:
            observed: Shape (..., width).
            limits: See `limits`.
        """
        found = np.clip(observed, -limits, limits, dtype=np.float32, casting="unsafe")
        if np.isnan(found).any():
            found[np.isnan(found)] = 0.0
        return found

    def _of(self, name: str, samples: Array) -> Array:
        """Return a signal of the robots, shape (N, n, p)."""
        return samples[:, columns(name, self._sizes)].reshape(self.count, self.robots, self.axes)

    def _target(self, name: str, samples: Array) -> Array:
        """Return a signal of the target, shape (N, 1, p)."""
        return samples[:, None, columns(name, self._sizes)]

    def clearance(self, samples: Array) -> Array:
        """Return the least distance of each robot to anything, of samples of shape (k, size): (k, n) [m]."""
        every = samples[:, columns("clearance", self._sizes)]
        return np.asarray(every.reshape(len(samples), self.robots, -1).min(axis=2, initial=np.inf))

    def rewards(self, samples: Array, clearance: Array, commanded: Array) -> Array:
        """Return the reward of each robot, shape (N, n).

        Args:
            samples: The newest of each mission, shape (N, size).
            clearance: Least distance to anything since the last command, shape (N, n) [m].
            commanded: The last command, shape (N, n, p).
        """
        weigh = self._weigh
        distance = _length(self._of("q", samples) - self._target("target_position", samples))
        found = -weigh.radius * np.abs(distance - self._radius) / self._radius
        if self.robots > 1:
            nearest = samples[:, columns("robot_distance_min", self._sizes)]
            lack = np.maximum(1.0 - nearest / self._spacing, 0.0)
            found -= weigh.spacing * np.where(np.isfinite(self._spacing), lack, 0.0)
        found -= weigh.command * (commanded**2).mean(axis=2)
        if (safe := self._safe_distance) > 0.0:
            found -= weigh.clearance * np.clip(1.0 - clearance / safe, 0.0, 1.0)
        found -= weigh.touch * (clearance <= 0.0)
        if not np.isfinite(found).all():
            found[~np.isfinite(found)] = BROKEN
        return found

    def observe(self, samples: Array, points: Array | None) -> Array:
        """Return what each robot observes, shape (N, n, width); see `Simulation.observe`.

        Args:
            samples: The newest of each mission, shape (N, size).
            points: The point of each obstacle nearest to each robot, shape (N, n, m, p) [m]; None where all
                obstacles are spheres.
        """
        q = self._of("q_measured", samples)
        found = np.empty((self.count, self.robots, 4 + self._mates, self.axes))
        found[:, :, 0] = (self._target("target_position_measured", samples) - q) / self._radius
        found[:, :, 1] = self._target("target_velocity_measured", samples) / self._speed
        found[:, :, 2] = self._of("v_measured", samples) / self._speed
        found[:, :, 3] = self._ways_to_obstacles(q, samples, points) / self._radius
        if self._mates:
            ways = q[:, None] - q[:, :, None]
            square = (ways**2).sum(axis=3)
            square[:, self._each, self._each] = np.inf
            nearest = np.argsort(square, axis=2, kind="stable")[:, :, : self._mates]
            found[:, :, 4:] = np.take_along_axis(ways, nearest[..., None], 2) / self._radius
        return found.reshape(self.count, self.robots, self.width)

    def _ways_to_obstacles(self, q: Array, samples: Array, points: Array | None) -> Array:
        """Return the ways from each robot's surface to that of the nearest obstacle, shape (N, n, p) [m]."""
        if not self._obstacles:
            return np.zeros_like(q)
        if points is None:
            centers = samples[:, columns("obstacle_position", self._sizes)]
            points = centers.reshape(self.count, 1, self._obstacles, self.axes)
        ways = points - q[:, :, None]
        length = _length(ways)
        gap = length - self._obstacle_radius - self._robot_radius
        worst = self._missions, self._each, np.argmin(gap, axis=2)
        return np.asarray(ways[worst] * (gap[worst] / np.maximum(length[worst], 1e-9))[..., None])


def _length(vectors: Array) -> Array:
    """Return the length of vectors along the last axis."""
    return np.asarray(np.sqrt((vectors**2).sum(axis=-1)))
