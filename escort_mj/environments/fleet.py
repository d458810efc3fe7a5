"""Missions of one scenario side by side, each stepped natively, in threads; no trace of them is kept.

A thread needs no Python while MuJoCo and the law take a mission's steps. Observations and rewards are then
found for all missions at once (`senses.py`). Each mission has the bits that it has alone, on any number of
threads.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from escort_mj import stopping
from escort_mj.api import load_scenario
from escort_mj.environments.senses import Command, Reward, Seen, Senses
from escort_mj.environments.simulation import due, obstacle_points
from escort_mj.mission import bound_of, examine
from escort_mj.record.outcome import Outcome
from escort_mj.scenario import Scenario
from escort_mj.signals import columns
from escort_mj.study.engine.parallel import cores
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import World, build
from escort_mj.world.plant import Plant

Array = NDArray[np.float64]


class Fleet:
    """N missions of a scenario that differ by seed and are commanded from outside; see `Simulation`.

    Attributes:
        scenario: What all of them fly.
        senses: What robots observe and what is asked of them.
        limits: As of `Simulation`.
        outcome: How each mission stands.
        touching: Which robots have touched anything since the last command, shape (N, n).
    """

    def __init__(
        self,
        scenario: Scenario | str,
        count: int,
        command: Command = "velocity",
        reward: Reward | None = None,
        threads: int | None = None,
    ) -> None:
        """Prepare missions; `begin` starts them.

        Args:
            scenario: A checked scenario, or what `load_scenario` takes.
            count: N.
            command: What is commanded.
            reward: Weights of what is asked; None for those of `Reward`.
            threads: How many step missions; None for one per core.

        Raises:
            UsageError: If forces are to be commanded and there is no limit to scale them by.
        """
        self.scenario = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
        self._command = command
        world = build(self.scenario, command)
        self._worlds: list[World] = [world] * count
        self._plants: list[Plant] = [Plant(world)] * count  # each gets its own when it begins
        self.senses = Senses(self._worlds, command, reward if reward is not None else Reward())
        self._bounds = np.full(count, bound_of(self.scenario, world))
        self.limits: Seen = self.senses.limits(float(self._bounds[0]))
        self.outcome = [Outcome.RUNNING] * count
        self._taken = [0] * count
        self._given: list[Array] = [np.zeros((0,))] * count
        self._newest: Array = np.zeros((count, world.record_size))
        self._sizes = world.sizes
        self._law = slice(columns("q", self._sizes).start, columns("disturbance", self._sizes).stop)
        robots, axes = self.senses.robots, self.senses.axes
        self.touching = np.zeros((count, robots), dtype=bool)
        shape = (count, robots, len(world.setup.obstacle_radius), axes)
        self._points: Array | None = np.zeros(shape) if world.setup.shaped else None
        self._threads = min(threads or cores(), count)
        self._pool = ThreadPoolExecutor(self._threads - 1, "missions") if self._threads > 1 else None

    def begin(self, mission: int, seed: int) -> None:
        """Put a mission at its start; `advance` takes its first sample.

        Args:
            mission: Which one, from 0.
            seed: Of starts, noise and all else that is drawn.
        """
        scenario = self.scenario.replace(seed=seed)
        world = build(scenario, self._command)
        self.senses.enter(mission, world)
        plant = Plant(world)
        self._worlds[mission], self._plants[mission] = world, plant
        self._given[mission] = plant.state.v_d if self._command == "velocity" else plant.state.tau
        self._bounds[mission] = bound_of(scenario, world)
        self.outcome[mission], self._taken[mission] = Outcome.RUNNING, 0

    def advance(self, missions: Sequence[int], commands: Array | Seen) -> Array:
        """Hold commands until the next ones are due; missions that have just begun take their first sample.

        Args:
            missions: Which ones, from 0; none has ended.
            commands: Of all N, shape (N, n, p): shares of the largest velocity or force, cut off at 1.

        Returns:
            Reward of each robot, shape (N, n); of other missions it means nothing.
        """
        commanded = np.clip(np.asarray(commands, dtype=float), -1.0, 1.0)
        scaled = commanded * self.senses.scale
        for k in missions:
            self._given[k][:] = scaled[k]
        shares = [missions[first :: self._threads] for first in range(self._threads)]
        several: dict[int, Array] = {}
        with stopping.deferred(), stopping.deaf(), native_loop(self._worlds[0]):
            pool = self._pool
            others = [pool.submit(self._fly, each, several) for each in shares[1:]] if pool else []
            try:
                self._fly(shares[0], several)
            finally:
                for other in others:
                    other.result()
        clearance = self.senses.clearance(self._newest)
        for k, rows in several.items():
            clearance[k] = self.senses.clearance(rows).min(axis=0)
        self.touching = clearance <= 0.0
        self._judge(missions, several)
        return self.senses.rewards(self._newest, clearance, commanded)

    def observe(self) -> Seen:
        """Return what each robot of each mission knows, as learners take it, shape (N, n, width)."""
        with np.errstate(invalid="ignore"):
            return self.senses.bounded(self.senses.observe(self._newest, self._points), self.limits)

    def close(self) -> None:
        """End the threads."""
        if self._pool is not None:
            self._pool.shutdown()

    def _fly(self, missions: Sequence[int], several: dict[int, Array]) -> None:
        """Take the samples that are due in missions; where it is more than one, put them into `several`."""
        with stopping.deaf():
            for k in missions:
                plant = self._plants[k]
                count = due(plant.world.schedule, self._taken[k])
                if count == 1:
                    self._newest[k] = plant.samples(1)[0]
                    if plant.has_ended:
                        plant.ended()
                else:
                    several[k] = np.empty((count, self._newest.shape[1]))
                    plant.fill(several[k])
                    self._newest[k] = several[k][-1]
                self._taken[k] += count
                if self._points is not None:
                    self._points[k] = obstacle_points(plant)

    def _judge(self, missions: Sequence[int], several: dict[int, Array]) -> None:
        """Find out how missions stand: `examine` is asked wherever something may be wrong."""
        fine = self._unsuspicious()
        for k in missions:
            plant = self._plants[k]
            if k in several or not fine[k] or plant.failure or plant.data.warning.number.any():
                rows = several.get(k, self._newest[k : k + 1])
                _, found, _ = examine(rows, plant, float(self._bounds[k]))
                if found is not Outcome.COMPLETED:
                    self.outcome[k] = found
                    continue
            if self._taken[k] == plant.world.schedule.count:
                self.outcome[k] = Outcome.COMPLETED

    def _unsuspicious(self) -> NDArray[np.bool_]:
        """Return in which missions all is a number and every robot is near the target, shape (N,)."""
        rows, sizes = self._newest, self._sizes
        places = rows[:, columns("q", sizes)].reshape(self.senses.count, -1, self.senses.axes)
        away = places - rows[:, None, columns("target_position", sizes)]
        near = (away**2).sum(axis=2).max(axis=1) < (0.999 * self._bounds) ** 2
        return near & np.isfinite(rows[:, self._law]).all(axis=1) & ~np.isnan(rows).any(axis=1)
