"""A mission that is commanded from outside, one sample at a time: what every environment is made of."""

from __future__ import annotations

import time
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from escort_mj import stopping
from escort_mj.api import load_scenario
from escort_mj.api.runs import Run
from escort_mj.environments.rivals import RivalReward, Rivals
from escort_mj.environments.senses import Command, Reward, Seen, Senses
from escort_mj.errors import UsageError
from escort_mj.mission import bound_of, completed, conclude, examine, take_back
from escort_mj.native.on_demand import waited
from escort_mj.record.outcome import Outcome
from escort_mj.scenario import Scenario
from escort_mj.scenario.arguments import SEEDS, Source, checked, numbers, whole_number
from escort_mj.scenario.geometry.steps import Schedule
from escort_mj.scenario.mission import Mission
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import build
from escort_mj.world.plant import Mark, Plant

Array = NDArray[np.float64]
OneSide = Literal["robots", "opponents"]
Side = Literal[OneSide, "both"]


def due(schedule: Schedule, taken: int) -> int:
    """Return how many samples to take until the next command: one, and more where a window begins or ends.

    Args:
        schedule: When samples are taken.
        taken: How many have been taken.
    """
    now = schedule.step(taken - 1) if taken else -1
    until = min((now // schedule.stride + 1) * schedule.stride, schedule.last)
    return schedule.before(until + 1) - taken


def next_hop(schedule: Schedule, taken: int) -> tuple[int, int]:
    """Return how many samples to take until the next command, and how many physics steps that takes.

    Args:
        schedule: When samples are taken.
        taken: How many have been taken.
    """
    count = due(schedule, taken)
    done = schedule.step(taken - 1) + 1 if taken else 0
    return count, schedule.step(taken + count - 1) + 1 - done


class Simulation:
    """Robots that do as they are told, in the world of a scenario.

    A command holds for 1 / `recording.rate` seconds, but for the last one, which may be shorter; the inner
    loop, if it is not replaced, runs at every physics step as in any run.

    Attributes:
        scenario: What is simulated; its behaviors are not used, the rest is.
        command: What is commanded: reference `velocity`, which the scenario's law follows, or motor `force`.
        scale: What a command of 1 means, shape (n, 1) [m/s or N].
        count: Number of robots, n.
        axes: p.
        width: How many numbers a robot observes.
        reward: Weights of what is asked.
        limits: The largest size of each number in `observe_within`, shape (width,); the same for every seed.
        side: Who is commanded: `robots`, `opponents` or `both`; the others do as the scenario says.
        rivals: The side of the opponents; None where they are not commanded.
    """

    @checked
    def __init__(
        self,
        scenario: Scenario | Source,
        command: Command = "velocity",
        reward: Reward | None = None,
        side: Side = "robots",
        rival_reward: RivalReward | None = None,
    ) -> None:
        """Prepare a scenario; `reset` starts it.

        Args:
            scenario: A checked scenario, or what `load_scenario` takes.
            command: What is commanded.
            reward: Weights of what is asked; None for those of `Reward`.
            side: Who is commanded.
            rival_reward: Weights of what is asked of opponents; None for those of `RivalReward`.

        Raises:
            UsageError: If an argument is not of its kind, or forces are to be commanded and there is no limit
                to scale them by, or opponents and there are none.
        """
        self.side, self._rival_reward = side, rival_reward or RivalReward()
        self.command, self.reward = command, reward or Reward()
        self.scenario = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
        self._begin()
        self.limits: Seen = self._senses.limits(self._bound)

    def _begin(self) -> None:
        outside = None if self.side == "opponents" else self.command
        self.world = build(Mission(self.scenario, outside=outside, opponents_outside=self.side != "robots"))
        self.plant = Plant(self.world)
        self._senses = Senses(self.plant, 1, self.command, self.reward)
        self.rivals = None if self.side == "robots" else Rivals(self.plant, self._rival_reward)
        self.count, self.axes, self.width = self._senses.robots, self._senses.axes, self._senses.width
        self.scale: Array = self._senses.scale[0]
        self.outcome, self.message = Outcome.RUNNING, ""
        self._bound = bound_of(self.scenario, self.world)
        self._senses.enter(0, self.plant, self._bound)
        self._samples: list[Array] = []
        self._taken = 0
        self._episodes: list[Array] = []
        self._taken_back: tuple[Mark, int] | None = None
        self._wall = 0.0

    def reset(self, seed: int | None = None, command: ArrayLike | None = None) -> None:
        """Start again, with the first sample taken.

        Args:
            seed: Of starts, noise and all else that is drawn; None for the one before.
            command: For the first physics step, shape (n, p), each number in [-1, 1]; None for rest.

        Raises:
            UsageError: If an argument is not of its kind.
        """
        given = self._commanded(command)
        if seed is not None:
            self.scenario = self.scenario.replace(seed=whole_number(seed, "seed", SEEDS, 0))
        self._begin()
        self._advance(given)

    def step(self, command: ArrayLike | None = None, of_rivals: ArrayLike | None = None) -> Array:
        """Hold a command until the next one is due.

        Args:
            command: Share of the largest velocity or force, shape (n, p); beyond [-1, 1] it is cut off. Not
                used where the robots are not commanded.
            of_rivals: Share of the speed of each opponent's policy, shape (o, p); None for rest.

        Returns:
            Reward of each robot, shape (n,).

        Raises:
            UsageError: If the mission has ended, or was not started, or if a command has another shape or
                contains a number that is not finite; the mission does not change.
        """
        if not self._samples or self.outcome is not Outcome.RUNNING:
            raise UsageError("the mission is not under way: call reset")
        given = self._commanded(command)
        if self.rivals is not None:
            shape, words = (self.rivals.count, self.axes), "one row per opponent, shares of its speed"
            wanted = np.zeros(shape) if of_rivals is None else numbers(of_rivals, "of_rivals", shape, words)
            self.rivals.command(wanted)
        elif of_rivals is not None:
            raise UsageError("of_rivals: found commands; opponents are not commanded (side)")
        self._advance(given)
        return self._senses.rewards[0].copy()

    def _commanded(self, command: ArrayLike | None) -> Array:
        """Return commands of the robots as they were given, shape (n, p)."""
        shape = self.count, self.axes
        if command is None:
            return np.zeros(shape)
        return numbers(command, "command", shape, "one row per robot, from -1 to 1")

    def _advance(self, command: Array) -> None:
        with stopping.deferred(), stopping.deaf():  # an interrupt comes when the step has ended in order
            began = time.perf_counter() - waited()
            commanded = self._senses.commanded[0]
            np.clip(command, -1.0, 1.0, out=commanded, dtype=float)
            if self.side != "opponents":
                given = self.plant.state.v_d if self.command == "velocity" else self.plant.state.tau
                given[:] = commanded * self.scale
            rows = np.empty((due(self.world.schedule, self._taken), self.world.record_size))
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
            self._senses.perceive(0, rows)
            if self.rivals is not None:
                self.rivals.perceive()
            self._wall += time.perf_counter() - waited() - began
            if outcome is not Outcome.COMPLETED:
                self.outcome, self.message = outcome, message
            elif self._taken == self.world.schedule.count:
                self.outcome, self.message = outcome, completed(rows)

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return float(self.plant.state.time[0])

    @property
    def touching(self) -> NDArray[np.bool_]:
        """Which robots have touched anything since the last command, shape (n,)."""
        return np.asarray(self._senses.clearance[0] <= 0.0)

    def observe(self) -> Array:
        """What each robot knows, by its sensors, shape (n, width).

        In this order, each of p numbers: the target's position relative to the robot and its velocity, the
        robot's own velocity, the way to the nearest obstacle's surface, and the nearest teammates' positions
        relative to the robot, by distance; in a mission with opponents also the way to the nearest one that
        comes, and its velocity. Lengths in mission radii, velocities in largest velocities; 0 where there is
        nothing.

        Where robots have knowledge of their own, the target is where a robot estimates it to be, teammates
        are those that it has heard, where they may be by now, and other robots that it sees are obstacles.
        Where robots are in teams, the target is the middle of their team's targets, teammates are members of
        the team, other robots are obstacles, and lengths are in radii of the team.
        """
        return self._senses.observed[0].copy()

    def observe_within(self) -> Seen:
        """What each robot knows, as learners take it, shape (n, width): cut off at `limits`, without NaN."""
        return np.asarray(self._senses.bounded(self.limits)[0])

    def samples(self, since: int) -> Array:
        """Return the samples worth keeping that commands led to, shape (k, record_size), see `signals.py`.

        Args:
            since: How many commands to leave out; the first sample counts as one.
        """
        return np.concatenate([np.zeros((0, self.world.record_size)), *self._samples[since:]])

    @property
    def commands(self) -> int:
        """How many commands have been given, the one of the first sample included."""
        return len(self._samples)

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
        samples = self.samples(0)
        episodes = np.vstack([*self._episodes, self.plant.under_way()])
        flight = conclude(self.scenario, self.plant, samples, episodes, outcome, message, self._wall)
        return Run(flight)
