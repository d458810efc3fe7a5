"""A mission that is commanded from outside, one sample at a time: what every environment is made of."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from escort_mj import stopping
from escort_mj.api import load_scenario
from escort_mj.behaviors import AvoidObstacles
from escort_mj.errors import UsageError
from escort_mj.mission import bound_of, completed, conclude, examine, take_back
from escort_mj.native.on_demand import waited
from escort_mj.record.outcome import Outcome
from escort_mj.runs import Run
from escort_mj.scenario import Scenario
from escort_mj.signals import columns
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import build
from escort_mj.world.plant import Mark, Plant

Array = NDArray[np.float64]
Command = Literal["velocity", "force"]

TEAMMATES = 4  # that a robot observes, the nearest ones
SPEED = 2.0  # largest commanded speed per axis where the mission has no limit [m/s]


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


class Simulation:
    """Robots that do as they are told, in the world of a scenario.

    A command holds for 1 / `recording.rate` seconds, but for the last one, which may be shorter; the inner
    loop, if it is not replaced, runs at every physics step as in any run.

    Attributes:
        scenario: What is simulated; its behaviors are not used, the rest is.
        command: What is commanded: reference `velocity`, which the scenario's law follows, or motor `force`.
        scale: What a command of 1 means, shape (n, 1) [m/s or N].
        reward: Weights of what is asked.
    """

    def __init__(
        self,
        scenario: Scenario | str,
        command: Command = "velocity",
        reward: Reward | None = None,
    ) -> None:
        """Prepare a scenario; `reset` starts it.

        Args:
            scenario: A checked scenario, or what `load_scenario` takes.
            command: What is commanded.
            reward: Weights of what is asked; None for those of `Reward`.

        Raises:
            UsageError: If forces are to be commanded and there is no limit to scale them by.
        """
        self.scenario = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
        self.command, self.reward = command, reward if reward is not None else Reward()
        self._begin()

    def _begin(self) -> None:
        self.world = build(self.scenario, self.command)
        self.plant = Plant(self.world)
        self.count, self.axes = self.world.sizes["robot"], self.world.sizes["axis"]
        limit = self.world.setup.max_speed
        speed = limit if np.isfinite(limit) else SPEED
        self.scale: Array = np.full((self.count, 1), speed)
        if self.command == "force":
            self.scale = self.world.setup.force_limit[:, np.newaxis].copy()
            if not np.isfinite(self.scale).all():
                raise UsageError("commands of force are shares of robots.force_limit, which is null")
        behaviors = self.world.setup.behaviors
        self._safe_distance = max(
            [b.safe_distance for b in behaviors if isinstance(b, AvoidObstacles)], default=0.0
        )
        self.outcome, self.message = Outcome.RUNNING, ""
        self._bound = bound_of(self.scenario, self.world)
        self._samples: list[Array] = []
        self._taken = 0
        self._episodes: list[Array] = []
        self._taken_back: tuple[Mark, int] | None = None
        self._clearance: Array = np.full(self.count, np.inf)
        self._commanded = np.zeros((self.count, self.axes))
        self._wall = 0.0

    def reset(self, seed: int | None = None, command: Array | None = None) -> None:
        """Starts again, with the first sample taken.

        Args:
            seed: Of starts, noise and all else that is drawn; None for the one before.
            command: For the first physics step, shape (n, p), each number in [-1, 1]; None for rest.
        """
        if seed is not None:
            self.scenario = self.scenario.replace(seed=seed)
        self._begin()
        self._advance(np.zeros((self.count, self.axes)) if command is None else command)

    def step(self, command: Array) -> Array:
        """Hold a command until the next one is due.

        Args:
            command: Share of the largest velocity or force, shape (n, p); beyond [-1, 1] it is cut off.

        Returns:
            Reward of each robot, shape (n,).

        Raises:
            UsageError: If the mission has ended, or was not started.
        """
        if not self._samples or self.outcome is not Outcome.RUNNING:
            raise UsageError("the mission is not under way: call reset")
        self._advance(command)
        return self._rewards()

    def _advance(self, command: Array) -> None:
        with stopping.deferred(), stopping.deaf():  # an interrupt comes when the step has ended in order
            began = time.perf_counter() - waited()
            self._commanded = np.clip(np.asarray(command, dtype=float), -1.0, 1.0)
            told = self.plant.state.v_d if self.command == "velocity" else self.plant.state.tau
            told[:] = self._commanded * self.scale
            rows = np.empty((self._due(), self.world.record_size))
            mark = self.plant.mark()
            with native_loop(self.world):
                _, ended = self.plant.fill(rows)
            kept, outcome, message = examine(rows, self.plant, self._bound)
            if kept < len(rows):  # not at once: what broke is still to be observed
                self._taken_back = mark, kept
            else:
                self._episodes.append(ended)
            self._samples.append(rows[:kept])
            self._taken += len(rows)
            clearance = rows[:, columns("clearance", self.world.sizes)].reshape(len(rows), self.count, -1)
            self._clearance = clearance.min(axis=(0, 2), initial=np.inf)
            self._wall += time.perf_counter() - waited() - began
            if outcome is not Outcome.COMPLETED:
                self.outcome, self.message = outcome, message
            elif self._taken == self.world.schedule.count:
                self.outcome, self.message = outcome, completed(rows)

    def _due(self) -> int:
        """How many samples to take until the next command: one, and more where a window begins or ends."""
        schedule = self.world.schedule
        now = schedule.step(self._taken - 1) if self._taken else -1
        until = min((now // schedule.stride + 1) * schedule.stride, schedule.last)
        return schedule.before(until + 1) - self._taken

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return float(self.plant.state.time[0])

    @property
    def touching(self) -> NDArray[np.bool_]:
        """Which robots have touched anything since the last command, shape (n,)."""
        return self._clearance <= 0.0

    def _rewards(self) -> Array:
        state, setup, weigh = self.plant.state, self.world.setup, self.reward
        distance = np.linalg.norm(state.q - state.target_position, axis=1)
        found = -weigh.radius * np.abs(distance - setup.radius) / setup.radius
        spacing = setup.edges[1]
        if self.count > 1 and len(spacing):
            lack = np.maximum(spacing.min() - state.robot_distance_min, 0.0) / spacing.min()
            found -= weigh.spacing * lack
        found -= weigh.command * (self._commanded**2).mean(axis=1)
        if (safe := self._safe_distance) > 0.0:
            found -= weigh.clearance * np.clip(1.0 - self._clearance / safe, 0.0, 1.0)
        found -= weigh.touch * self.touching
        return np.nan_to_num(found, nan=-1e6, posinf=-1e6, neginf=-1e6)

    @property
    def width(self) -> int:
        """How many numbers a robot observes."""
        return (4 + min(self.count - 1, TEAMMATES)) * self.axes

    def observe(self) -> Array:
        """What each robot knows, by its sensors, shape (n, width).

        In this order, each of p numbers: the target's position relative to the robot and its velocity, the
        robot's own velocity, the way to the nearest obstacle's surface, and the nearest teammates' positions
        relative to the robot, by distance. Lengths in mission radii, velocities in largest velocities; 0
        where there is nothing.
        """
        state, setup = self.plant.state, self.world.setup
        q, radius = state.q_measured, setup.radius
        speed = setup.max_speed if np.isfinite(setup.max_speed) else SPEED
        rows = [
            (state.target_position_measured - q) / radius,
            np.broadcast_to(state.target_velocity_measured / speed, q.shape),
            state.v_measured / speed,
            self._ways_to_obstacles() / radius,
        ]
        if self.count > 1:
            ways = q[np.newaxis] - q[:, np.newaxis]
            square = (ways**2).sum(axis=2)
            np.fill_diagonal(square, np.inf)
            nearest = np.argsort(square, axis=1, kind="stable")[:, :TEAMMATES]
            rows.append(
                np.take_along_axis(ways, nearest[:, :, np.newaxis], 1).reshape(self.count, -1) / radius
            )
        return np.concatenate(rows, axis=1)

    def _ways_to_obstacles(self) -> Array:
        """From each robot's surface to that of the nearest obstacle, shape (n, p) [m]."""
        state, setup = self.plant.state, self.world.setup
        bodies = len(setup.obstacle_radius)
        if not bodies:
            return np.zeros((self.count, self.axes))
        places = state.obstacle_position[np.newaxis]
        if setup.shaped:
            places = state.obstacle_point.reshape(self.count + 1, bodies, self.axes)[:-1]
        ways = places - state.q_measured[:, np.newaxis]
        length = np.linalg.norm(ways, axis=2)
        gap = length - setup.obstacle_radius - setup.robot_radius[:, np.newaxis]
        worst = np.argmin(gap, axis=1)
        each = np.arange(self.count)
        share = gap[each, worst] / np.maximum(length[each, worst], 1e-9)
        return np.asarray(ways[each, worst] * share[:, np.newaxis])

    def run(self) -> Run:
        """What came of the mission so far, as of any run: trace, metrics and the scenario's verdicts."""
        if self.outcome is Outcome.RUNNING:
            outcome, message = Outcome.INTERRUPTED, f"ended from outside at {self.time:.2f} s"
        else:
            outcome, message = self.outcome, self.message
        if self._taken_back is not None:
            with native_loop(self.world):
                self._episodes.append(take_back(self.plant, *self._taken_back))
            self._taken_back = None
        samples = np.concatenate([np.zeros((0, self.world.record_size)), *self._samples])
        episodes = np.vstack([*self._episodes, self.plant.under_way()])
        flight = conclude(self.scenario, self.plant, samples, episodes, outcome, message, self._wall)
        return Run(flight)
