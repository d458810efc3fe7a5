"""Arguments of environments, checked before anything is built."""

from __future__ import annotations

import operator
from typing import Any, TypeVar, get_args

from escort_mj.environments.rivals import RivalReward
from escort_mj.environments.senses import Command, Reward
from escort_mj.errors import UsageError
from escort_mj.scenario.findings import shortened

Weights = TypeVar("Weights", Reward, RivalReward)


def checked_count(name: str, value: Any) -> int:
    """Return how many there are to be of something.

    Raises:
        UsageError: If it is no whole number of at least 1.
    """
    try:
        number = operator.index(value)
    except TypeError:
        number = 0
    if number < 1:
        raise argument_error(name, value, "a whole number of at least 1")
    return number


def checked_command(value: Any) -> Command:
    """Return what is commanded.

    Raises:
        UsageError: If it is neither velocities nor forces.
    """
    known: tuple[Command, ...] = get_args(Command)
    for name in known:
        if isinstance(value, str) and value == name:
            return name
    raise argument_error("command", value, " or ".join(known))


def checked_weights(name: str, value: Any, kind: type[Weights]) -> Weights:
    """Return weights of what is asked, those that are usual for None.

    Raises:
        UsageError: If they are of another kind.
    """
    if value is None:
        return kind()
    if not isinstance(value, kind):
        raise argument_error(name, value, f"None or {kind.__name__}(...)")
    return value


def checked_size(value: Any) -> tuple[int, int]:
    """Return width and height of pictures [pixel].

    Raises:
        UsageError: If it is not two whole numbers of at least 1.
    """
    try:
        width, height = map(operator.index, value)
    except (TypeError, ValueError):
        width = height = 0
    if min(width, height) < 1:
        raise argument_error("size", value, "width and height in pixels, such as (640, 360)")
    return width, height


def argument_error(name: str, value: Any, expected: str) -> UsageError:
    """Return the error of an argument that is not what it must be."""
    return UsageError(f"{name} is {shortened(repr(value), 80)}; expected {expected}")
