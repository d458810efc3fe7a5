"""What measurements, calls and robots must stay within, and what is done where they do not."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from escort_mj.errors import UsageError
from escort_mj.scenario.arguments import (
    Bound,
    NotNegative,
    Positive,
    argument_error,
    checked_fields,
    number,
    numbers,
    shape_of,
)

Array = NDArray[np.float64]
Action = Literal["error", "stop", "drop"]
TeamAction = Literal["error", "stop"]


class Area:
    """Where robots must stay: `Area.box`, `Area.sphere` or `Area.polygon`, in the frame of the scenario.

    Attributes:
        axes: Dimension of the space that it is for; None for any that has the plane's two axes first.
    """

    axes: int | None

    @staticmethod
    def box(low: ArrayLike, high: ArrayLike) -> Area:
        """Return an upright box.

        Args:
            low: Its least coordinates, shape (p,) [m].
            high: Its largest coordinates, shape (p,) [m].

        Raises:
            UsageError: If shapes differ, or the box is empty.
        """
        size = (max(math.prod(shape_of(low)), 1),)
        least = numbers(low, "low", size, "least coordinates [m]")
        most = numbers(high, "high", size, "largest coordinates [m]")
        if not (least < most).all():
            raise UsageError(
                f"high: found {most.tolist()}; expected coordinates above {least.tolist()} (low)"
            )
        return _Box(least, most)

    @staticmethod
    def sphere(center: ArrayLike, radius: float) -> Area:
        """Return a sphere, in the plane a circle.

        Args:
            center: Its center, shape (p,) [m].
            radius: Its radius [m].

        Raises:
            UsageError: If an argument is not valid.
        """
        middle = numbers(center, "center", (max(math.prod(shape_of(center)), 1),), "coordinates [m]")
        size = number(radius, "radius", "a length above 0 [m]", Bound(0.0, above=True))
        return _Sphere(middle, size)

    @staticmethod
    def polygon(corners: ArrayLike, low: float | None = None, high: float | None = None) -> Area:
        """Return a polygon in the plane of the first two axes; in space, between two heights.

        Args:
            corners: Its corners in order, shape (k, 2), k at least 3 [m].
            low: Least height [m]; None for any.
            high: Largest height [m]; None for any.

        Raises:
            UsageError: If an argument is not valid.
        """
        count = max([3, *shape_of(corners)[:1]])
        points = numbers(corners, "corners", (count, 2), "at least three corners in the plane [m]")
        around = points - points.mean(axis=0)
        x, y = around.T
        if abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) <= 1e-9 * np.square(around).sum():
            raise argument_error("corners", corners, "corners in order around an area [m]")
        least = -np.inf if low is None else number(low, "low", "a height [m]")
        bound = Bound(least, above=True)
        most = np.inf if high is None else number(high, "high", "a height above low [m]", bound)
        return _Polygon(points, least, most)

    def beyond(self, places: Array) -> Array:
        """Return how far outside places are, shape (n,) [m]; 0 or less inside.

        Args:
            places: Shape (n, p) [m].
        """
        raise NotImplementedError


class _Box(Area):
    def __init__(self, low: Array, high: Array) -> None:
        self.low, self.high, self.axes = low, high, len(low)

    def beyond(self, places: Array) -> Array:
        return np.asarray(np.maximum(self.low - places, places - self.high).max(axis=1))

    def __repr__(self) -> str:
        return f"Area.box({self.low.tolist()}, {self.high.tolist()})"


class _Sphere(Area):
    def __init__(self, center: Array, radius: float) -> None:
        self.center, self.radius, self.axes = center, radius, len(center)

    def beyond(self, places: Array) -> Array:
        return np.asarray(np.linalg.norm(places - self.center, axis=1) - self.radius)

    def __repr__(self) -> str:
        return f"Area.sphere({self.center.tolist()}, {self.radius:g})"


class _Polygon(Area):
    def __init__(self, corners: Array, low: float, high: float) -> None:
        self.corners, self.low, self.high, self.axes = corners, low, high, None

    def beyond(self, places: Array) -> Array:
        start, end = self.corners, np.roll(self.corners, -1, axis=0)
        edge, to = end - start, places[:, None, :2] - start
        length = np.maximum((edge**2).sum(axis=1), 1e-300)
        share = np.clip((to * edge).sum(axis=2) / length, 0.0, 1.0)
        distance = np.linalg.norm(to - share[:, :, None] * edge, axis=2).min(axis=1)
        below = start[:, 1] <= places[:, None, 1]
        crosses = below != (end[:, 1] <= places[:, None, 1])  # a ray along the first axis, edge by edge
        side = edge[:, 0] * to[:, :, 1] - edge[:, 1] * to[:, :, 0]
        inside = (crosses & ((side > 0.0) == below)).sum(axis=1) % 2 == 1
        found = np.where(inside, -distance, distance)
        if places.shape[1] > 2:
            found = np.maximum(found, np.maximum(self.low - places[:, 2], places[:, 2] - self.high))
        return np.asarray(found)

    def __repr__(self) -> str:
        heights = "" if np.isinf([self.low, self.high]).all() else f", {self.low:g}, {self.high:g}"
        return f"Area.polygon({self.corners.tolist()}{heights})"


@checked_fields
@dataclass(frozen=True, kw_only=True, repr=False)
class Limits:
    """What measurements, calls and robots must stay within; None for no limit.

    Each limit has an action. `error`: the call raises a `UsageError`, and nothing changes. `stop`: all robots
    come to rest, until `Controller.reset`. `drop`: a measurement that exceeds `speed` or `jump` is not used;
    a robot that exceeds `age`, `frozen` or `area` is out at once. A robot that is out comes to rest, and the
    others go on with what the law has for lost robots. A robot that has no usable measurement for longer than
    `age` is out.

    Attributes:
        age: Longest time since the measurement of a robot [s].
        speed: Largest speed of a robot [m/s].
        jump: Largest change of a position since the last measurement, beyond what `speed` allows [m].
        area: Where robots must stay.
        frozen: Longest time for which a sensor may repeat a measurement in every digit although the robot
            must move: its measured velocity is not 0, or its force above half of the limit [s].
        silence: Longest time between two calls of the controller [s].
        on_age: Action where a measurement is too old or missing.
        on_speed: Action where a robot is too fast.
        on_jump: Action where a position has changed too much.
        on_area: Action where a robot is outside.
        on_frozen: Action where a measurement repeats for too long.
        on_silence: Action where no call has come for too long, or time steps back.
        braking_time: Time in which stopping robots lose most of their speed where the force limit allows it
            [s].
        rejoin: Time for which a robot that was out must have usable measurements to be back, and time in
            which its command then grows to that of the law [s].
    """

    age: Positive | None = 0.1
    speed: Positive | None = None
    jump: Positive | None = None
    area: Area | None = None
    frozen: Positive | None = 0.5
    silence: Positive | None = 0.1
    on_age: Action = "drop"
    on_speed: Action = "stop"
    on_jump: Action = "stop"
    on_area: Action = "stop"
    on_frozen: Action = "drop"
    on_silence: TeamAction = "stop"
    braking_time: Positive = 0.2
    rejoin: NotNegative = 0.5

    def __post_init__(self) -> None:
        if type(self.area) is Area:
            raise argument_error("area", self.area, "Area.box, Area.sphere or Area.polygon")
        if self.jump is not None and self.speed is None:
            raise UsageError(
                "jump: found a limit without speed; expected both: robots move between measurements"
            )
        for name in ("speed", "jump"):
            if self.age is None and getattr(self, name) is not None and getattr(self, f"on_{name}") == "drop":
                raise UsageError(
                    f'on_{name}: found "drop" without a limit on age; expected both, or another action'
                )

    @property
    def drops(self) -> bool:
        """Whether robots may be out while others go on."""
        return any(
            getattr(self, name) is not None and getattr(self, f"on_{name}") == "drop"
            for name in ("age", "speed", "jump", "area", "frozen")
        )

    def __repr__(self) -> str:
        usual = type(self).__dataclass_fields__
        changed = {name: value for name, value in vars(self).items() if value != usual[name].default}
        return f"Limits({', '.join(f'{name}={value!r}' for name, value in changed.items())})"


class Event(NamedTuple):
    """Something that a controller did by itself.

    Attributes:
        time: When [s].
        robot: Number of the robot, from 1; 0 for all.
        cause: The limit: `age`, `speed`, `jump`, `area`, `frozen` or `silence`; `law` for an error of the
            law, `user` for a call of `stop` or `reset`.
        action: `ignored`: the measurement was not used; `out`, `back`; `stop`, `reset`.
        message: The same in one sentence, with what was found and what is allowed.
    """

    time: float
    robot: int
    cause: str
    action: str
    message: str

    def __str__(self) -> str:
        return f"{self.time:g} s: {self.message}"
