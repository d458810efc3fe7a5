"""One robot's view of the law, for software that runs on the robot."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from escort_mj.errors import UsageError
from escort_mj.scenario.arguments import argument_error, number, numbers, whole_number
from escort_mj.standalone.limits import Event

if TYPE_CHECKING:
    from escort_mj.standalone.controller import Controller, Signals

Array = NDArray[np.float64]


class RobotController:
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
        self._known: Array = team.start.copy()
        self._heard_at: Array = np.full(team.count, -math.inf)

    def reset(self, positions: ArrayLike | None = None, target: ArrayLike | None = None) -> None:
        """Start the mission again, see `Controller.reset`; teammates stay there until they are heard."""
        self.team.reset(positions, target)
        self._known = self.team.start.copy() if positions is None else np.array(positions, dtype=float)
        self._heard_at = np.full(self.team.count, -math.inf)

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

        Raises:
            UsageError: As for `Controller`.
            EscortError: As for `Controller`.
        """
        team, row = self.team, self._row
        p = team.axes
        places, speeds = self._heard(teammates)
        stamps = self._stamps(number(time, "time", "a time [s]"), teammates, {} if times is None else times)
        places[row] = numbers(position, "position", (p,), "coordinates [m]")
        speeds[row] = numbers(velocity, "velocity", (p,), "components [m/s]")
        given = {name: None if one is None else self._mine(name, one) for name, one in (
            ("points", points), ("mass", mass), ("bias", bias),
        )}  # fmt: skip
        given["times"] = stamps if team.may_miss else None
        forces = team(time, places, speeds, target, obstacles, **given)
        self._known, self._heard_at = places, stamps
        return forces[row]

    def _heard(self, teammates: Mapping[int, ArrayLike] | ArrayLike | None) -> tuple[Array, Array]:
        """Return where the team is and how fast, as far as this robot knows, shape (n, p) each [m, m/s]."""
        places, speeds, (n, p) = self._known.copy(), np.zeros_like(self._known), self._known.shape
        if isinstance(teammates, Mapping):
            for name, heard in teammates.items():
                mate = whole_number(name, "teammates", f"numbers of robots, from 1 to {n}", 1, n)
                both = _position_and_velocity(heard, f"position of robot {mate}", (p,), "coordinates [m]")
                places[mate - 1], speeds[mate - 1] = both
        elif teammates is not None:
            places, speeds = _position_and_velocity(teammates, "teammates", (n, p), "one row per robot [m]")
        return places, speeds

    def _stamps(self, time: float, teammates: object, times: Mapping[int, float]) -> Array:
        """Return when each robot was measured last, shape (n,) [s]; -inf for never."""
        n, stamps = self.team.count, self._heard_at.copy()
        if not isinstance(times, Mapping):
            raise argument_error("times", times, "times by number of the robot [s]")
        heard = teammates if isinstance(teammates, Mapping) else () if teammates is None else range(1, n + 1)
        for mate in {*heard, self.number}:
            stamps[mate - 1] = time
        for name, at in times.items():
            mate = whole_number(name, "times", f"numbers of robots, from 1 to {n}", 1, n)
            stamps[mate - 1] = number(at, f"time of robot {mate}", "a time [s]")
        return stamps

    def _mine(self, name: str, value: ArrayLike) -> Array:
        """Return what is known of this robot in place of all; of the others the same is assumed."""
        n, p, m = self.team.count, self.team.axes, len(self.team.obstacles)
        shape = {"points": (m, p), "bias": (p,), "mass": () if np.ndim(value) == 0 else (p, p)}[name]
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

    @property
    def state(self) -> dict[str, Any]:
        """As for `Controller`, with the last known positions of the teammates."""
        return self.team.state | {"known": self._known.copy(), "heard_at": self._heard_at.copy()}

    @state.setter
    def state(self, saved: Mapping[str, Any]) -> None:
        if not isinstance(saved, Mapping) or not {"known", "heard_at"} <= saved.keys():
            raise UsageError("state: this is not the state of one robot of this mission")
        known = numbers(saved["known"], "known positions of the state", self._known.shape, "[m]")
        heard = np.asarray(saved["heard_at"], dtype=float)
        if heard.shape != self._heard_at.shape or np.isnan(heard).any():
            raise UsageError("state: heard_at is not that of this mission")
        self.team.state = saved
        self._known, self._heard_at = known, heard.copy()

    def __repr__(self) -> str:
        return f"<RobotController {self.number} of {self.team!r}>"


def _position_and_velocity(
    value: ArrayLike, name: str, shape: tuple[int, ...], what: str
) -> tuple[Array, Array]:
    """Return a position and a velocity of a shape, where one or both were given."""
    try:
        both = np.ndim(value) == len(shape) + 1
    except ValueError:  # rows of different lengths
        both = False
    if not both:
        place = numbers(value, name, shape, what)
        return place, np.zeros_like(place)
    pair = numbers(value, name, (2, *shape), f"{what}, and velocities [m/s]")
    return pair[0], pair[1]
