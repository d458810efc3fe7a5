"""Moments of missions: whose they are, so that those of other missions are refused, and damaged ones."""

from __future__ import annotations

import json
import zlib
from collections.abc import Mapping, Sequence, Set
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from escort_mj.errors import UsageError
from escort_mj.scenario.arguments import argument_error
from escort_mj.scenario.schema.scenario import Scenario

MISSION, SUMS = "mission", "sums"  # what a snapshot is marked with: whose it is, and check sums of its fields
NUMBERS = ("q_d", "rho_hat", "v_d")  # whatever happens, these are numbers
WORDS = frozenset({"name", "description", "plugins", "video"})
"""Keys that change nothing of how a mission goes."""


class Uncopied:
    """What is in memory that machine code finds by its address: a copy would step the original's."""

    def __reduce__(self) -> NoReturn:
        words = "cannot be copied or pickled; make another, and `restore` there what `snapshot` returns here"
        raise UsageError(f"{type(self).__name__}: {words}")


class Snapshot(dict[str, Any]):
    """A moment of a mission, for `restore`: what it consists of by name, and the mark of the mission.

    That of a controller consists of arrays alone, for example for `numpy.savez`.
    """

    def check(self, mark: NDArray[np.uint32]) -> None:
        """Refuse a moment of another mission.

        Args:
            mark: Of the mission that is to come back to it.

        Raises:
            UsageError: If it is of another one.
        """
        if not np.array_equal(self.get(MISSION, ()), mark):
            raise UsageError(
                "snapshot: is that of another mission, or of one that was set up otherwise (start, commands, "
                "backend, limits); expected one of this mission"
            )


def mission_mark(scenario: Scenario, *more: object, left_out: Set[str] = WORDS) -> NDArray[np.uint32]:
    """Return a number that tells a mission from others, shape (1,).

    Args:
        scenario: The mission.
        more: What else a moment depends on.
        left_out: Keys of the scenario on which it does not depend.
    """
    keys = scenario.model_dump(mode="json", exclude=set(left_out))
    words = json.dumps(keys, sort_keys=True) + "".join(map(repr, more))
    return np.array([zlib.crc32(words.encode())], dtype=np.uint32)


def marked(arrays: dict[str, Any], mark: NDArray[np.uint32]) -> Snapshot:
    """Return arrays as a snapshot with its marks."""
    names = sorted(arrays)
    sums = np.array([_sum(arrays[name]) for name in names], dtype=np.uint32)
    return Snapshot(arrays, mission=mark, sums=sums)


def checked_arrays(saved: Any, mark: NDArray[np.uint32], left_out: Sequence[str] = ()) -> dict[str, Any]:
    """Return the arrays of a snapshot, also of one that was saved to a file.

    Args:
        saved: As given.
        mark: Of the mission that is to come back to it.
        left_out: Fields that were added to the marked arrays.

    Raises:
        UsageError: If it is anything else, of another mission, or has been changed.
    """
    if not isinstance(saved, Mapping):
        raise argument_error("snapshot", saved, "a mapping, as `snapshot` returned it")
    if MISSION not in saved:
        raise UsageError("snapshot: found no marks (mission, sums); expected what `snapshot` returned")
    Snapshot(mission=saved[MISSION]).check(mark)
    arrays = {str(name): value for name, value in saved.items() if name not in (MISSION, SUMS, *left_out)}
    names, sums = sorted(arrays), np.asarray(saved.get(SUMS, ()))
    if sums.shape != (len(names),):
        raise UsageError(
            f"snapshot: found {len(names)} fields, {sums.size} were saved; expected what `snapshot` returned"
        )
    for name, found in zip(names, sums.tolist(), strict=True):
        if _sum(arrays[name]) != found:
            raise UsageError(
                f"snapshot: {name} has been changed or damaged; expected what `snapshot` returned"
            )
    for name in NUMBERS:
        if name in arrays and not np.isfinite(arrays[name]).all():
            raise UsageError(f"snapshot: {name} contains NaN or infinity; it cannot be continued")
    return arrays


def _sum(value: Any) -> int:
    """Check sum of an array: its kind, shape and numbers."""
    array = np.asarray(value)
    return zlib.crc32(array.tobytes(), zlib.crc32(f"{array.dtype.str}{array.shape}".encode()))
