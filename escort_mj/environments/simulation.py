"""A mission that is commanded from outside, one sample at a time: what every environment is made of."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from escort_mj.api.runs import Run
from escort_mj.environments.draws import SET, Values, values_in
from escort_mj.environments.fleet import Fleet, Side
from escort_mj.environments.own import Parts
from escort_mj.environments.rivals import RivalReward, Rivals
from escort_mj.environments.senses import Command, Reward, Seen
from escort_mj.errors import UsageError
from escort_mj.mission.session import Session
from escort_mj.record.outcome import Outcome
from escort_mj.scenario import Scenario
from escort_mj.scenario.arguments import SEEDS, Source, checked, numbers, whole_number
from escort_mj.snapshots import Snapshot
from escort_mj.world.model.build import World
from escort_mj.world.plant import Plant

Array = NDArray[np.float64]


class Simulation:
    """Robots that do as they are told, in the world of a scenario.

    A command holds for 1 / `recording.rate` seconds, but for the last one, which may be shorter; the inner
    loop, if it is not replaced, runs at every physics step as in any run.

    Attributes:
        fleet: It, as a fleet of one.
        command: What is commanded: reference `velocity`, which the scenario's law follows, `residual`, a
            velocity added to what the scenario's behaviors lead to, or motor `force`.
        count: Number of robots, n.
        axes: p.
        width: How many numbers a robot observes.
        reward: Weights of what is asked.
        limits: The largest size of each number in `observe_within`, shape (width,); the same for every seed.
        side: Who is commanded: `robots`, `opponents` or `both`; the others do as the scenario says.
        restored: How often `restore` was called.
    """

    @checked
    def __init__(
        self,
        scenario: Scenario | Source,
        command: Command = "velocity",
        reward: Reward | None = None,
        side: Side = "robots",
        rival_reward: RivalReward | None = None,
        sample: Mapping[str, Any] | None = None,
        own: Parts = (),
    ) -> None:
        """Prepare a scenario; `reset` starts it.

        Args:
            scenario: A checked scenario, or what `load_scenario` takes.
            command: What is commanded.
            reward: Weights of what is asked; None for those of `Reward`.
            side: Who is commanded.
            rival_reward: Weights of what is asked of opponents; None for those of `RivalReward`.
            sample: Scenario keys, and for each a range (`low`, `high`, `scale`, `whole`) or a list, as
                `sample.over` of a study: each mission's values are drawn from them, by its seed.
            own: What robots observe beside the usual, in this order, and terms of their rewards.

        Raises:
            UsageError: If an argument is not of its kind, or forces are to be commanded and there is no limit
                to scale them by, or opponents and there are none.
            ScenarioError: If what `sample` has is impossible.
        """
        self.fleet = Fleet(scenario, 1, command, reward, 1, side, rival_reward, sample, own, keep=True)
        self.command, self.reward, self.side = command, reward or Reward(), side
        senses = self.fleet.senses
        self.count, self.axes, self.width = senses.robots, senses.axes, senses.width
        self.limits: Seen = senses.limits(self.session.bound)
        self.restored = 0

    @property
    def session(self) -> Session:
        """The mission itself."""
        return self.fleet.missions[0]

    @property
    def scale(self) -> Array:
        """What a command of 1 means in this mission, shape (n, 1) [m/s or N]."""
        return self.fleet.senses.scale[0]

    @property
    def values(self) -> Values:
        """What is drawn and set in this mission, by scenario key."""
        return dict(self.fleet.values[0])

    @property
    def scenario(self) -> Scenario:
        """What is simulated; its behaviors are not used, the rest is."""
        return self.session.scenario

    @property
    def world(self) -> World:
        """What is simulated now."""
        return self.session.world

    @property
    def plant(self) -> Plant:
        """Steps it."""
        return self.session.plant

    @property
    def rivals(self) -> Rivals | None:
        """The side of the opponents; None where they are not commanded."""
        return self.fleet.rivals[0] if self.fleet.rivals else None

    @property
    def outcome(self) -> Outcome:
        """How the mission stands."""
        return self.session.outcome

    @property
    def message(self) -> str:
        """How it ended, in words; empty while it runs."""
        return self.session.message

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.session.time

    @property
    def under_way(self) -> bool:
        """Whether it has begun and not ended."""
        return bool(self.fleet.begun[0]) and self.outcome is Outcome.RUNNING

    def reset(
        self,
        seed: int | None = None,
        command: ArrayLike | None = None,
        values: Mapping[str, Any] | None = None,
    ) -> None:
        """Start again, with the first sample taken.

        Args:
            seed: Of starts, noise and all else that is drawn; None for the one before.
            command: For the first physics step, shape (n, p), each number in [-1, 1]; None for rest.
            values: Scenario keys and their values in this mission, also in place of what is drawn.

        Raises:
            UsageError: If an argument is not of its kind, or values make a mission of another shape.
            ScenarioError: If values are impossible.
        """
        given, wanted = self._commanded(command), values_in({SET: values})
        seed = self.scenario.seed if seed is None else whole_number(seed, "seed", SEEDS, 0)
        self.fleet.begin(0, seed, wanted)
        self._advance(given, None if self.rivals is None else np.zeros((self.rivals.count, self.axes)))

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
        self._check_under_way()
        given, wanted = self._commanded(command), None
        if self.rivals is not None:
            shape, words = (self.rivals.count, self.axes), "one row per opponent, shares of its speed"
            wanted = np.zeros(shape) if of_rivals is None else numbers(of_rivals, "of_rivals", shape, words)
        elif of_rivals is not None:
            raise UsageError("of_rivals: found commands; opponents are not commanded (side)")
        self._advance(given, wanted)
        return self.fleet.senses.rewards[0].copy()

    def push(self, robot: int, force: ArrayLike, seconds: float | None = None) -> None:
        """Push a robot from outside, as `LiveMission.push` does.

        Args:
            robot: Its number, from 1 as in all results.
            force: World frame, shape (p,) [N].
            seconds: How long [s]; None until `release`.

        Raises:
            UsageError: If the mission is not under way, or as of `LiveMission.push`.
        """
        self._check_under_way()
        self.session.push(robot, force, seconds)

    def release(self, robot: int | None = None) -> None:
        """End pushes: of a robot, by its number from 1, or of all."""
        self.session.release(robot)

    def snapshot(self) -> Snapshot:
        """Return this moment; `restore` comes back to it, as often as wanted.

        Raises:
            UsageError: If the mission was not started.
        """
        return self.fleet.snapshot(0)

    @checked
    def restore(self, snapshot: Snapshot) -> None:
        """Come back to a moment; what follows has the same bits as what followed then.

        Args:
            snapshot: Of the same scenario, commanded likewise, whatever its seed; also of another simulation.

        Raises:
            UsageError: If it is of another scenario.
        """
        self.fleet.restore(0, snapshot)
        self.restored += 1

    def _check_under_way(self) -> None:
        if not self.under_way:
            raise UsageError("the mission is not under way: call reset")

    def _commanded(self, command: ArrayLike | None) -> Array:
        """Return commands of the robots as they were given, shape (n, p)."""
        shape = self.count, self.axes
        if command is None:
            return np.zeros(shape)
        return numbers(command, "command", shape, "one row per robot, from -1 to 1")

    def _advance(self, command: Array, of_rivals: Array | None) -> None:
        wanted = None if of_rivals is None else of_rivals[None]
        self.fleet.advance([0], command[None], wanted)

    @property
    def touching(self) -> NDArray[np.bool_]:
        """Which robots have touched anything since the last command, shape (n,)."""
        return self.fleet.touching[0].copy()

    @property
    def reward_terms(self) -> dict[str, Array]:
        """What the last rewards are sums of, by name, each of shape (n,)."""
        return {name: term[0] for name, term in self.fleet.senses.reward_terms().items()}

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
        return self.fleet.senses.observed[0].copy()

    def observe_within(self) -> Seen:
        """What each robot knows, as learners take it, shape (n, width): cut off at `limits`, without NaN."""
        return np.asarray(self.fleet.senses.bounded(self.limits)[0])

    def samples(self, since: int) -> Array:
        """Return the samples worth keeping that commands led to, shape (k, record_size), see `signals.py`.

        Args:
            since: How many commands to leave out; the first sample counts as one.
        """
        return self.fleet.samples(0, since)

    @property
    def commands(self) -> int:
        """How many commands have been given, the one of the first sample included."""
        return self.fleet.commands(0)

    def run(self) -> Run:
        """What came of the mission so far, as of any run: trace, metrics and the scenario's verdicts."""
        return Run(self.fleet.flight(0))
