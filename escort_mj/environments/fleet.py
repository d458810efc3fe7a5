"""Missions of one scenario side by side, each stepped natively, in threads; no trace of them is kept.

A thread needs no Python while MuJoCo and the law take a mission's steps, and little between two missions: it
takes the next one that no thread has, so that none waits for a slower core. Machine code finds observations
and rewards while the mission is still in the core's cache (`senses.py`), and says whether anything is
suspicious: only then does Python look at a mission. Each has the bits that it has alone, on any number of
threads.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from escort_mj import stopping
from escort_mj.api import load_scenario
from escort_mj.control.custom.native import any_failure
from escort_mj.environments.rivals import RivalReward, Rivals
from escort_mj.environments.senses import Command, Reward, Seen, Senses
from escort_mj.environments.simulation import OneSide, next_hop
from escort_mj.mission import bound_of, examine
from escort_mj.record.outcome import Outcome
from escort_mj.scenario import Scenario
from escort_mj.scenario.arguments import Source
from escort_mj.scenario.mission import Mission
from escort_mj.study.engine.parallel import cores
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import World, build
from escort_mj.world.plant import Plant

Array = NDArray[np.float64]


HOPS = 2**14  # ways to a next sample that are remembered


class Fleet:
    """N missions of a scenario that differ by seed and are commanded from outside; see `Simulation`.

    Attributes:
        scenario: What all of them fly.
        senses: What robots observe and what is asked of them.
        rivals: The opponents of each mission; empty where robots are commanded.
        members: How many robots or opponents are commanded in each mission.
        limits: The largest size of each number that one of them observes, shape (width,).
        outcome: How each mission stands.
        words: The same in words, shape (N,).
        completed: Which missions have come to their end, shape (N,).
        decided: Which have no opponent left that is commanded, shape (N,).
        broken: Which missions have ended otherwise, shape (N,).
        touching: Which robots have touched anything since the last command, shape (N, n).
    """

    def __init__(
        self,
        scenario: Scenario | Source,
        count: int,
        command: Command = "velocity",
        reward: Reward | None = None,
        threads: int | None = None,
        side: OneSide = "robots",
        rival_reward: RivalReward | None = None,
    ) -> None:
        """Prepare missions; `begin` starts them.

        Args:
            scenario: A checked scenario, or what `load_scenario` takes.
            count: N.
            command: What is commanded.
            reward: Weights of what is asked; None for those of `Reward`.
            threads: How many step missions; None for one per core.
            side: Who is commanded.
            rival_reward: Weights of what is asked of opponents; None for those of `RivalReward`.

        Raises:
            UsageError: If forces are to be commanded and there is no limit to scale them by, or opponents and
                there are none.
        """
        self._command, self._opposed = command, side == "opponents"
        self._rival_reward, weights = rival_reward or RivalReward(), reward or Reward()
        threads = cores() if threads is None else int(threads)
        self.scenario = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
        world = self._build(self.scenario)
        plant = Plant(world)  # each mission gets its own when it begins
        self._worlds: list[World] = [world] * count
        self._plants: list[Plant] = [plant] * count
        self.senses = Senses(plant, count, command, weights)
        self._bounds = [bound_of(self.scenario, world)] * count
        self.rivals = [Rivals(plant, self._rival_reward) for _ in range(count * self._opposed)]
        self.members = self.rivals[0].count if self._opposed else self.senses.robots
        self.limits: Seen = self.rivals[0].limits if self._opposed else self.senses.limits(self._bounds[0])
        self.outcome = [Outcome.RUNNING] * count
        self.words = np.full(count, Outcome.RUNNING.value, dtype=object)
        self.completed = np.zeros(count, dtype=bool)
        self.broken = np.zeros(count, dtype=bool)
        self.decided = np.zeros(count, dtype=bool)
        self.touching = np.zeros((count, self.senses.robots), dtype=bool)
        self._taken = [0] * count
        self._total = world.schedule.count
        self._next = lru_cache(HOPS)(partial(next_hop, world.schedule))
        # Views of each mission's memory: what is commanded, episodes that have ended, MuJoCo's warnings.
        self._given: list[Array] = [np.zeros((0,))] * count
        self._ended = [plant.state.ended] * count
        self._warnings = [plant.data.warning.number] * count
        self._threads = min(threads, count)
        self._pool = ThreadPoolExecutor(self._threads - 1, "missions") if self._threads > 1 else None

    def begin(self, mission: int, seed: int) -> None:
        """Put a mission at its start; `advance` takes its first sample.

        Args:
            mission: Which one, from 0.
            seed: Of starts, noise and all else that is drawn.
        """
        scenario = self.scenario.replace(seed=seed)
        world = self._build(scenario)
        plant = Plant(world)
        self._bounds[mission] = bound_of(scenario, world)
        self.senses.enter(mission, plant, self._bounds[mission])
        self._worlds[mission], self._plants[mission] = world, plant
        self._given[mission] = plant.state.v_d if self._command == "velocity" else plant.state.tau
        if self._opposed:
            self.rivals[mission] = Rivals(plant, self._rival_reward)
        self._ended[mission], self._warnings[mission] = plant.state.ended, plant.data.warning.number
        self._taken[mission] = 0
        self._stands(mission, Outcome.RUNNING)

    def advance(self, missions: Sequence[int], commands: Array | Seen) -> Array:
        """Hold commands until the next ones are due; missions that have just begun take their first sample.

        Args:
            missions: Which ones, from 0; none has ended.
            commands: Of all N, shape (N, members, p): shares of the largest velocity or force, cut off at 1,
                or of the speed of opponents.

        Returns:
            Reward of each robot or opponent, shape (N, members); of other missions it means nothing.
        """
        senses = self.senses
        if self._opposed:
            for k in missions:
                self.rivals[k].command(commands[k])
        else:
            np.clip(commands, -1.0, 1.0, out=senses.commanded, dtype=float)
            scaled = senses.commanded * senses.scale
            for k in missions:
                self._given[k][...] = scaled[k]
        several: dict[int, Array] = {}
        with stopping.deferred(), stopping.deaf(), native_loop(self._worlds[0]):
            waiting, pool = iter(missions), self._pool
            others = (
                [pool.submit(self._fly, waiting, several) for _ in range(self._threads - 1)] if pool else []
            )
            try:
                self._fly(waiting, several)
            finally:
                for other in others:
                    other.result()
        self.touching = senses.clearance <= 0.0
        self._judge(missions, several)
        if not self._opposed:
            return senses.rewards
        self.decided = np.array([each.over.all() for each in self.rivals])
        return np.array([each.rewards for each in self.rivals])

    def observe(self) -> Seen:
        """Return what each robot or opponent of each mission knows, shape (N, members, width)."""
        if self._opposed:
            return np.array([each.observed for each in self.rivals])
        return self.senses.bounded(self.limits)

    def close(self) -> None:
        """End the threads."""
        if self._pool is not None:
            self._pool.shutdown()

    def _build(self, scenario: Scenario) -> World:
        if self._opposed:
            return build(Mission(scenario, opponents_outside=True))
        return build(Mission(scenario, outside=self._command))

    def _fly(self, missions: Iterator[int], several: dict[int, Array]) -> None:
        """Take the samples that are due in missions; where it is more than one, put them into `several`."""
        for k in missions:
            plant, (count, steps) = self._plants[k], self._next(self._taken[k])
            if count == 1:
                plant.step(steps)
            else:
                several[k] = np.empty((count, plant.world.record_size))
                plant.fill(several[k])
            self._taken[k] += count
            self.senses.perceive(k, several.get(k))
            if self._opposed:
                self.rivals[k].perceive()

    def _judge(self, missions: Sequence[int], several: dict[int, Array]) -> None:
        """Find out how missions stand, of all at once; `examine` is asked where something may be wrong."""
        if np.concatenate(self._ended).any():
            for plant in self._plants:
                plant.ended()  # makes room in the log
        warned = np.concatenate(self._warnings).any()
        if several or warned or not self.senses.sound.all() or any_failure():
            for k in missions:
                rows = several[k] if k in several else self._plants[k].record[None]
                _, found, _ = examine(rows, self._plants[k], self._bounds[k])
                if found is not Outcome.COMPLETED:
                    self._stands(k, found)
        if max(self._taken) == self._total:
            for k in missions:
                if self._taken[k] == self._total and not self.broken[k]:
                    self._stands(k, Outcome.COMPLETED)

    def _stands(self, mission: int, outcome: Outcome) -> None:
        self.outcome[mission], self.words[mission] = outcome, outcome.value
        self.completed[mission] = outcome is Outcome.COMPLETED
        self.broken[mission] = outcome not in (Outcome.RUNNING, Outcome.COMPLETED)
