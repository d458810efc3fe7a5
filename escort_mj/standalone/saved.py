"""States of controllers that are saved and restored: marked so that damaged and foreign ones are refused."""

from __future__ import annotations

import json
import zlib
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from escort_mj.errors import UsageError
from escort_mj.scenario.arguments import argument_error
from escort_mj.scenario.schema.scenario import Scenario

MISSION, SUMS = "mission", "sums"  # what a state is marked with: whose it is, and check sums of its fields
NUMBERS = ("q_d", "rho_hat", "v_d")  # whatever happens, these are numbers
_IGNORED = {"name", "description", "plugins", "recording", "video", "expect"}


def mission_mark(scenario: Scenario, *more: object) -> NDArray[np.uint32]:
    """Return a number that tells the mission of a controller from others, shape (1,).

    Args:
        scenario: The mission; what the law does not depend on is left out.
        more: What else a state depends on.
    """
    keys = scenario.model_dump(mode="json", exclude=_IGNORED, warnings=False)
    words = json.dumps(keys, sort_keys=True) + "".join(map(repr, more))
    return np.array([zlib.crc32(words.encode())], dtype=np.uint32)


def marked(state: dict[str, Any], mission: NDArray[np.uint32]) -> dict[str, Any]:
    """Return a state with its marks."""
    names = sorted(state)
    return state | {MISSION: mission, SUMS: np.array([_sum(state[name]) for name in names], dtype=np.uint32)}


def checked_state(saved: Any, mission: NDArray[np.uint32], left_out: Sequence[str] = ()) -> dict[str, Any]:
    """Return a state that a controller of a mission has saved.

    Args:
        saved: As given.
        mission: The mark of the mission.
        left_out: Fields that were added to the marked state.

    Raises:
        UsageError: If it is anything else, of another mission, or has been changed.
    """
    if not isinstance(saved, Mapping):
        raise argument_error("state", saved, "a mapping, as `state` returned it")
    state = {str(name): value for name, value in saved.items() if name not in (MISSION, SUMS, *left_out)}
    if MISSION not in saved or SUMS not in saved:
        raise UsageError("state: found no marks (mission, sums); expected what `state` returned")
    if not np.array_equal(saved[MISSION], mission):
        raise UsageError(
            "state: is that of another mission, start, backend or limits; expected one of this controller"
        )
    names, sums = sorted(state), np.asarray(saved[SUMS])
    if sums.shape != (len(names),):
        raise UsageError(
            f"state: found {len(names)} fields, {sums.size} were saved; expected what `state` returned"
        )
    for name, found in zip(names, sums.tolist(), strict=True):
        if _sum(state[name]) != found:
            raise UsageError(f"state: {name} has been changed or damaged; expected what `state` returned")
    for name in NUMBERS:
        if name in state and not np.isfinite(state[name]).all():
            raise UsageError(f"state: {name} contains NaN or infinity; such a state cannot be continued")
    return state


def _sum(value: Any) -> int:
    """Check sum of an array: its kind, shape and numbers."""
    array = np.asarray(value)
    return zlib.crc32(array.tobytes(), zlib.crc32(f"{array.dtype.str}{array.shape}".encode()))
