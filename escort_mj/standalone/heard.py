"""What one robot knows of its team: where each teammate was last, and since when."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from escort_mj.errors import UsageError
from escort_mj.scenario.arguments import argument_error, number, numbers, shape_of, whole_number

Array = NDArray[np.float64]


class Heard:
    """Last known positions of a team, and the times of their measurements.

    Attributes:
        places: Shape (n, p) [m].
        times: Shape (n,) [s]; -inf for never.
    """

    def __init__(self, places: Array) -> None:
        """Begin with positions that nobody has measured, shape (n, p) [m]."""
        self.places, self.times = places.copy(), np.full(len(places), -math.inf)

    def with_new(self, teammates: Mapping[int, ArrayLike] | ArrayLike | None) -> tuple[Array, Array]:
        """Return where the team is and how fast, with what is heard now, shape (n, p) each [m, m/s]."""
        places, speeds, (n, p) = self.places.copy(), np.zeros_like(self.places), self.places.shape
        if isinstance(teammates, Mapping):
            for name, heard in teammates.items():
                mate = whole_number(name, "teammates", f"numbers of robots, from 1 to {n}", 1, n)
                both = _position_and_velocity(heard, f"position of robot {mate}", (p,), "coordinates [m]")
                places[mate - 1], speeds[mate - 1] = both
        elif teammates is not None:
            places, speeds = _position_and_velocity(teammates, "teammates", (n, p), "one row per robot [m]")
        return places, speeds

    def times_with(self, time: float, own: int, teammates: object, times: Mapping[int, float]) -> Array:
        """Return when each robot was measured last, with what is heard now, shape (n,) [s]; -inf for never.

        Args:
            time: Present time [s].
            own: Number of the robot that hears, from 1.
            teammates: As for `with_new`.
            times: Times of measurements by number of the robot [s]; `time` for others that are heard.
        """
        n, found = len(self.times), self.times.copy()
        if not isinstance(times, Mapping):
            raise argument_error("times", times, "times by number of the robot [s]")
        heard = teammates if isinstance(teammates, Mapping) else () if teammates is None else range(1, n + 1)
        for mate in {*heard, own}:
            found[mate - 1] = time
        for name, at in times.items():
            mate = whole_number(name, "times", f"numbers of robots, from 1 to {n}", 1, n)
            found[mate - 1] = number(at, f"time of robot {mate}", "a time [s]")
        return found

    def saved(self) -> dict[str, Array]:
        """Return copies of both, for a snapshot."""
        return {"known": self.places.copy(), "heard_at": self.times.copy()}

    def read(self, snapshot: Any) -> Heard:
        """Return what a snapshot has of both, for the same team.

        Raises:
            UsageError: If it has not, or of another shape.
        """
        if not isinstance(snapshot, Mapping) or not {"known", "heard_at"} <= snapshot.keys():
            raise UsageError("snapshot: this is not that of one robot of this mission")
        found = Heard(numbers(snapshot["known"], "known positions of the snapshot", self.places.shape, "[m]"))
        times = np.asarray(snapshot["heard_at"], dtype=float)
        if times.shape != self.times.shape or np.isnan(times).any():
            raise UsageError("snapshot: heard_at is not that of this mission")
        found.times = times.copy()
        return found


def _position_and_velocity(
    value: ArrayLike, name: str, shape: tuple[int, ...], what: str
) -> tuple[Array, Array]:
    """Return a position and a velocity of a shape, where one or both were given."""
    try:
        both = len(shape_of(value)) == len(shape) + 1
    except ValueError:  # rows of different lengths
        both = False
    if not both:
        place = numbers(value, name, shape, what)
        return place, np.zeros_like(place)
    pair = numbers(value, name, (2, *shape), f"{what}, and velocities [m/s]")
    return pair[0], pair[1]
