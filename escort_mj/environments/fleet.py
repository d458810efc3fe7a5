"""Missions of one scenario side by side, each stepped natively, in threads.

A thread needs no Python while MuJoCo and the law take a mission's steps, and little between two missions: it
takes the next one that no thread has, so that none waits for a slower core. Machine code finds observations
and rewards while the mission is still in the core's cache (`senses.py`), and says whether anything is
suspicious: only then does Python look at a mission. Each has the bits that it has alone, on any number of
threads.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache, partial
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj import stopping
from escort_mj.api import load_scenario
from escort_mj.components.setup import COMMANDED
from escort_mj.control.custom.native import any_failure
from escort_mj.environments.draws import Sample, Values, check_fits, mission_of
from escort_mj.environments.own import Part, described
from escort_mj.environments.rivals import RivalReward, Rivals
from escort_mj.environments.senses import Command, Reward, Seen, Senses
from escort_mj.errors import UsageError
from escort_mj.memory.perception import WEIGHTS
from escort_mj.mission import Flight, completed, distances_of, examine, take_back
from escort_mj.mission.session import Session
from escort_mj.native.on_demand import waited
from escort_mj.record.outcome import Outcome
from escort_mj.scenario import Scenario
from escort_mj.scenario.arguments import Source
from escort_mj.scenario.geometry.steps import Schedule
from escort_mj.snapshots import WORDS, Snapshot, mission_mark
from escort_mj.study.engine.parallel import cores
from escort_mj.world.callback import native_loop
from escort_mj.world.plant import Mark

Array = NDArray[np.float64]
OneSide = Literal["robots", "opponents"]
Side = Literal[OneSide, "both"]

HOPS = 2**14  # ways to a next sample that are remembered


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


class Taken(NamedTuple):
    """Samples of a mission since the last command, shape (k, record_size), and episodes that ended meanwhile.

    Attributes:
        marks: Moments between which what acts from outside stays the same, with the sample that comes next.
    """

    rows: Array
    episodes: Array
    marks: list[tuple[int, Mark]]


class Fleet:
    """N missions of a scenario that differ by seed and are commanded from outside; see `Simulation`.

    Attributes:
        scenario: What all of them fly.
        missions: Each of them, to push robots and to look at.
        senses: What robots observe and what is asked of them.
        rivals: The opponents of each mission; empty where they are not commanded.
        members: How many robots or opponents are commanded in each mission.
        limits: The largest size of each number that one of them observes, shape (width,).
        words: How each mission stands, in words, shape (N,).
        completed: Which missions have come to their end, shape (N,).
        values: What is drawn and set in each mission, by scenario key.
        decided: Which have no opponent left that is commanded, shape (N,).
        broken: Which missions have ended otherwise, shape (N,).
        begun: Which have been put at a start, shape (N,).
        touching: Which robots have touched anything since the last command, shape (N, n).
    """

    def __init__(
        self,
        scenario: Scenario | Source,
        count: int,
        command: Command = "velocity",
        reward: Reward | None = None,
        threads: int | None = None,
        side: Side = "robots",
        rival_reward: RivalReward | None = None,
        sample: Mapping[str, Any] | None = None,
        own: Sequence[Part] = (),
        *,
        keep: bool = False,
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
            sample: Scenario keys, and the range or the values from which each mission's are drawn, as
                `sample.over` of a study; None to draw nothing.
            own: Observations and rewards of one's own.
            keep: Whether missions keep their samples, for `flight`; else nothing judges their expectations.

        Raises:
            UsageError: If forces are to be commanded and there is no limit to scale them by, or opponents and
                there are none, or `sample` is no such table, or `own` has something else.
            ScenarioError: If what `sample` has is impossible.
        """
        self._side, self._command, self._keep = side, command, keep
        self._rival_reward, weights = rival_reward or RivalReward(), reward or Reward()
        threads = cores() if threads is None else int(threads)
        if own and side == "opponents":
            raise UsageError("own: found parts for robots; opponents alone are commanded (side)")
        self.scenario = load_scenario(scenario)
        self._sample = Sample(self.scenario, sample)
        parts = described(own, WEIGHTS)
        self._mark = mission_mark(self.scenario, command, side, keep, *parts, left_out=WORDS | {"seed"})
        first = self._session(self.scenario)  # each mission gets its own when it begins
        self._first, self.missions = first.world, [first] * count
        self.values: list[Values] = [{} for _ in range(count)]
        self.senses = Senses(first.plant, count, command, weights, own)
        opposed = count * (side != "robots")
        self.rivals = [Rivals(first.plant, self._rival_reward) for _ in range(opposed)]
        alone = side == "opponents"
        self.members = self.rivals[0].count if alone else self.senses.robots
        self.limits: Seen = self.rivals[0].limits if alone else self.senses.limits(first.bound)
        self.words = np.full(count, Outcome.RUNNING.value, dtype=object)
        self.completed = np.zeros(count, dtype=bool)
        self.broken = np.zeros(count, dtype=bool)
        self.decided = np.zeros(count, dtype=bool)
        self.begun = np.zeros(count, dtype=bool)
        self.touching = np.zeros((count, self.senses.robots), dtype=bool)
        self._hops: list[list[int]] = [[] for _ in range(count)]  # samples kept after each command
        self._unkept: list[tuple[Mark, int] | None] = [None] * count
        self._taken = [0] * count
        self._total = first.world.schedule.count
        self._next = lru_cache(HOPS)(partial(next_hop, first.world.schedule))
        # Views of each mission's memory: what is commanded, episodes that have ended, MuJoCo's warnings.
        self._given: list[Array] = [np.zeros((0,))] * count
        self._ended = [first.plant.state.ended] * count
        self._warnings = [first.plant.data.warning.number] * count
        self._threads = min(threads, count)
        self._pool = ThreadPoolExecutor(self._threads - 1, "missions") if self._threads > 1 else None

    def begin(self, mission: int, seed: int, given: Values | None = None) -> None:
        """Put a mission at its start; `advance` takes its first sample.

        Args:
            mission: Which one, from 0.
            seed: Of starts, noise and all else that is drawn.
            given: Scenario keys and values, also in place of what is drawn.

        Raises:
            UsageError: If values make a mission of another shape; the mission does not change.
            ScenarioError: If values are impossible.
        """
        values = self._sample.values(seed) | (given or {})
        session = self._session(mission_of(self.scenario, seed, values))
        if values:
            check_fits(session.world, self._first, values)
        self.missions[mission], self.values[mission] = session, values
        self._hops[mission], self._unkept[mission] = [], None
        self._enter(mission)

    def advance(
        self, missions: Sequence[int], commands: Array | Seen, of_rivals: Array | None = None
    ) -> Array:
        """Hold commands until the next ones are due; missions that have just begun take their first sample.

        Args:
            missions: Which ones, from 0; none has ended.
            commands: Of all N, shape (N, members, p): shares of the largest velocity or force, cut off at 1,
                or of the speed of opponents.
            of_rivals: Those of opponents, shape (N, o, p), where both sides are commanded.

        Returns:
            Reward of each robot or, where they alone are commanded, opponent, shape (N, members); of other
            missions it means nothing.
        """
        senses, began = self.senses, time.perf_counter() - waited()
        if self.rivals and (self._side == "opponents" or of_rivals is not None):
            wanted = commands if of_rivals is None else of_rivals
            for k in missions:
                self.rivals[k].command(wanted[k])
        if self._side != "opponents":
            np.clip(commands, -1.0, 1.0, out=senses.commanded, dtype=float)
            scaled = senses.commanded * senses.scale
            for k in missions:
                self._given[k][...] = scaled[k]
        several: dict[int, Taken] = {}
        with stopping.deferred(), stopping.deaf(), native_loop(self.missions[0].world):
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
            if self.rivals:
                self.decided = np.array([each.over.all() for each in self.rivals])
            for k in missions if self._keep else ():
                self.missions[k].wall += time.perf_counter() - waited() - began
        if senses.own:  # when all else is done: it may raise anything, and be interrupted
            samples = np.stack([self.missions[k].plant.record for k in missions])
            senses.add_own(missions, samples, self.broken[list(missions)])
        if self._side == "opponents":
            return np.array([each.rewards for each in self.rivals])
        return senses.rewards

    def observe(self) -> Seen:
        """Return what each robot or opponent of each mission knows, shape (N, members, width)."""
        if self._side == "opponents":
            return np.array([each.observed for each in self.rivals])
        return self.senses.bounded(self.limits)

    def snapshot(self, mission: int) -> Snapshot:
        """Return this moment of a mission; `restore` puts any mission of such a fleet there.

        Args:
            mission: Which one, from 0.

        Raises:
            UsageError: If it has not begun.
        """
        if not self.begun[mission]:
            raise UsageError("the mission is not under way: call reset")
        found = self.missions[mission].snapshot()
        found["hops"], found["unkept"] = tuple(self._hops[mission]), self._unkept[mission]
        found["senses"], found["values"] = self.senses.kept(mission), dict(self.values[mission])
        found["rivals"] = self.rivals[mission].kept() if self.rivals else ()
        return found

    def restore(self, mission: int, snapshot: Snapshot) -> None:
        """Put a mission at a moment; what follows has the same bits as what followed then.

        Args:
            mission: Which one, from 0; it need not have begun.
            snapshot: Of any mission of such a fleet: same scenario and kind of commands, whatever the seed.

        Raises:
            UsageError: If it is of another scenario.
        """
        snapshot.check(self._mark)
        if not self.begun[mission]:
            self.missions[mission] = self._session(self.scenario)
        self.missions[mission].restore(snapshot)
        self._enter(mission)
        self._hops[mission], self._unkept[mission] = list(snapshot["hops"]), snapshot["unkept"]
        self.senses.put(mission, snapshot["senses"])
        self.values[mission] = dict(snapshot["values"])
        self.touching[mission] = self.senses.clearance[mission] <= 0.0
        if self.rivals:
            self.rivals[mission].put(snapshot["rivals"])
            self.decided[mission] = self.rivals[mission].over.all()

    def commands(self, mission: int) -> int:
        """Return how many commands a mission has been given, the one of the first sample included."""
        return len(self._hops[mission])

    def samples(self, mission: int, since: int) -> Array:
        """Return the samples of a mission that commands led to, without those of so many commands."""
        return self.missions[mission].samples[self._hops[mission][since - 1] if since else 0 :]

    def flight(self, mission: int) -> Flight:
        """Return what came of a mission so far, in a fleet that keeps samples."""
        session, unkept = self.missions[mission], self._unkept[mission]
        if unkept is not None:
            with native_loop(session.world):
                session.keep(np.zeros((0, session.world.record_size)), take_back(session.plant, *unkept))
            self._unkept[mission] = None
        return session.flight()

    def close(self) -> None:
        """End the threads; what is asked for afterwards is done by the thread that asks."""
        if self._pool is not None:
            self._pool.shutdown()
            self._pool = None

    def _session(self, scenario: Scenario) -> Session:
        commanded = None if self._side == "opponents" else self._command
        return Session(scenario, commanded, self._side != "robots", self._mark, judged=self._keep)

    def _enter(self, mission: int) -> None:
        """Take up a mission where it is."""
        session = self.missions[mission]
        plant = session.plant
        self.senses.enter(mission, plant, session.bound)
        self._taken[mission] = session.world.schedule.before(plant.steps)
        self._given[mission] = getattr(plant.state, COMMANDED[self._command][0])
        if self.rivals:
            self.rivals[mission] = Rivals(plant, self._rival_reward)
        self._ended[mission], self._warnings[mission] = plant.state.ended, plant.data.warning.number
        self.begun[mission], self.decided[mission] = True, False
        self._stands(mission, session.outcome, session.message)

    def _fly(self, missions: Iterator[int], several: dict[int, Taken]) -> None:
        """Take the samples that are due in missions; put them into `several` where they are kept or many."""
        for k in missions:
            session, first = self.missions[k], self._taken[k]
            plant, (count, steps) = session.plant, self._next(first)
            self._taken[k] += count
            if count == 1 and not (self._keep or session.pressed):
                plant.step(steps)
                self.senses.perceive(k)
            else:
                schedule, end = session.world.schedule, plant.steps + steps
                rows, episodes, marks = np.empty((count, session.world.record_size)), [], []
                for until in session.stretches(end):
                    row, last = (schedule.before(step) - first for step in (plant.steps, until))
                    marks.append((row, plant.mark()))
                    episodes.append(plant.fill(rows[row:last])[1])
                    plant.step(until - plant.steps)
                several[k] = Taken(rows, episodes[0] if len(episodes) == 1 else np.vstack(episodes), marks)
                self.senses.perceive(k, rows if count > 1 else None)
            if self.rivals:
                self.rivals[k].perceive()

    def _judge(self, missions: Sequence[int], several: dict[int, Taken]) -> None:
        """Find out how missions stand, of all at once; `examine` is asked where something may be wrong."""
        if not self._keep and np.concatenate(self._ended).any():
            for each in self.missions:
                each.plant.ended()  # makes room in the log
        suspicious = several or np.concatenate(self._warnings).any() or not self.senses.sound.all()
        if suspicious or any_failure():
            for k in missions:
                session = self.missions[k]
                rows = several[k].rows if k in several else session.plant.record[None]
                distances = distances_of(rows, session.world.sizes)
                kept, found, message = examine(rows, distances, session.plant, session.bound)
                if found is not Outcome.COMPLETED:
                    self._stands(k, found, message)
                if self._keep:
                    self._take(k, several[k], kept)
        if max(self._taken) == self._total:
            for k in missions:
                if self._taken[k] == self._total and not self.broken[k]:
                    self._stands(k, Outcome.COMPLETED, completed(self.missions[k].plant.record[None]))

    def _take(self, mission: int, taken: Taken, kept: int) -> None:
        """Keep samples; those that are not worth it are taken back later: what broke is still observed."""
        session, hops = self.missions[mission], self._hops[mission]
        hops.append((hops[-1] if hops else 0) + kept)
        whole = kept == len(taken.rows)
        session.keep(taken.rows[:kept], taken.episodes[: None if whole else 0])
        if not whole:
            row, mark = [(row, mark) for row, mark in taken.marks if row <= kept][-1]
            self._unkept[mission] = mark, kept - row

    def _stands(self, mission: int, outcome: Outcome, message: str) -> None:
        self.missions[mission].outcome, self.missions[mission].message = outcome, message
        self.words[mission] = outcome.value
        self.completed[mission] = outcome is Outcome.COMPLETED
        self.broken[mission] = outcome not in (Outcome.RUNNING, Outcome.COMPLETED)
