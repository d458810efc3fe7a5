"""A mission under way in MuJoCo, whoever steps it: pushed and commanded from outside, and taken back."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from escort_mj.components.setup import COMMANDED, Outside
from escort_mj.errors import UsageError
from escort_mj.mission import Flight, bound_of, conclude
from escort_mj.record.outcome import Outcome
from escort_mj.scenario.arguments import Bound, argument_error, checked, number, numbers, whole_number
from escort_mj.scenario.mission import Mission
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.snapshots import Snapshot, Uncopied, mission_mark
from escort_mj.world.model.build import World, build
from escort_mj.world.plant import Plant
from escort_mj.world.stages import IN_SPACE

Array = NDArray[np.float64]

LONGEST = 1e9  # time that one call may ask for [s]


class Push(NamedTuple):
    """A force on a robot for some time.

    Attributes:
        robot: Its number, from 0.
        force: World frame, shape (3,) [N].
        until: Physics step from which on it no longer acts.
    """

    robot: int
    force: Array
    until: float


class Session(Uncopied):
    """A mission under way: `stepped` advances it with the law on, and fleets as they are commanded.

    Attributes:
        scenario: What is simulated, with all changes so far.
        commanded: What is commanded from outside instead of computed; None for nothing.
        world: What is simulated now.
        plant: Steps it.
        bound: Distance to the target beyond which the mission has diverged [m].
        outcome: `running` until the mission has reached its duration or failed.
        message: How the mission ended, in words; empty while it runs.
        notes: All interventions, each with its time.
        wall: Time that it took so far [s].
        pressed: Whether pushes act, or have acted until now; if not, there is one stretch to any step.
    """

    def __init__(
        self,
        scenario: Scenario,
        commanded: Outside | None = None,
        opponents_commanded: bool = False,
        mark: NDArray[np.uint32] | None = None,
        judged: bool = True,
    ) -> None:
        """Build the world; no step is taken yet.

        Args:
            scenario: A checked scenario.
            commanded: What is commanded from outside instead of computed; None for nothing.
            opponents_commanded: Whether what opponents want is, too.
            mark: Tells missions whose snapshots suit it; None for the mark of the scenario.
            judged: Whether expectations are judged.
        """
        self.scenario, self.commanded = scenario, commanded
        self._opponents, self._judged = opponents_commanded, judged
        self.outcome, self.message = Outcome.RUNNING, ""
        self.notes: list[str] = []
        self._settle(self._build(scenario))
        self._mark = mission_mark(scenario, commanded) if mark is None else mark
        self._samples: list[Array] = []
        self._episodes: list[Array] = []
        self._pushes: list[Push] = []
        self._pushed: list[tuple[float, float, float, float]] = []
        self.wall, self.pressed = 0.0, False

    def _build(self, scenario: Scenario) -> World:
        if self.commanded is None and not self._opponents and self._judged:
            return build(scenario)
        outside, opponents = self.commanded, self._opponents
        return build(Mission(scenario, outside=outside, opponents_outside=opponents, judged=self._judged))

    def _plant(self, world: World) -> Plant:
        return Plant(world)

    def _settle(self, world: World) -> None:
        """Go on in another world, at its start."""
        self.world, self.plant = world, self._plant(world)
        self.bound = bound_of(world.scenario, world)

    @property
    def time(self) -> float:
        """Time of the last evaluation of the law [s]."""
        return float(self.plant.state.time[0])

    @property
    def samples(self) -> Array:
        """All samples so far, shape (k, record_size), see `signals.py`."""
        self.plant.fold_steps()
        if len(self._samples) > 1:
            self._samples = [np.concatenate(self._samples)]
        return self._samples[0] if self._samples else np.zeros((0, self.world.record_size))

    @property
    def episodes(self) -> Array:
        """All contact episodes so far, those that go on included, shape (k, len(EPISODE))."""
        return np.vstack([*self._episodes, self.plant.under_way()])

    def command(self, values: ArrayLike) -> None:
        """Command robots from outside, until the next command.

        Args:
            values: Reference velocities, which the scenario's law follows, velocities that are added to those
                of the behaviors [m/s], or forces of motors [N], shape (n, p).

        Raises:
            UsageError: If the mission is not commanded, or the values have another shape or are not finite.
        """
        if self.commanded is None:
            raise UsageError('command: found a mission that its behaviors lead; expected command="velocity"')
        name, unit = COMMANDED[self.commanded]
        given = getattr(self.plant.state, name)
        given[:] = numbers(values, "command", given.shape, f"one row per robot [{unit}]")

    def push(self, robot: int, force: ArrayLike, seconds: float | None = None) -> None:
        """Push a robot from outside, beside everything else that acts on it; pushes add up until they end.

        Args:
            robot: Its number, from 1 as in all results.
            force: World frame, shape (p,) [N].
            seconds: How long [s]; None until `release`.

        Raises:
            UsageError: If there is no such robot, the force has another shape, or the mission more than three
                axes.
        """
        p = self.plant.state.q.shape[1]
        if p > IN_SPACE:
            raise UsageError(f"push: found a mission of {p} axes; allowed are at most {IN_SPACE}")
        robot = self._numbered(robot)
        values = numbers(force, "force", (p,), f"{p} components [N]")
        steps = math.inf if seconds is None else self._steps_in(seconds)
        whole = np.append(values, np.zeros(IN_SPACE - p))
        self.pressed = True
        self._pushes.append(Push(robot - 1, whole, self.plant.steps + steps))
        until = self.time + steps * self.scenario.physics.timestep
        self._pushed.append((robot - 1.0, self.time, until, float(np.abs(values).max())))
        lasting = "" if seconds is None else f" for {seconds:g} s"
        self._note(f"robot {robot} is pushed by {values.tolist()} N{lasting}")

    def release(self, robot: int | None = None) -> None:
        """End pushes.

        Args:
            robot: Of which robot, from 1; None for all.

        Raises:
            UsageError: If there is no such robot.
        """
        robot = None if robot is None else self._numbered(robot)
        self._pushed = [
            (of, start, min(until, self.time) if robot in (None, of + 1) else until, force)
            for of, start, until, force in self._pushed
        ]
        self._pushes = [] if robot is None else [push for push in self._pushes if push.robot != robot - 1]
        self._note("all pushes end" if robot is None else f"pushes of robot {robot} end")

    def stretches(self, end: int) -> Iterator[int]:
        """Yield up to which physics step to simulate while what acts from outside stays the same.

        Args:
            end: How many physics steps are wanted in all.
        """
        while self.plant.steps < end:
            self._pushes = [push for push in self._pushes if push.until > self.plant.steps]
            applied = self.plant.data.xfrc_applied
            applied[:], self.pressed = 0.0, bool(self._pushes)
            for push in self._pushes:
                applied[self.world.model.body(f"robot_{push.robot + 1}").id, :IN_SPACE] += push.force
            yield int(min([end, *(push.until for push in self._pushes)]))

    def keep(self, samples: Array, episodes: Array) -> None:
        """Add samples, shape (k, record_size), and the contact episodes that ended among them."""
        self._samples.append(samples)
        self._episodes.append(episodes)

    def snapshot(self) -> Snapshot:
        """Return this moment; `restore` comes back to it, as often as wanted."""
        self.plant.fold_steps()
        return Snapshot(
            mission=self._mark,
            scenario=self.scenario,
            world=self.world,
            plant=self.plant.mark(),
            samples=tuple(self._samples),
            episodes=tuple(self._episodes),
            pushes=tuple(self._pushes),
            pushed=tuple(self._pushed),
            notes=tuple(self.notes),
            outcome=self.outcome,
            message=self.message,
        )

    @checked
    def restore(self, snapshot: Snapshot) -> None:
        """Come back to a moment of this mission; what happened since is forgotten.

        Args:
            snapshot: Of this mission, also as another object runs it. What follows has the same bits as what
                followed then.

        Raises:
            UsageError: If it is of another mission.
        """
        snapshot.check(self._mark)
        if snapshot["world"] is not self.world:
            self._settle(snapshot["world"])
        self.plant.back_to(snapshot["plant"])
        self.scenario = snapshot["scenario"]
        self.outcome, self.message = snapshot["outcome"], snapshot["message"]
        self._samples, self._episodes = list(snapshot["samples"]), list(snapshot["episodes"])
        self._pushes, self._pushed = list(snapshot["pushes"]), list(snapshot["pushed"])
        self.notes, self.pressed = list(snapshot["notes"]), True

    def flight(self) -> Flight:
        """Return what came of the mission so far; one that has not ended is interrupted, and can go on."""
        outcome, message = self.outcome, self.message
        if outcome is Outcome.RUNNING:
            outcome, message = Outcome.INTERRUPTED, f"judged before its end, at {self.time:.2f} s"
        told = self.samples, self.episodes, outcome, message, self.wall
        flight = conclude(self.scenario, self.plant, *told)
        if self.notes and flight.recording is not None:
            flight.recording.attrs["interventions"] = "\n".join(self.notes)
        if self._pushed and flight.recording is not None:
            flight.recording.attrs["pushes"] = np.ravel(self._pushed).tolist()
        return flight

    def _steps_in(self, seconds: float) -> int:
        """Return how many physics steps a time lasts, at least one."""
        words = f"a time above 0 and of at most {LONGEST:g} [s]"
        found = number(seconds, "seconds", words, Bound(0.0, above=True))
        if found > LONGEST:
            raise argument_error("seconds", seconds, words)
        return max(round(found / self.scenario.physics.timestep), 1)

    def _numbered(self, robot: int) -> int:
        n = len(self.plant.state.q)
        return whole_number(robot, "robot", f"a number from 1 to {n}", 1, n)

    def _note(self, words: str) -> None:
        self.notes.append(f"{self.time:g} s: {words}")

    def __repr__(self) -> str:
        state = f"{self.time:g} s of {self.scenario.duration:g} s"
        return f"<{type(self).__name__} {self.scenario.name}: {state}, {self.outcome.value}>"
