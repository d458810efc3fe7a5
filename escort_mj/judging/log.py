"""A log of real robots: what it tells of each body over time, and what is wrong with that."""

from __future__ import annotations

import itertools
import math
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

POSITION, VELOCITY, FORCE, REFERENCE = "position", "velocity", "force", "reference_velocity"
MOST = 1e30  # of a number in SI units: larger ones are none of a mission
GAP, GAP_STAMPS = 0.5, 5.0  # a gap is longer than this [s] and than so many usual steps between two stamps


class Gap(NamedTuple):
    """A stretch of time between two time stamps for which a log has no positions.

    Attributes:
        start: Last time stamp before it [s].
        end: First time stamp after it [s].
        bodies: Which bodies are not logged there.
    """

    start: float
    end: float
    bodies: tuple[str, ...]


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
        if not (finite := np.isfinite(self.time)).all():
            yield f"{self._place}: time stamp {np.argmin(finite) + 1} is not a finite number"
            return
        if not self.ascends:
            steps = np.diff(self.time)
            first = int(np.argmax(steps <= 0.0))
            stamps = f"{self.time[first + 1]:.16g} s follows {self.time[first]:.16g} s"
            yield f"{self._place}: time is not ascending: {stamps}"
            return
        for name, values in self.values.items():
            if words := unsound(self.time, values):
                yield f"{self._place}: {name} {words}"
        if VELOCITY in self.values and self.sound:
            yield from self._velocity_faults()

    @cached_property
    def ascends(self) -> bool:
        """Whether its time stamps are numbers, each larger than the one before."""
        return bool(np.isfinite(self.time).all() and (np.diff(self.time) > 0.0).all())

    @cached_property
    def sound(self) -> bool:
        """Whether all of its values are numbers of a mission."""
        return not any(unsound(self.time, values) for values in self.values.values())

    @cached_property
    def wide(self) -> NDArray[np.bool_]:
        """Whether each step between two time stamps is a gap: nothing is known in it, shape (k - 1,)."""
        steps = np.diff(self.time)
        return steps > max(GAP, GAP_STAMPS * float(np.median(steps))) if len(steps) else steps > 0.0

    @property
    def gaps(self) -> list[Gap]:
        """Its gaps, in order."""
        places = np.flatnonzero(self.wide)
        return [Gap(float(self.time[k]), float(self.time[k + 1]), (self.name,)) for k in places]

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

    @property
    def sum(self) -> int:
        """Check sum of all that it tells: another log has another one."""
        told = [[track.time, *track.values.values()] for track in self.tracks.values()]
        found = 0
        for array in itertools.chain(*told, *self.signals.values()):
            found = zlib.crc32(array.tobytes(), found)
        return found

    @property
    def gaps(self) -> list[Gap]:
        """Stretches of time for which some body has no position, in order, apart from each other."""
        found: list[Gap] = []
        for gap in sorted(gap for track in self.tracks.values() for gap in track.gaps):
            if found and gap.start < found[-1].end:
                last = found.pop()
                bodies = tuple(dict.fromkeys(last.bodies + gap.bodies))
                gap = Gap(last.start, max(last.end, gap.end), bodies)
            found.append(gap)
        return found


@dataclass(frozen=True)
class Wanted:
    """What is looked for in a log.

    Attributes:
        robots: Names of the robots, all of which must be there.
        axes: Names of the mission's axes.
        moving: Names of the obstacles that move.
        unforeseen: Names of the bodies of which nobody knows where they were, unless the log contains them.
        names: What bodies are called in the log, where that is told: columns' first part, or a topic.
    """

    robots: tuple[str, ...]
    axes: tuple[str, ...]
    moving: tuple[str, ...] = ()
    unforeseen: frozenset[str] = frozenset()
    names: Mapping[str, str] = field(default_factory=dict)

    @property
    def bodies(self) -> tuple[str, ...]:
        """The robots, the target, and obstacles that move."""
        return (*self.robots, "target", *self.moving)


def unsound(time: Array, values: Array) -> str:
    """Return what is wrong with the first value that cannot be one of a mission, in words; empty for none.

    Args:
        time: Time stamps, shape (k,) [s].
        values: Shape (k, ...).
    """
    wrong = ~(np.abs(values.reshape(len(values), values[:1].size)) <= MOST)
    if not wrong.any():
        return ""
    row, column = np.argwhere(wrong)[0]
    value, moment = float(values.reshape(len(values), -1)[row, column]), f"at {time[row]:.16g} s"
    if not math.isfinite(value):
        return f"is not a finite number {moment}"
    return f"is {value:.3g} {moment}; expected numbers between -{MOST:g} and {MOST:g}"


def differentiated(time: Array, values: Array) -> Array:
    """Derivative by central differences of second order, also between uneven stamps; same shape."""
    return np.asarray(np.gradient(values, time, axis=0, edge_order=2 if len(time) > 2 else 1))
