"""The public controller: a mission's law, called with measurements, for robots outside the simulation."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from escort_mj.errors import EscortError, UsageError
from escort_mj.scenario.findings import did_you_mean, listed, shown
from escort_mj.scenario.geometry.obstacles import obstacles_of
from escort_mj.scenario.geometry.placement import Placement, team
from escort_mj.scenario.reader.overrides import Overrides
from escort_mj.scenario.reader.shipped import load_scenario
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.scenario.setup import controller_setup
from escort_mj.sensing.sensors import Sensors
from escort_mj.standalone.backends import BACKENDS, CONTROL_SIGNALS, Backend
from escort_mj.standalone.knowledge import Knowledge, Surroundings, is_finite, numbers

if TYPE_CHECKING:
    from escort_mj.standalone.robot import RobotController

Array = NDArray[np.float64]

BEFORE = "before."  # in front of what is known of the last call, in a saved state


class Signals(dict[str, Any]):
    """Values of signals by their names in the trace."""

    def __missing__(self, name: str) -> Any:
        raise UsageError(f"{shown(name)} is not a signal of the controller{did_you_mean(name, self)}")


class Controller:
    """The controller of a scenario without the simulator, for robots outside the simulation.

    Each call takes the measurements at one time and returns the force for every robot. MuJoCo is
    imported only for robots from MJCF files. Positions, velocities and forces are in the frame of the
    scenario's coordinates.

    The law counts in timesteps (`physics.timestep`): a call less than half a timestep after the previous one
    evaluates the law again without advancing its state. A call several timesteps later makes up for the
    missed ones, with the measurements interpolated between the two calls. A gap longer than `longest_gap`
    or a time that steps back is an error.

    Attributes:
        scenario: The checked scenario.
        timestep: Time between two calls for which the law is meant [s].
        count: Number of robots, n.
        axes: Dimension of the space, p.
        start: Positions of the robots at the start of the scenario, shape (n, p) [m].
        mass: Mass of each robot in the scenario, shape (n,) [kg].
        force_limit: Largest force per axis of each robot, shape (n,) [N]; inf for none.
        obstacles: Names of all obstacles, m of them.
        units: Unit of each signal.
    """

    units: Mapping[str, str] = MappingProxyType({name: one.unit for name, one in CONTROL_SIGNALS.items()})

    def __init__(
        self,
        scenario: Scenario | str | os.PathLike[str] | Mapping[str, Any],
        overrides: Overrides = (),
        *,
        plugins: Sequence[str] = (),
        backend: Literal["native", "numpy"] = "native",
        simulate: bool = False,
        longest_gap: float = 0.1,
    ) -> None:
        """Create the controller of a scenario.

        Args:
            scenario: A scenario, or any source that `load_scenario` accepts: a file, a name, or keys.
            overrides: A mapping of key paths to values, or texts `key.path=value`.
            plugins: Additional plugins: Python files or names of installed plugins.
            backend: `native`: the machine code that missions run. `numpy`: the same law in plain NumPy, slow,
                for reading and for a debugger. Both agree to 1e-10.
            simulate: Whether to add what the scenario simulates around the law: errors of sensors, what
                robots see, hear and estimate, failures of motors and the disturbance. By default, the law is
                given the measurements as they are. The ranges of `sensing.radius` always apply.
            longest_gap: Longest time between two calls for which missed timesteps are made up for [s].

        Raises:
            ScenarioError: With all faults of the scenario.
            UsageError: If an argument is not valid.
        """
        if backend not in BACKENDS:
            raise UsageError(f"backend: found {shown(backend)}; allowed is {listed(list(BACKENDS))}")
        if not longest_gap > 0.0:
            raise UsageError(f"longest_gap: found {shown(longest_gap)}; allowed is a time above 0 [s]")
        if isinstance(scenario, Scenario):
            scenario = scenario.replace(overrides) if overrides else scenario
        else:
            scenario = load_scenario(scenario, overrides, plugins)
        self.scenario = scenario
        self._options: dict[str, Any] = {
            "backend": backend,
            "simulate": simulate,
            "longest_gap": longest_gap,
        }
        self._robots: Placement = team(scenario)
        self._bodies = obstacles_of(scenario)
        self.timestep = scenario.physics.timestep
        self.count, self.axes = self._robots.position.shape
        self.obstacles = tuple(body.name for body in self._bodies)
        self.start: Array = self._robots.position.copy()
        self.mass: Array = self._robots.mass.copy()
        self.force_limit: Array = self._robots.force_limit.copy()
        self.reset()

    def reset(self, positions: ArrayLike | None = None, target: ArrayLike | None = None) -> None:
        """Start the mission again; the next call is its first one, at any time.

        Args:
            positions: Positions of the robots, shape (n, p) [m]: each robot gets a nearby place in the
                formation. None for the scenario's start.
            target: Position of the target at this time, shape (p,) [m]; None for the scenario's start.
        """
        robots = self._robots
        if positions is not None:
            place = numbers(positions, "positions", (self.count, self.axes), "one row per robot [m]")
            robots = robots._replace(position=place)
        if target is not None and self.scenario.target is None:
            raise UsageError("target: this mission has none (target: null)")
        if target is not None:  # all that counts is where robots are relative to it
            begin = controller_setup(self.scenario, self._robots).target.position(0.0)
            place = numbers(target, "target", (self.axes,), "coordinates [m]")
            robots = robots._replace(position=robots.position - place + begin)
        setup = controller_setup(self.scenario, robots)
        paths = [(mover.obstacle, mover.path) for mover in setup.movers if mover.obstacle >= 0]
        setup = replace(setup, movers=())
        if self._options["simulate"] and setup.sight is not None and setup.sight.field < math.inf:
            raise UsageError(
                "simulate: the scenario has knowledge.target.field_of_view, and a controller is not given "
                "headings; expected simulate=False, or a scenario without it"
            )
        if not self._options["simulate"]:
            ranges = Sensors(robots=setup.sensing.robots, obstacles=setup.sensing.obstacles)
            setup = replace(setup, sensing=ranges, disturbance=None, failures=(), reforming=None)
            setup = replace(setup, sight=None, radio=None)
        self._surroundings = Surroundings(setup, self._bodies, paths, self._robots.mass)
        self._backend: Backend = BACKENDS[self._options["backend"]](setup)
        self._before: Knowledge | None = None
        self._first = self._evaluated = 0.0  # times of the first call, and up to which the state has come
        self._steps = 0

    def __call__(
        self,
        time: float,
        positions: ArrayLike,
        velocities: ArrayLike,
        target: tuple[ArrayLike, ArrayLike] | None = None,
        obstacles: ArrayLike | None = None,
        *,
        points: ArrayLike | None = None,
        mass: ArrayLike | None = None,
        bias: ArrayLike | None = None,
    ) -> Array:
        """Return the force for every robot, within its force limit, shape (n, p) [N].

        The force does not include the weight of flying robots.

        Args:
            time: Time of the measurements [s]; any clock that does not step back.
            positions: Positions of the robots, shape (n, p) [m].
            velocities: Velocities of the robots, shape (n, p) [m/s].
            target: Position [m] and velocity [m/s] of the target, shape (p,) each; None for the scenario's
                own.
            obstacles: Centers of the moving obstacles in the order of the scenario, or of all obstacles,
                shape (k, p) [m]; None for the scenario's own.
            points: The point of each obstacle that is nearest to each robot, shape (n, m, p) [m], for sensors
                that measure it; for spheres, the center. None to compute it from the shapes.
            mass: Mass of each robot, shape (n,), or mass matrix, shape (n, p, p) [kg], for laws that use a
                model; None for the scenario's mass.
            bias: Bias force of each robot, likewise, shape (n, p) [N]; None for none.

        Raises:
            UsageError: If an array has a wrong shape or contains a number that is not finite, if the time
                steps back, or if the gap since the last call is too long; the state does not change.
            EscortError: If the law or a plugin fails.
        """
        known, before = self._surroundings, self._before
        shape = self.count, self.axes
        now = float(numbers(time, "time", (), "a time [s]"))
        q = numbers(positions, "positions", shape, "one row per robot [m]")
        v = numbers(velocities, "velocities", shape, "one row per robot [m/s]")
        goal = known.target(target)
        centers = known.obstacles(now, obstacles, None if before is None else before.obstacles)
        seen = known.points(now, q, goal, centers, points)
        motion = known.motion(now, centers, obstacles is not None, before)
        self._advance(Knowledge(now, q, v, goal, centers, motion, seen, *known.model(mass, bias)))
        force = np.array(self._backend.value("force"))
        if not is_finite(force):
            robot = int(np.argwhere(~np.isfinite(force))[0, 0]) + 1
            raise EscortError(
                f"the law {self.scenario.law_names} gives no finite force for robot {robot} at {now:g} s"
            )
        return force

    def _advance(self, now: Knowledge) -> None:
        """Evaluate the law for a time, and before that for the timesteps that have been missed."""
        before, due = self._before, 1
        if before is None:
            self._first = now.time
        else:
            due = self._due(now.time, before.time)
            self._steps += due
        for step in range(1, due):
            assert before is not None
            self._backend.evaluate(now.since(before, step / due))
        self._evaluated = now.time if due else self._evaluated
        self._backend.evaluate(now._replace(time=self._evaluated))
        self._before = now

    def _due(self, time: float, before: float) -> int:
        """Return how many timesteps the state has to move on.

        Raises:
            UsageError: If the time steps back, or too far forward.
        """
        if time < before:
            raise UsageError(
                f"time: found {time:g} s after {before:g} s; time must not step back (reset starts again)"
            )
        due = round((time - self._first) / self.timestep) - self._steps
        longest = self._options["longest_gap"]
        if due > 1 and time - before > longest:
            raise UsageError(
                f"time: found {time:g} s after {before:g} s; allowed are at most {longest:g} s between two "
                "calls (longest_gap); reset starts again"
            )
        return due

    @property
    def velocity(self) -> Array:
        """Reference velocity of every robot, shape (n, p) [m/s], for robots that take velocities."""
        return np.array(self._backend.value("v_d"))

    @property
    def signals(self) -> Signals:
        """Copies of every control signal of the last call by name, as in the trace."""
        found = Signals()
        for name, signal in CONTROL_SIGNALS.items():
            value = np.asarray(self._backend.value(name)).astype(signal.dtype)
            found[name] = value if signal.dims else value.reshape(())[()]
        return found

    @property
    def state(self) -> dict[str, Any]:
        """Copy of everything that later calls depend on; set it to continue from there, bit for bit.

        With the backend `native`, it contains arrays only, for example for `numpy.savez`, and suits every
        controller of the same scenario and start. With `numpy`, it is valid only in the same process.
        """
        found = self._backend.save()
        found["clock"] = np.array([self._first, self._evaluated, self._steps])
        if self._before is not None:
            known = self._before._asdict().items()
            found |= {BEFORE + name: np.array(value) for name, value in known if value is not None}
        return found

    @state.setter
    def state(self, saved: Mapping[str, Any]) -> None:
        if "clock" not in saved:
            raise UsageError("state: found no clock; expected what `state` returned")
        self._backend.load(saved)
        first, evaluated, steps = (float(number) for number in saved["clock"])
        self._first, self._evaluated, self._steps = first, evaluated, round(steps)
        kept = {name: np.array(saved[BEFORE + name]) for name in Knowledge._fields if BEFORE + name in saved}
        self._before = Knowledge(**kept | {"time": float(kept["time"])}) if kept else None  # type: ignore[arg-type]

    def robot(self, number: int) -> RobotController:
        """Return the controller of one robot, for software that runs on it, with its own state.

        Args:
            number: Number of the robot, from 1.

        Raises:
            UsageError: If there is no such robot.
        """
        from escort_mj.standalone.robot import RobotController

        if isinstance(number, bool) or number not in range(1, self.count + 1):
            raise UsageError(f"robot: found {shown(number)}; allowed are 1 to {self.count}")
        team_controller = Controller(self.scenario, **self._options)
        return RobotController(team_controller, int(number))

    def __repr__(self) -> str:
        robots = f"{self.count} robot{'s' if self.count > 1 else ''} in {self.axes} axes"
        rate = 1.0 / self.timestep
        rate = round(rate) if math.isclose(rate, round(rate)) else rate
        return f"<Controller {self.scenario.name}: {robots}, {self.scenario.law_names}, {rate:g} Hz>"
