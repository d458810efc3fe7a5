"""One robot's view of the law, for software that runs on the robot."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from escort_mj.errors import UsageError
from escort_mj.standalone.knowledge import numbers

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

    def reset(self, positions: ArrayLike | None = None, target: ArrayLike | None = None) -> None:
        """Start the mission again, see `Controller.reset`; teammates stay there until they are heard."""
        self.team.reset(positions, target)
        self._known = self.team.start.copy() if positions is None else np.array(positions, dtype=float)

    def __call__(
        self,
        time: float,
        position: ArrayLike,
        velocity: ArrayLike,
        teammates: Mapping[int, ArrayLike] | ArrayLike | None = None,
        target: tuple[ArrayLike, ArrayLike] | None = None,
        obstacles: ArrayLike | None = None,
        *,
        points: ArrayLike | None = None,
        mass: ArrayLike | None = None,
        bias: ArrayLike | None = None,
    ) -> Array:
        """Return the force for this robot, within its force limit, shape (p,) [N].

        Args:
            time: Time of the measurements [s].
            position: Position of this robot, shape (p,) [m].
            velocity: Velocity of this robot, shape (p,) [m/s].
            teammates: Positions by robot number, for teammates with a new position, or positions of the
                whole team, shape (n, p) [m], in which the robot's own row is ignored. A teammate that is
                not listed stays at its last known position, initially its start.
            target: As for `Controller`.
            obstacles: As for `Controller`.
            points: Nearest point of each obstacle, shape (m, p) [m].
            mass: Mass of this robot, one number or a matrix, shape (p, p) [kg].
            bias: Bias force of this robot, shape (p,) [N].

        Raises:
            UsageError: As for `Controller`.
            EscortError: As for `Controller`.
        """
        team, row = self.team, self._row
        n, p = team.count, team.axes
        places = self._heard(teammates)
        places[row] = numbers(position, "position", (p,), "coordinates [m]")
        speeds = np.zeros((n, p))
        speeds[row] = numbers(velocity, "velocity", (p,), "components [m/s]")
        given = {name: None if one is None else self._mine(name, one) for name, one in (
            ("points", points), ("mass", mass), ("bias", bias),
        )}  # fmt: skip
        forces = team(time, places, speeds, target, obstacles, **given)
        self._known = places
        return forces[row]

    def _heard(self, teammates: Mapping[int, ArrayLike] | ArrayLike | None) -> Array:
        """Return where the team is as far as this robot knows, shape (n, p) [m]."""
        places, (n, p) = self._known.copy(), self._known.shape
        if isinstance(teammates, Mapping):
            for number, place in teammates.items():
                if isinstance(number, bool) or number not in range(1, n + 1):
                    raise UsageError(f"teammates: found robot {number!r}; allowed are 1 to {n}")
                places[number - 1] = numbers(place, f"position of robot {number}", (p,), "coordinates [m]")
        elif teammates is not None:
            places = numbers(teammates, "teammates", (n, p), "one row per robot [m]")
        return places

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
    def signals(self) -> Signals:
        """Every control signal of the team as this robot computes it, see `Controller.signals`."""
        return self.team.signals

    @property
    def state(self) -> dict[str, Any]:
        """As for `Controller`, with the last known positions of the teammates."""
        return self.team.state | {"known": self._known.copy()}

    @state.setter
    def state(self, saved: Mapping[str, Any]) -> None:
        if np.shape(saved.get("known", ())) != self._known.shape:
            raise UsageError("state: this is not the state of one robot of this mission")
        self.team.state = saved
        self._known = np.array(saved["known"], dtype=float)

    def __repr__(self) -> str:
        return f"<RobotController {self.number} of {self.team!r}>"
