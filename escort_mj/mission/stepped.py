"""A mission under way, stepped from Python with the law on: look at it, disturb it, change it, go back."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from escort_mj import stopping
from escort_mj.components.setup import Outside
from escort_mj.errors import UsageError
from escort_mj.metrics.watching import NAMES as WATCHED
from escort_mj.mission import BLOCK, completed, take
from escort_mj.mission.session import Session
from escort_mj.record.outcome import Outcome
from escort_mj.scenario.arguments import Overrides, argument_error, checked, numbers
from escort_mj.scenario.findings import did_you_mean
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.signals import SIGNALS
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import World

Array = NDArray[np.float64]


class State(dict[str, Array]):
    """Values of signals by name; another name is an error with the nearest one."""

    def __missing__(self, name: object) -> Array:
        if not isinstance(name, str):
            raise argument_error("signal", name, "the name of a signal")
        hint = did_you_mean(name, self) or f"; allowed are {', '.join(self)}"
        raise UsageError(f"{name}: is not a signal of this mission{hint}")


class SteppedMission(Session):
    """A mission under way, without `run`: see `LiveMission`, which `escort_mj.start` returns."""

    @checked
    def __init__(self, scenario: Scenario, commanded: Outside | None = None) -> None:
        """Build the world and evaluate the law at the start, time 0.

        Args:
            scenario: A checked scenario.
            commanded: What is commanded from outside instead of computed; None for nothing.
        """
        super().__init__(scenario, commanded)
        self._watchers: list[Callable[[Any], object]] = []
        self._advance(1)

    @property
    def state(self) -> State:
        """Every signal at `time`, a copy by name: shapes, units and meanings as in a trace.

        `state["q"]` are the true positions, shape (n, p) [m]; `state["tau"]` the forces that the law demands,
        shape (n, p) [N]. The page on signals lists all.
        """
        return State((name, self[name]) for name in self._names())

    def __getitem__(self, name: str) -> Array:
        """Return one signal at `time`, a copy.

        Raises:
            UsageError: If there is no such signal.
        """
        if not isinstance(name, str) or name not in self._names():
            return self.state.__missing__(name)
        if name in WATCHED:
            self.plant.fold_steps()
        values: Array = getattr(self.plant.state, name).copy()
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
        self._advance(self.plant.steps + (1 if seconds is None else self._steps_in(seconds)))
        return self

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
        given = np.zeros(p) if velocity is None else velocity
        speed = numbers(given, "velocity", (p,), f"{p} components [m/s]")
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
            UsageError: If what is recorded or simulated would have another size, such as with more robots, if
                the mission's samples would be others, or if its end would be past.
        """
        scenario = self.scenario.replace(changes, **more)
        world = self._build(scenario)
        self._check_sizes(scenario, world)
        before, self.scenario = self.plant, scenario
        self._settle(world)
        self.plant.carry_on(before)
        words = ", ".join(map(str, [*changes, *more]))
        self._note(f"change of {words}" if words else "no change")

    @checked
    def on_sample(self, watcher: Callable[[Self], object]) -> None:
        """Have a function called after each sample, `recording.rate` times a simulated second.

        Args:
            watcher: Called with the mission; it may intervene.
        """
        self._watchers.append(watcher)

    def _names(self) -> list[str]:
        """Names of the signals that are recorded."""
        return ["time", *(one.name for one in SIGNALS[1:] if one.recorded(self.world.sizes))]

    def _advance(self, wanted: int) -> None:
        """Simulate until so many physics steps are done, or the mission ends."""
        began = time.perf_counter()
        end = min(wanted, self.world.schedule.last + 1)
        with native_loop(self.world):
            for until in self.stretches(end):
                self._advance_undisturbed(until)
                if signal := stopping.asked():
                    raise KeyboardInterrupt(f"interrupted by {signal}")
                if self.outcome is not Outcome.RUNNING:
                    break
        self.wall += time.perf_counter() - began

    def _advance_undisturbed(self, until: int) -> None:
        """Simulate until so many physics steps are done while what acts from outside stays the same."""
        schedule, plant = self.world.schedule, self.plant
        due = schedule.before(until) - schedule.before(plant.steps)
        if self._watchers:
            due = min(due, 1)
        if due:
            rows = np.empty((due, self.world.record_size))
            kept, ended, outcome, message = take(plant, rows, self.bound, look=due >= BLOCK)
            self.keep(rows[:kept], ended)
            if outcome is not Outcome.COMPLETED:
                self.outcome, self.message = outcome, message
                return
            if plant.steps > schedule.last:
                self.outcome, self.message = Outcome.COMPLETED, completed(rows)
            for watcher in self._watchers:
                watcher(self)
        elif plant.steps < until:
            plant.step(until - plant.steps)

    def _check_sizes(self, scenario: Scenario, world: World) -> None:
        """Refuse a change after which samples or bodies are others, or the end is past."""
        for name in self.world.sizes | world.sizes:
            size, new_size = self.world.sizes.get(name, 0), world.sizes.get(name, 0)
            if new_size != size:
                raise UsageError(f"change: the number of {name} entries becomes {new_size}; it is {size}")
        for name in ("nq", "nv", "na", "nu", "nmocap"):
            before, after = getattr(self.world.model, name), getattr(world.model, name)
            if before != after:
                raise UsageError(f"change: MuJoCo's {name} becomes {after}; it is {before}")
        old, new = self.world.schedule, world.schedule
        if (old.stride, scenario.physics.timestep) != (new.stride, self.scenario.physics.timestep):
            raise UsageError("change: the timestep and the rate of recording stay as they are")
        done = self.plant.steps
        if self.outcome is Outcome.RUNNING and done > new.last:
            now = f"expected more than {self.time:g} s, where the mission is"
            raise UsageError(f"change: the duration becomes {scenario.duration:g} s; {now}")
        if old.before(done) != new.before(done):
            raise UsageError("change: windows of expectations that have begun stay as they are")
