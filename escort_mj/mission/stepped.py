"""A mission under way, stepped from Python with the law on: look at it, disturb it, change it, go back."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from escort_mj import stopping
from escort_mj.errors import UsageError
from escort_mj.mission import BLOCK, LARGEST, Flight, bound_of, completed, conclude, take
from escort_mj.record.outcome import Outcome
from escort_mj.scenario import Scenario
from escort_mj.scenario.arguments import Bound, argument_error, checked, number, numbers, whole_number
from escort_mj.scenario.findings import did_you_mean
from escort_mj.scenario.reader.overrides import Overrides
from escort_mj.signals import SIGNALS
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import World, build
from escort_mj.world.plant import Mark, Plant
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


class Snapshot(NamedTuple):
    """A moment of a mission, for `SteppedMission.restore`."""

    scenario: Scenario
    world: World
    plant: Plant
    mark: Mark
    samples: tuple[Array, ...]
    episodes: tuple[Array, ...]
    pushes: tuple[Push, ...]
    pushed: tuple[tuple[float, float, float, float], ...]
    notes: tuple[str, ...]
    outcome: Outcome
    message: str
    mission: object


class SteppedMission:
    """A mission under way, without `run`: see `LiveMission`, which `escort_mj.start` returns."""

    def __init__(self, scenario: Scenario) -> None:
        """Build the world and evaluate the law at the start, time 0.

        Args:
            scenario: A checked scenario.
        """
        self.scenario = scenario
        self.outcome, self.message = Outcome.RUNNING, ""
        self.notes: list[str] = []
        self._world = build(scenario)
        self._plant = Plant(self._world)
        self._bound = bound_of(scenario, self._world)
        self._samples: list[Array] = []
        self._episodes: list[Array] = []
        self._pushes: list[Push] = []
        self._pushed: list[tuple[float, float, float, float]] = []
        self._watchers: list[Callable[[Any], object]] = []
        self._wall = 0.0
        self._identity = object()
        self._advance(1)

    @property
    def time(self) -> float:
        """Time of the last evaluation of the law, which `state` shows [s]."""
        return float(self._plant.state.time[0])

    @property
    def world(self) -> World:
        """What is simulated now."""
        return self._world

    @property
    def samples(self) -> Array:
        """All samples so far, shape (k, record_size), see `signals.py`."""
        if len(self._samples) > 1:
            self._samples = [np.concatenate(self._samples)]
        return self._samples[0]

    @property
    def episodes(self) -> Array:
        """All contact episodes so far, those that go on included, shape (k, len(EPISODE))."""
        return np.vstack([*self._episodes, self._plant.under_way()])

    @property
    def state(self) -> dict[str, Array]:
        """Every signal at `time`, a copy by name: shapes, units and meanings as in a trace.

        `state["q"]` are the true positions, shape (n, p) [m]; `state["tau"]` the forces that the law demands,
        shape (n, p) [N]. The page on signals lists all.
        """
        return {name: self[name] for name in self._names()}

    def __getitem__(self, name: str) -> Array:
        """Return one signal at `time`, a copy.

        Raises:
            UsageError: If there is no such signal.
        """
        if not isinstance(name, str):
            raise argument_error("signal", name, "the name of a signal")
        if name not in (names := self._names()):
            hint = did_you_mean(name, names) or f"; allowed are {', '.join(names)}"
            raise UsageError(f"{name}: is not a signal of this mission{hint}")
        values: Array = getattr(self._plant.state, name).copy()
        return values

    def step(self, seconds: float | None = None) -> Self:
        """Simulate some time, at most to the mission's duration.

        Args:
            seconds: How long, rounded to physics steps [s]; None for one physics step.

        Returns:
            The mission itself, so that calls can be chained.

        Raises:
            UsageError: If the mission has ended, or if the time is not positive.
            KeyboardInterrupt: On an interrupt; the mission can go on from there.
        """
        if self.outcome is not Outcome.RUNNING:
            raise UsageError(f"the mission has ended: {self.message}")
        self._advance(self._plant.steps + (1 if seconds is None else self._steps_in(seconds)))
        return self

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
        p = self._plant.state.q.shape[1]
        if p > IN_SPACE:
            raise UsageError(f"push: found a mission of {p} axes; allowed are at most {IN_SPACE}")
        robot = self._numbered(robot)
        values = numbers(force, "force", (p,), f"{p} components [N]")
        if np.abs(values).max() > LARGEST:
            raise argument_error("force", float(np.abs(values).max()), f"components of at most {LARGEST:g} N")
        steps = math.inf if seconds is None else self._steps_in(seconds)
        whole = np.append(values, np.zeros(IN_SPACE - p))
        self._pushes.append(Push(robot - 1, whole, self._plant.steps + steps))
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

    def move_target(self, position: ArrayLike, velocity: ArrayLike | None = None) -> None:
        """Give the target another path: from a position, straight on.

        A target with a mass is driven there; others are there at once.

        Args:
            position: Where it is now, shape (p,) [m].
            velocity: Its velocity from now on, shape (p,) [m/s]; None for rest.

        Raises:
            UsageError: If a shape is another, or if there is no target.
        """
        if self.scenario.target is None:
            raise UsageError("there is no target to move (target: null)")
        p = self.scenario.axes
        here = numbers(position, "position", (p,), f"{p} coordinates [m]")
        speed = (
            np.zeros(p) if velocity is None else numbers(velocity, "velocity", (p,), f"{p} components [m/s]")
        )
        now = self.time + self.scenario.physics.timestep  # when the next evaluation looks
        path = [f"{x!r} + {v!r}*(t - {now!r})" for x, v in zip(here.tolist(), speed.tolist(), strict=True)]
        self.change({"target.position": path, "target.waypoints": None})

    @checked
    def change(self, changes: Overrides = (), /, **more: Any) -> None:
        """Change keys of the scenario while the mission runs: gains, behaviors, the target, bodies.

        The simulation goes on from where it is: positions, velocities, contacts, and all state of the
        controller that the change leaves its shape. It takes as long as building the world again.

        Args:
            changes: Values by key path, or texts `key.path=value`, as for `Scenario.replace`.
            more: Further values by key path.

        Raises:
            ScenarioError: With all faults of the changed scenario.
            UsageError: If what is recorded or simulated would have another size, such as with more robots, or
                if the mission's samples would be others.
        """
        scenario = self.scenario.replace(changes, **more)
        world = build(scenario)
        self._check_sizes(scenario, world)
        plant = Plant(world)
        plant.carry_on(self._plant)
        words = ", ".join(map(str, [*changes, *more]))
        self.scenario, self._world, self._plant = scenario, world, plant
        self._bound = bound_of(scenario, world)
        self._note(f"change of {words}" if words else "no change")

    @checked
    def on_sample(self, watcher: Callable[[Self], object]) -> None:
        """Have a function called after each sample, `recording.rate` times a simulated second.

        Args:
            watcher: Called with the mission; it may intervene.
        """
        self._watchers.append(watcher)

    def snapshot(self) -> Snapshot:
        """Return this moment; `restore` comes back to it, as often as wanted."""
        return Snapshot(
            self.scenario, self._world, self._plant, self._plant.mark(), tuple(self._samples),
            tuple(self._episodes), tuple(self._pushes), tuple(self._pushed), tuple(self.notes), self.outcome,
            self.message, self._identity,
        )  # fmt: skip

    @checked
    def restore(self, snapshot: Snapshot) -> None:
        """Come back to a moment of this mission; what happened since is forgotten.

        Args:
            snapshot: Of this mission. What follows has the same bits as what followed then.

        Raises:
            UsageError: If it is of another mission.
        """
        if snapshot.mission is not self._identity:
            raise UsageError("snapshot: is that of another mission; expected one that this mission returned")
        self.scenario, self._world, self._plant = snapshot.scenario, snapshot.world, snapshot.plant
        self._plant.back_to(snapshot.mark)
        self._samples, self._episodes = list(snapshot.samples), list(snapshot.episodes)
        self._pushes, self._pushed = list(snapshot.pushes), list(snapshot.pushed)
        self.notes = list(snapshot.notes)
        self.outcome, self.message = snapshot.outcome, snapshot.message
        self._bound = bound_of(self.scenario, self._world)

    def flight(self) -> Flight:
        """Return what came of the mission so far; one that has not ended is interrupted, and can go on."""
        outcome, message = self.outcome, self.message
        if outcome is Outcome.RUNNING:
            outcome, message = Outcome.INTERRUPTED, f"ended from outside at {self.time:.2f} s"
        told = self.samples, self.episodes, outcome, message, self._wall
        flight = conclude(self.scenario, self._plant, *told)
        if self.notes and flight.recording is not None:
            flight.recording.attrs["interventions"] = "\n".join(self.notes)
        if self._pushed and flight.recording is not None:
            flight.recording.attrs["pushes"] = np.ravel(self._pushed).tolist()
        return flight

    def __repr__(self) -> str:
        state = f"{self.time:g} s of {self.scenario.duration:g} s"
        return f"<{type(self).__name__} {self.scenario.name}: {state}, {self.outcome.value}>"

    def _steps_in(self, seconds: float) -> int:
        """Return how many physics steps a time lasts, at least one."""
        words = f"a time above 0 and of at most {LONGEST:g} [s]"
        found = number(seconds, "seconds", words, Bound(0.0, above=True))
        if found > LONGEST:
            raise argument_error("seconds", seconds, words)
        return max(round(found / self.scenario.physics.timestep), 1)

    def _numbered(self, robot: int) -> int:
        n = len(self._plant.state.q)
        return whole_number(robot, "robot", f"a number from 1 to {n}", 1, n)

    def _names(self) -> list[str]:
        """Names of the signals that are recorded."""
        return ["time", *(one.name for one in SIGNALS[1:] if one.recorded(self._world.sizes))]

    def _advance(self, wanted: int) -> None:
        """Simulate until so many physics steps are done, or the mission ends."""
        began = time.perf_counter()
        end = min(wanted, self._world.schedule.last + 1)
        with native_loop(self._world):
            while self._plant.steps < end and self.outcome is Outcome.RUNNING:
                until = min([end, *(push.until for push in self._pushes)])
                self._press()
                self._advance_undisturbed(int(until))
                self._pushes = [push for push in self._pushes if push.until > self._plant.steps]
                if stopping.asked():
                    raise KeyboardInterrupt
        self._wall += time.perf_counter() - began

    def _advance_undisturbed(self, until: int) -> None:
        """Simulate until so many physics steps are done while what acts from outside stays the same."""
        schedule, plant = self._world.schedule, self._plant
        due = schedule.before(until) - schedule.before(plant.steps)
        if self._watchers:
            due = min(due, 1)
        if due:
            rows = np.empty((due, self._world.record_size))
            kept, ended, outcome, message = take(plant, rows, self._bound, look=due >= BLOCK)
            self._samples.append(rows[:kept])
            self._episodes.append(ended)
            if outcome is not Outcome.COMPLETED:
                self.outcome, self.message = outcome, message
                return
            if plant.steps > schedule.last:
                self.outcome, self.message = Outcome.COMPLETED, completed(rows)
            for watcher in self._watchers:
                watcher(self)
        elif plant.steps < until:
            plant.step(until - plant.steps)

    def _press(self) -> None:
        """Hand MuJoCo the pushes that act now."""
        model, applied = self._world.model, self._plant.data.xfrc_applied
        applied[:] = 0.0
        for push in self._pushes:
            applied[model.body(f"robot_{push.robot + 1}").id, :IN_SPACE] += push.force

    def _note(self, words: str) -> None:
        self.notes.append(f"{self.time:g} s: {words}")

    def _check_sizes(self, scenario: Scenario, world: World) -> None:
        """Refuse a change after which samples or bodies are others."""
        for name in self._world.sizes | world.sizes:
            size, new_size = self._world.sizes.get(name, 0), world.sizes.get(name, 0)
            if new_size != size:
                raise UsageError(f"change: the number of {name} entries becomes {new_size}; it is {size}")
        for name in ("nq", "nv", "na", "nu", "nmocap"):
            before, after = getattr(self._world.model, name), getattr(world.model, name)
            if before != after:
                raise UsageError(f"change: MuJoCo's {name} becomes {after}; it is {before}")
        old, new = self._world.schedule, world.schedule
        if (old.stride, scenario.physics.timestep) != (new.stride, self.scenario.physics.timestep):
            raise UsageError("change: the timestep and the rate of recording stay as they are")
        done = self._plant.steps
        if old.before(done) != new.before(done):
            raise UsageError("change: windows of expectations that have begun stay as they are")
