"""A log of real robots: what it tells of each body over time, and what is wrong with that."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

POSITION, VELOCITY, FORCE, REFERENCE = "position", "velocity", "force", "reference_velocity"
GAP, GAP_STAMPS = 0.5, 5.0  # a gap is longer than this [s] and than so many usual steps between two stamps


@dataclass(frozen=True)
class Track:
    """What a log tells of one body.

    Attributes:
        name: `robot_1` ..., `target`, or that of an obstacle that moves.
        source: Where in the log it stands: columns or a topic.
        time: Time stamps, shape (k,) [s].
        values: `position` [m], and where logged `velocity` [m/s], `force` [N] and `reference_velocity` [m/s],
            each of shape (k, p).
    """

    name: str
    source: str
    time: Array
    values: Mapping[str, Array]

    def faults(self) -> Iterator[str]:
        """What is wrong with it by itself."""
        if len(self.time) < 2:
            yield f"{self._place}: {len(self.time)} complete rows; expected at least 2"
            return
        if not np.isfinite(self.time).all():
            yield f"{self._place}: a time stamp is not a finite number"
            return
        steps = np.diff(self.time)
        if (steps <= 0.0).any():
            first = int(np.argmax(steps <= 0.0))
            stamps = f"{self.time[first + 1]:.10g} s follows {self.time[first]:.10g} s"
            yield f"{self._place}: time is not ascending: {stamps}"
            return
        usual = float(np.median(steps))
        wide = np.flatnonzero(steps > max(GAP, GAP_STAMPS * usual))
        if len(wide):
            worst = int(wide[np.argmax(steps[wide])])
            words = f"from {self.time[worst]:.10g} s to {self.time[worst + 1]:.10g} s"
            count = f"{len(wide)} gaps, the longest" if len(wide) > 1 else "a gap"
            yield f"{self._place}: {count} {words} without a position; usual are {usual:.3g} s between two"
        for name, values in self.values.items():
            if not np.isfinite(values).all():
                row = int(np.argmax(~np.isfinite(values).all(axis=1)))
                yield f"{self._place}: {name} is not a finite number at {self.time[row]:.10g} s"
        if VELOCITY in self.values and not (steps <= 0.0).any():
            yield from self._velocity_faults()

    def _velocity_faults(self) -> Iterator[str]:
        """Velocities of another unit than the positions."""
        given, found = self.values[VELOCITY], differentiated(self.time, self.values[POSITION])
        told, seen = (float(np.median(np.linalg.norm(each, axis=1))) for each in (given, found))
        if min(told, seen) > 1e-3 and not 0.1 < told / seen < 10.0:
            speeds = f"{told:.3g} m/s as logged, {seen:.3g} m/s by its positions"
            yield f"{self._place}: the median speed is {speeds}; positions are in m, velocities in m/s"

    @property
    def _place(self) -> str:
        return self.name if self.source == self.name else f"{self.name} ({self.source})"


@dataclass(frozen=True)
class Log:
    """All that a log tells.

    Attributes:
        path: Its file or folder.
        tracks: Of each body that it knows, by name.
        signals: Further recorded signals, by name: time stamps (k,) and values of the signal's shape.
        ignored: Columns or topics of which nothing was read.
        faults: What was wrong while it was read.
    """

    path: Path
    tracks: dict[str, Track]
    signals: dict[str, tuple[Array, Array]] = field(default_factory=dict)
    ignored: tuple[str, ...] = ()
    faults: tuple[str, ...] = ()


@dataclass(frozen=True)
class Wanted:
    """What is looked for in a log.

    Attributes:
        robots: Names of the robots, all of which must be there.
        axes: Names of the mission's axes.
        moving: Names of the obstacles that move.
        names: What bodies are called in the log, where that is told: columns' first part, or a topic.
    """

    robots: tuple[str, ...]
    axes: tuple[str, ...]
    moving: tuple[str, ...] = ()
    names: Mapping[str, str] = field(default_factory=dict)

    @property
    def bodies(self) -> tuple[str, ...]:
        """The robots, the target, and obstacles that move."""
        return (*self.robots, "target", *self.moving)


def differentiated(time: Array, values: Array) -> Array:
    """Derivative by central differences of second order, also between uneven stamps; same shape."""
    return np.asarray(np.gradient(values, time, axis=0, edge_order=2 if len(time) > 2 else 1))
