"""The public controller: a mission's law, called with measurements, for robots outside the simulation."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any, Literal, NoReturn

import numpy as np
from numpy.typing import ArrayLike, NDArray

from escort_mj.components.setup import COMMANDED, Outside
from escort_mj.errors import EscortError, UsageError
from escort_mj.scenario.arguments import (
    Overrides,
    Positive,
    Source,
    checked,
    is_finite,
    number,
    numbers,
    shape_of,
    whole_number,
)
from escort_mj.scenario.findings import shown
from escort_mj.scenario.mission import mission_of
from escort_mj.scenario.reader.shipped import load_scenario
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.sensing.sensors import Sensors
from escort_mj.snapshots import WORDS, Snapshot, Uncopied, checked_arrays, marked, mission_mark
from escort_mj.standalone.backend import CONTROL_SIGNALS, Backend, Signals
from escort_mj.standalone.clock import Clock
from escort_mj.standalone.guard import Guard
from escort_mj.standalone.heard import Heard
from escort_mj.standalone.knowledge import Knowledge, Surroundings
from escort_mj.standalone.limits import Event, Limits
from escort_mj.standalone.lost import who_may_be_lost

Array = NDArray[np.float64]

Mask = NDArray[np.bool_]

GUARD = "guard."  # in front of what is known of the limits, in a saved state
FINE = 0.01  # share of a timestep that a clock must tell apart
PERIODS = 4  # timesteps that braking lasts at least, so that it does not overshoot


def renamed(controller: object, *saved: object) -> NoReturn:
    """Say what is now called otherwise."""
    raise UsageError("state: is now snapshot() and restore(snapshot), as of missions")


class Controller(Uncopied):
    """The controller of a scenario without the simulator, for robots outside the simulation.

    Each call takes the measurements at one time and returns the force for every robot. MuJoCo is
    imported only for robots from MJCF files. Positions, velocities and forces are in the frame of the
    scenario's coordinates.

    The law counts in timesteps (`physics.timestep`): a call in the same timestep as the previous one, rounded
    to the nearest, evaluates the law again without advancing its state. A call several timesteps later makes
    up for the missed ones, with the measurements interpolated between the two calls. A gap longer than
    `longest_gap` or a time that steps back is an error.

    With `limits`, measurements, calls and robots are watched: robots whose measurements fail drop out and
    come back, and all robots come to rest where a limit says so. `events` lists what was done, when and why.

    Attributes:
        scenario: The checked scenario.
        timestep: Time between two calls for which the law is meant [s].
        count: Number of robots, n.
        axes: Dimension of the space, p.
        start: Positions of the robots at the start of the scenario, shape (n, p) [m].
        mass: Mass of each robot in the scenario, shape (n,) [kg].
        force_limit: Largest force per axis of each robot, shape (n,) [N]; inf for none.
        obstacles: Names of all obstacles, m of them.
        limits: What is watched; None for nothing.
        ages: Time since each robot's last usable measurement at the last call, shape (n,) [s]; inf before it.
        units: Unit of each signal.
    """

    units: Mapping[str, str] = MappingProxyType({name: one.unit for name, one in CONTROL_SIGNALS.items()})

    @checked
    def __init__(
        self,
        scenario: Scenario | Source,
        overrides: Overrides = (),
        *,
        plugins: Sequence[str] = (),
        backend: Literal["native", "interpreted"] = "native",
        simulate: bool = False,
        longest_gap: Positive = 0.1,
        limits: Limits | None = None,
        command: Literal["velocity", "residual", "force"] | None = None,
    ) -> None:
        """Create the controller of a scenario.

        Args:
            scenario: A scenario, or any source that `load_scenario` accepts: a file, a name, or keys.
            overrides: A mapping of key paths to values, or texts `key.path=value`.
            plugins: Additional plugins: Python files or names of installed plugins.
            backend: `native`: the machine code that missions run. `interpreted`: the same law as plain
                Python, where a debugger can stop, a thousand times slower. Both agree to rounding.
            simulate: Whether to add what the scenario simulates around the law: errors of sensors, what
                robots see, hear and estimate, failures of motors and the disturbance. By default, the law is
                given the measurements as they are. The ranges of `sensing.radius` always apply.
            longest_gap: Longest time between two calls for which missed timesteps are made up for [s].
            limits: What measurements, calls and robots must stay within; None to watch nothing. Limits do not
                go with `simulate`.
            command: What each call is given as `commanded`: reference velocities, which the law follows, or
                forces, instead of what the scenario's behaviors lead to, or a `residual`, velocities that are
                added to it. None for nothing.

        Raises:
            ScenarioError: With all faults of the scenario.
            UsageError: If an argument is not valid.
        """
        self.scenario = scenario = load_scenario(scenario, overrides, plugins)
        self._options: dict[str, Any] = {
            "backend": backend,
            "simulate": simulate,
            "longest_gap": longest_gap,
            "limits": limits,
            "command": command,
        }
        self.limits = limits
        self._mission = mission_of(scenario)
        robots = self._mission.team
        self.timestep = scenario.physics.timestep
        self.count, self.axes = robots.position.shape
        self.obstacles = tuple(body.name for body in self._mission.obstacles)
        self.start: Array = robots.position.copy()
        self.mass: Array = robots.mass.copy()
        self.force_limit: Array = robots.force_limit.copy()
        self.ages: Array = np.full(self.count, math.inf)
        self._no_age: Array = np.zeros(self.count)
        self._no_age.setflags(write=False)
        self._guard = None if limits is None else self._watched(limits)
        self.reset()

    def _watched(self, limits: Limits) -> Guard:
        """Return what watches over limits that suit the mission."""
        if self._options["simulate"]:
            raise UsageError("limits: found with simulate=True; they are for measurements of real robots")
        gap, least = self._options["longest_gap"], PERIODS * self.timestep
        if limits.silence is not None and limits.silence > gap:
            raise UsageError(
                f"limits.silence: found {limits.silence:g} s; allowed are at most {gap:g} s (longest_gap)"
            )
        if limits.braking_time < least:
            raise UsageError(
                f"limits.braking_time: found {limits.braking_time:g} s; allowed are at least {least:g} s, "
                f"{PERIODS} timesteps"
            )
        if limits.area is not None and limits.area.axes not in (None, self.axes):
            raise UsageError(f"limits.area: found {limits.area!r}; expected {self.axes} axes")
        return Guard(limits, self.mass, self.force_limit, self.axes)

    def reset(self, positions: ArrayLike | None = None, target: ArrayLike | None = None) -> None:
        """Start the mission again; the next call is its first one, at any time. A stop ends.

        Args:
            positions: Positions of the robots, shape (n, p) [m]: each robot gets a nearby place in the
                formation. None for the scenario's start, and with a limit on age NaN for robots that are not
                measured yet.
            target: Position of the target at this time, shape (p,) [m]; None for the scenario's start.
        """
        start = self.start
        if positions is not None:
            place = numbers(
                positions,
                "positions",
                (self.count, self.axes),
                "one row per robot [m]",
                unknown=self.may_miss,
            )
            start = np.where(np.isnan(place), self.start, place)
        if target is not None and self.scenario.target is None:
            raise UsageError("target: this mission has none (target: null)")
        if target is not None:  # all that counts is where robots are relative to it
            place = numbers(target, "target", (self.axes,), "coordinates [m]")
            start = start - place + self._mission.target.position(0.0)
        if self._guard is not None:
            self._guard.forget(
                self.start if positions is None else np.where(np.isnan(positions), self.start, positions)
            )
        setup = replace(self._mission, start=start).setup
        paths = [(mover.obstacle, mover.path) for mover in setup.movers if mover.obstacle >= 0]
        setup = replace(setup, movers=())
        if self._options["simulate"] and setup.field_of_view is not None:
            raise UsageError(
                "simulate: the scenario has knowledge.target.field_of_view, and a controller is not given "
                "headings; expected simulate=False, or a scenario without it"
            )
        if not self._options["simulate"]:
            ranges = Sensors(robots=setup.sensing.robots, obstacles=setup.sensing.obstacles)
            figures = setup.reforming if setup.teams else None  # teams that get another robot need them
            setup = replace(setup, sensing=ranges, failures=(), reforming=figures).undisturbed()
            setup = replace(setup, sight=None, radio=None)
        if self.limits is not None and self.limits.drops:
            setup = replace(setup, failures=who_may_be_lost(setup))
        setup = setup.commanded(self._options["command"])
        self._surroundings = Surroundings(setup, self._mission.obstacles, paths, self.mass)
        self._backend = Backend(setup, interpret=self._options["backend"] == "interpreted")
        self._clock = Clock(self._backend, self.timestep, self._options["longest_gap"], self.count)
        own = self._options, start.tolist()
        self._mark = mission_mark(self.scenario, *own, left_out=WORDS | {"recording", "expect"})

    def __call__(
        self,
        time: float,
        positions: ArrayLike,
        velocities: ArrayLike,
        target: tuple[ArrayLike, ArrayLike] | None = None,
        obstacles: ArrayLike | None = None,
        *,
        times: ArrayLike | None = None,
        points: ArrayLike | None = None,
        mass: ArrayLike | None = None,
        bias: ArrayLike | None = None,
        commanded: ArrayLike | None = None,
    ) -> Array:
        """Return the force for every robot, within its force limit, shape (n, p) [N].

        The force does not include the weight of flying robots.

        Args:
            time: Present time [s]; any clock that does not step back.
            positions: Positions of the robots, shape (n, p) [m]. With a limit on age, a row with NaN says
                that there is no new measurement of the robot; its last one counts.
            velocities: Velocities of the robots, shape (n, p) [m/s], likewise.
            target: Position [m] and velocity [m/s] of the target, shape (p,) each; None for the scenario's
                own.
            obstacles: Centers of the moving obstacles in the order of the scenario, or of all obstacles,
                shape (k, p) [m]; None for the scenario's own.
            times: Time of the measurement of each robot, on the clock of `time`, shape (n,) [s]; None where
                all were measured at `time`.
            points: The point of each obstacle that is nearest to each robot, shape (n, m, p) [m], for sensors
                that measure it; for spheres, the center. None to compute it from the shapes.
            mass: Mass of each robot, shape (n,), or mass matrix, shape (n, p, p) [kg], for laws that use a
                model; None for the scenario's mass.
            bias: Bias force of each robot, likewise, shape (n, p) [N]; None for none.
            commanded: What robots are to do, in a controller with `command`: reference velocities [m/s] or
                forces [N], shape (n, p); None for the last ones, at first 0.

        Raises:
            UsageError: If an array has a wrong shape or contains a number that is not finite, if the time
                steps back, if the gap since the last call is too long, or if a limit is exceeded whose action
                is `error`; the state does not change.
            EscortError: If the law or a plugin fails; with limits, all robots stop.
        """
        now, guard = number(time, "time", "a time [s]"), self._guard
        if math.ulp(now) > FINE * self.timestep:
            raise UsageError(
                f"time: found {now:g} s, a clock on which {self.timestep:g} s cannot be told apart"
            )
        q, v, stamps = self._measured(now, positions, velocities, times)
        wish = None if commanded is None else self._wished(commanded)
        if guard is None:
            self._clock.evaluate(self._known(now, q, v, target, obstacles, points, mass, bias), wish)
            self.ages = self._no_age if times is None else now - stamps
            return self._force(now)
        judged = guard.judge(now, q, v, stamps)
        if not (guard.stopped or judged.stop[1]):
            watch = judged.watch
            rests = (watch.out & ~judged.fresh)[:, None]
            known = self._known(
                now, watch.q, np.where(rests, 0.0, watch.v), target, obstacles, points, mass, bias
            )
            try:
                self._clock.evaluate(known, wish, judged)
                force = self._force(now)
            except UsageError:
                raise
            except EscortError as error:
                guard.halt("law", str(error), now)
                raise
        else:
            force = np.zeros_like(q)
        force = guard.settle(now, judged, force, np.array(self._backend.value("v_d")))
        self._backend.apply(force)
        self.ages = guard.ages
        return force

    @property
    def may_miss(self) -> bool:
        """Whether robots may be without a measurement."""
        return self.limits is not None and self.limits.age is not None

    def _measured(
        self, now: float, positions: ArrayLike, velocities: ArrayLike, times: ArrayLike | None
    ) -> tuple[Array, Array, Array]:
        """Return positions, velocities and times of the measurements; NaN where there is none."""
        shape, may_miss = (self.count, self.axes), self.may_miss
        q = numbers(positions, "positions", shape, "one row per robot [m]", unknown=may_miss)
        v = numbers(velocities, "velocities", shape, "one row per robot [m/s]", unknown=may_miss)
        if times is None:
            return q, v, self._no_age + now
        words = "time of each robot's measurement [s]"
        stamps = numbers(times, "times", (self.count,), words, unknown=may_miss)
        q[np.isnan(stamps)] = np.nan
        return q, v, np.where(np.isnan(stamps), now, stamps)

    def _known(
        self, now: float, q: Array, v: Array, target: Any, obstacles: Any, points: Any, mass: Any, bias: Any
    ) -> Knowledge:
        """Return what is known at a time: measured, or as the scenario says."""
        known, before = self._surroundings, self._clock.before
        goal = known.target(target)
        centers = known.obstacles(now, obstacles, None if before is None else before.obstacles)
        seen = known.points(now, q, goal, centers, points)
        motion = known.motion(now, centers, obstacles is not None, before)
        return Knowledge(now, q, v, goal, centers, motion, seen, *known.model(mass, bias))

    def _force(self, now: float) -> Array:
        """Return the forces of the last evaluation, shape (n, p) [N]."""
        force = np.array(self._backend.value("force"))
        if not is_finite(force):
            robot = int(np.argwhere(~np.isfinite(force))[0, 0]) + 1
            raise EscortError(
                f"the law {self.scenario.law_names} gives no finite force for robot {robot} at {now:g} s"
            )
        return force

    def _wished(self, commanded: ArrayLike) -> tuple[Outside, Array]:
        """Return what robots are commanded to do: its kind, and values of shape (n, p)."""
        kind = self._options["command"]
        if kind is None:
            raise UsageError(
                'commanded: found in a controller that its behaviors lead; expected command="velocity" or '
                'command="force" where it is made'
            )
        _, unit = COMMANDED[kind]
        return kind, numbers(commanded, "commanded", (self.count, self.axes), f"one row per robot [{unit}]")

    @property
    def velocity(self) -> Array:
        """Reference velocity of every robot, for robots that take velocities, shape (n, p) [m/s]."""
        return np.array(self._backend.value("v_d") if self._guard is None else self._guard.velocity)

    @property
    def events(self) -> list[Event]:
        """What the limits have done, in order: robots that are out or back, measurements not used, stops."""
        return [] if self._guard is None else list(self._guard.events)

    @property
    def out(self) -> Mask:
        """Which robots are out at the last call, shape (n,): they come to rest, and the others go on."""
        return np.zeros(self.count, dtype=bool) if self._guard is None else self._guard.watch.out.copy()

    @property
    def stopped(self) -> str:
        """Why all robots are to come to rest; empty while they are not."""
        return "" if self._guard is None else self._guard.stopped

    def command(self, time: float) -> Array:
        """Return what robots are to do now, within their force limits, shape (n, p) [N].

        It is the force that the last call returned or, once no call has come for longer than
        `limits.silence`, the stop: forces that bring robots to rest, by what their velocities must be. A
        driver asks for it in a loop of its own, in any thread; `velocity` goes with it.

        Args:
            time: Present time, on the clock of the calls [s].

        Raises:
            UsageError: If the time is not valid, or the controller has no limits.
        """
        return self._guarded("command").command(number(time, "time", "a time [s]"))

    def stop(self, reason: str = "stop was called") -> None:
        """Let all robots come to rest, until `reset`.

        Args:
            reason: Why, for `events`.

        Raises:
            UsageError: If the reason is not a text, or the controller has no limits.
        """
        guard = self._guarded("stop")
        if not isinstance(reason, str):
            raise UsageError(f"reason: found {shown(reason)}; expected a text")
        guard.halt("user", reason or "stop was called")

    def _guarded(self, method: str) -> Guard:
        if self._guard is None:
            raise UsageError(
                f"{method}: this controller has no limits; expected Controller(..., limits=Limits())"
            )
        return self._guard

    @property
    def signals(self) -> Signals:
        """Copies of every control signal of the last call by name, as in the trace."""
        found = Signals()
        for name, signal in CONTROL_SIGNALS.items():
            value = np.asarray(self._backend.value(name)).astype(signal.dtype)
            found[name] = value if signal.dims else value.reshape(())[()]
        return found

    def snapshot(self) -> Snapshot:
        """Return everything that later calls depend on; `restore` continues from there, bit for bit.

        It consists of arrays only, for example for `numpy.savez`, and suits every controller of the same
        scenario, start, backend and limits.
        """
        found = self._clock.save()
        if self._guard is not None:
            found |= {GUARD + name: value for name, value in self._guard.save().items()}
        return marked(found, self._mark)

    def restore(self, snapshot: Mapping[str, Any]) -> None:
        """Come back to a moment.

        Args:
            snapshot: What `snapshot` returned, also read from a file, such as by `numpy.load`.

        Raises:
            UsageError: If it is anything else, of another mission, start, backend or limits, or has been
                changed; the controller does not change.
        """
        state = checked_arrays(snapshot, self._mark, left_out=("known", "heard_at"))
        self._clock.load(state)
        if self._guard is not None:
            self._guard.load({name.removeprefix(GUARD): value for name, value in state.items()})
            self._clock.lost, self.ages = self._guard.watch.out.copy(), self._guard.ages

    state = property(renamed, renamed)

    def robot(self, number: int) -> RobotController:
        """Return the controller of one robot, for software that runs on it, with its own state.

        Args:
            number: Number of the robot, from 1.

        Raises:
            UsageError: If there is no such robot.
        """
        row = whole_number(number, "robot", f"a number from 1 to {self.count}", 1, self.count)
        return RobotController(Controller(self.scenario, **self._options), row)

    def __repr__(self) -> str:
        robots = f"{self.count} robot{'s' if self.count > 1 else ''} in {self.axes} axes"
        rate = 1.0 / self.timestep
        rate = round(rate) if math.isclose(rate, round(rate)) else rate
        return f"<Controller {self.scenario.name}: {robots}, {self.scenario.law_names}, {rate:g} Hz>"


class RobotController(Uncopied):
    """The law as one robot computes it, with its own measurements and what it knows of its teammates.

    `Controller.robot` creates it. The robot computes the law of the whole team, as far as it knows the team,
    and keeps its own row: given the same measurements, the force is that of the team's controller, bit for
    bit.

    Attributes:
        number: Number of the robot, from 1.
        timestep: Time between two calls for which the law is meant [s].
        team: The team's controller as this robot has it, for example for its signals.
    """

    def __init__(self, team: Controller, number: int) -> None:
        """Take over a controller; use `Controller.robot`."""
        self.team, self.number, self.timestep = team, number, team.timestep
        self._row = number - 1
        self._heard = Heard(team.start)

    def reset(self, positions: ArrayLike | None = None, target: ArrayLike | None = None) -> None:
        """Start the mission again, see `Controller.reset`; teammates stay there until they are heard."""
        self.team.reset(positions, target)
        self._heard = Heard(self.team.start if positions is None else np.array(positions, dtype=float))

    def __call__(
        self,
        time: float,
        position: ArrayLike,
        velocity: ArrayLike,
        teammates: Mapping[int, ArrayLike] | ArrayLike | None = None,
        target: tuple[ArrayLike, ArrayLike] | None = None,
        obstacles: ArrayLike | None = None,
        *,
        times: Mapping[int, float] | None = None,
        points: ArrayLike | None = None,
        mass: ArrayLike | None = None,
        bias: ArrayLike | None = None,
        commanded: ArrayLike | None = None,
    ) -> Array:
        """Return the force for this robot, within its force limit, shape (p,) [N].

        Args:
            time: Time of the measurements [s].
            position: Position of this robot, shape (p,) [m].
            velocity: Velocity of this robot, shape (p,) [m/s].
            teammates: Positions by robot number, shape (p,) [m], for teammates with a new position, or those
                of the whole team, shape (n, p), in which the robot's own row is ignored; or pairs of
                positions and velocities, shape (2, p) or (2, n, p) [m, m/s]. Outer loops that look at
                velocities of teammates, such as `set_based`, take one that is not given for 0. A teammate
                that is not listed stays at its last known position, initially its start; with a limit on age,
                it is out when that is too old.
            target: As for `Controller`.
            obstacles: As for `Controller`.
            times: Times of the measurements of robots, its own and of those listed, by number [s]; `time` for
                others that are listed.
            points: Nearest point of each obstacle, shape (m, p) [m].
            mass: Mass of this robot, one number or a matrix, shape (p, p) [kg].
            bias: Bias force of this robot, shape (p,) [N].
            commanded: What this robot is to do, shape (p,), as for `Controller`.

        Raises:
            UsageError: As for `Controller`.
            EscortError: As for `Controller`.
        """
        team, row = self.team, self._row
        p = team.axes
        places, speeds = self._heard.with_new(teammates)
        now = number(time, "time", "a time [s]")
        stamps = self._heard.times_with(now, self.number, teammates, {} if times is None else times)
        places[row] = numbers(position, "position", (p,), "coordinates [m]")
        speeds[row] = numbers(velocity, "velocity", (p,), "components [m/s]")
        given = {name: None if one is None else self._mine(name, one) for name, one in (
            ("points", points), ("mass", mass), ("bias", bias), ("commanded", commanded),
        )}  # fmt: skip
        given["times"] = stamps if team.may_miss else None
        forces = team(time, places, speeds, target, obstacles, **given)
        self._heard.places, self._heard.times = places, stamps
        return forces[row]

    def _mine(self, name: str, value: ArrayLike) -> Array:
        """Return what is known of this robot in place of all; of the others the same is assumed."""
        n, p, m = self.team.count, self.team.axes, len(self.team.obstacles)
        matrix = () if not shape_of(value) else (p, p)
        shape = {"points": (m, p), "bias": (p,), "commanded": (p,), "mass": matrix}[name]
        mine = numbers(value, name, shape, "what is known of this robot")
        return np.broadcast_to(mine, (n, *mine.shape))

    @property
    def velocity(self) -> Array:
        """Reference velocity of this robot, shape (p,) [m/s]."""
        return self.team.velocity[self._row]

    @property
    def out(self) -> NDArray[np.bool_]:
        """Which robots of the team are out, as this robot knows, shape (n,)."""
        return self.team.out

    @property
    def events(self) -> list[Event]:
        """As for `Controller`."""
        return self.team.events

    @property
    def stopped(self) -> str:
        """As for `Controller`."""
        return self.team.stopped

    def command(self, time: float) -> Array:
        """Return what this robot is to do now, shape (p,) [N], see `Controller.command`."""
        return self.team.command(time)[self._row]

    def stop(self, reason: str = "stop was called") -> None:
        """Let this robot come to rest, until `reset`, see `Controller.stop`."""
        self.team.stop(reason)

    @property
    def signals(self) -> Signals:
        """Every control signal of the team as this robot computes it, see `Controller.signals`."""
        return self.team.signals

    def snapshot(self) -> Snapshot:
        """As for `Controller`, with the last known positions of the teammates."""
        return Snapshot(self.team.snapshot(), **self._heard.saved())

    def restore(self, snapshot: Mapping[str, Any]) -> None:
        """Come back to a moment, see `Controller.restore`."""
        heard = self._heard.read(snapshot)
        self.team.restore(snapshot)
        self._heard = heard

    state = property(renamed, renamed)

    def __repr__(self) -> str:
        return f"<RobotController {self.number} of {self.team!r}>"
