"""Kinds of robots that plugins bring: what their methods do and return is looked at at each call."""

from __future__ import annotations

import functools
from collections.abc import Callable
from inspect import isfunction
from typing import Any, get_type_hints

from escort_mj import stopping
from escort_mj.errors import PluginError
from escort_mj.metrics.metric import number
from escort_mj.plugin_calls import place_of, step
from escort_mj.robots import RobotKind

MOST = 1000  # coordinates, motors


def guard(kind: type[RobotKind]) -> None:
    """Have whatever goes wrong in a kind's own methods become a `PluginError`, with file and line.

    Args:
        kind: A plugin's; its methods are replaced.
    """
    for name, function in list(vars(kind).items()):
        if isfunction(function) and hasattr(RobotKind, name) and not name.startswith("_"):
            setattr(kind, name, _guarded(name, function))


def _guarded(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
    wanted = get_type_hints(getattr(RobotKind, name)).get("return")
    first = True

    @functools.wraps(function)
    def called(kind: RobotKind, *arguments: Any, **more: Any) -> Any:
        nonlocal first
        try:
            returned = step(function, first, lambda: function(kind, *arguments, **more))
            first = False
            return _checked(name, returned, wanted)
        except BaseException as error:
            if isinstance(error, PluginError) or (
                isinstance(error, KeyboardInterrupt) and stopping.is_users()
            ):
                raise
            raise PluginError(f"the kind {kind.kind}: {place_of(error, function)}") from error

    return called


def _checked(name: str, returned: Any, wanted: Any) -> Any:
    """What a method returned, if it is of the kind that its base returns.

    Raises:
        TypeError: If it is no number.
        ValueError: If it is no such number.
    """
    if wanted is int and (type(returned) is not int or not 0 <= returned <= MOST):
        raise TypeError(f"{name} returned {returned!r:.80}; expected a whole number from 0 to {MOST}")
    if wanted is float:
        number(returned, name, finite=True)
    return returned
