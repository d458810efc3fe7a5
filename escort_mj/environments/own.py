"""Observations and rewards of one's own, beside those that `senses` finds: each a class with one method.

    class Force(Observation):
        name, width, limit = "force", 2, 20.0

        def observe(self, now: Now) -> Array:
            return now["force"]

    class Calm(RewardTerm):
        name, weight = "calm", -0.1

        def reward(self, now: Now) -> Array:
            return np.square(now["force"]).mean(axis=-1)

One object serves all missions of an environment at once: what it is given has them as its first dimension.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Sequence
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from escort_mj.errors import UsageError
from escort_mj.scenario.arguments import Bound, Words, argument_error, number, shape_of, whole_number
from escort_mj.scenario.findings import did_you_mean
from escort_mj.signals import SIGNALS, columns

Array = NDArray[np.float64]

MOST_WIDE = 1000  # numbers per robot
BY_NAME = {signal.name: signal for signal in SIGNALS}


class Now:
    """What is known of N missions, each at its last sample: `now["q"]` are positions, shape (N, n, p)."""

    def __init__(self, samples: Array, sizes: dict[str, int], commanded: Array) -> None:
        """Look at samples.

        Args:
            samples: One of each mission, shape (N, record_size).
            sizes: Of the dimensions of signals.
            commanded: Shape (N, n, p).
        """
        self._samples, self._sizes, self._commanded = samples, sizes, commanded

    def __getitem__(self, name: str) -> Array:
        """Return a copy of a signal of all missions: N rows, each with its dimensions without time.

        Raises:
            UsageError: If there is none of that name, or this mission does not record it.
        """
        if not isinstance(name, str) or name not in BY_NAME:
            raise UsageError(f"now: found the signal {name!r}{did_you_mean(str(name), BY_NAME)}")
        signal = BY_NAME[name]
        if not signal.recorded(self._sizes) or not {*signal.dims} <= self._sizes.keys():
            raise UsageError(f"now: {name}: this mission does not record it")
        shape = [self._sizes[dim] for dim in signal.dims]
        return self._samples[:, columns(name, self._sizes)].reshape(len(self._samples), *shape).copy()

    @property
    def time(self) -> Array:
        """Simulated time, shape (N,) [s]."""
        return self._samples[:, 0].copy()

    @property
    def commanded(self) -> Array:
        """What led here, shape (N, n, p), from -1 to 1."""
        return self._commanded.copy()


class Part(ABC):
    """What observations and rewards of one's own share.

    Attributes:
        name: By which errors and infos call it.
    """

    name: ClassVar[str]


class Observation(Part):
    """Numbers that each robot observes beside the usual ones, after them.

    Attributes:
        width: How many.
        limit: Their largest size; learners get larger ones cut off.
    """

    width: ClassVar[int]
    limit: ClassVar[float] = np.inf

    @abstractmethod
    def observe(self, now: Now) -> ArrayLike:
        """Return what robots observe, shape (N, n, width); what is no number becomes 0."""


class RewardTerm(Part):
    """A number for each robot, which its reward contains times a weight.

    Attributes:
        weight: Of the number.
    """

    weight: ClassVar[float] = 1.0

    @abstractmethod
    def reward(self, now: Now) -> ArrayLike:
        """Return the numbers, shape (N, n)."""


WORDS = "objects of classes that derive from Observation or RewardTerm"
Parts = Annotated[Sequence[Part], Words(f"a list of {WORDS}")]


class Own:
    """What N missions with n robots have of one's own.

    Attributes:
        names: Of the terms of rewards.
        limits: Largest size of each number that a robot observes, shape (width,).
        observed: Shape (N, n, width).
        terms: Of the last rewards, with their weights, shape (N, n, terms).
    """

    def __init__(self, parts: Sequence[Part], shape: tuple[int, int]) -> None:
        """Prepare for missions.

        Args:
            parts: Observations and terms of rewards, which `described` has accepted.
            shape: N and n.
        """
        self._seen = [part for part in parts if isinstance(part, Observation)]
        self._rewarded = [part for part in parts if isinstance(part, RewardTerm)]
        self.names = [part.name for part in self._rewarded]
        self.limits = np.array([part.limit for part in self._seen for _ in range(part.width)], np.float32)
        self.observed: Array = np.zeros((*shape, len(self.limits)))
        self.terms: Array = np.zeros((*shape, len(self.names)))

    def __bool__(self) -> bool:
        return bool(self._seen or self._rewarded)

    def find(self, missions: Sequence[int], now: Now, broken: NDArray[np.bool_]) -> None:
        """Find what robots of missions observe and are rewarded for.

        Args:
            missions: Which ones, from 0; those of others stay.
            now: What is known of these.
            broken: Which of these have ended as they should not: there, a reward that is no number is 0.

        Raises:
            UsageError: If a part returns something else than it is to.
        """
        those, shape, start = list(missions), now.commanded.shape[:2], 0
        for part in self._seen:
            end = start + part.width
            self.observed[those, :, start:end] = _returned(part.observe(now), part, (*shape, part.width))
            start = end
        for place, term in enumerate(self._rewarded):
            found = term.weight * _returned(term.reward(now), term, shape)
            found[broken[:, None] & ~np.isfinite(found)] = 0.0
            if (wrong := found[~np.isfinite(found)]).size:
                raise UsageError(f"{term.name}: found {wrong[0]}; expected finite numbers")
            self.terms[those, :, place] = found


def described(parts: Sequence[Part], others: Collection[str]) -> list[tuple[str, int, bool]]:
    """Return what a snapshot must have in common with each part: name, width, and whether it rewards.

    Args:
        parts: Observations and terms of rewards.
        others: Names of other terms.

    Raises:
        UsageError: If one of them is something else, or says nonsense of itself.
    """
    names, found = list(others), []
    for place, part in enumerate(parts):
        where, name, wide = f"own[{place}]", getattr(part, "name", None), 0
        if not isinstance(part, Observation | RewardTerm):
            raise argument_error(where, part, WORDS)
        if not (isinstance(name, str) and name.isidentifier()):
            raise argument_error(f"{where}.name", name, "a name of letters, digits and _")
        if name in names:
            raise UsageError(f"{where}.name: found {name!r}, which another one has already")
        names.append(name)
        if isinstance(part, RewardTerm):
            number(part.weight, f"{name}.weight", "a finite number", Bound())
        if isinstance(part, Observation):
            allowed = f"a whole number from 1 to {MOST_WIDE}"
            wide = whole_number(getattr(part, "width", None), f"{name}.width", allowed, 1, MOST_WIDE)
            if shape_of(part.limit) or part.limit != np.inf:
                number(part.limit, f"{name}.limit", "a number above 0", Bound(0.0, above=True))
        found.append((name, wide, isinstance(part, RewardTerm)))
    return found


def _returned(found: ArrayLike, part: Part, shape: tuple[int, ...]) -> Array:
    """Return what a part returned as an array of a shape."""
    try:
        array = np.array(found)
    except ValueError:  # rows of several lengths
        array = np.array(None)
    if array.dtype.kind not in "biuf":
        raise argument_error(part.name, found, f"numbers, shape {shape}")
    if array.shape != shape:
        raise UsageError(f"{part.name}: found the shape {array.shape}; expected {shape}")
    return array.astype(float)
