"""Methods of plugins that set-up calls: what they do and return is looked at at each call."""

from __future__ import annotations

import functools
from collections.abc import Callable
from inspect import isfunction
from typing import Any, get_type_hints

from escort_mj import stopping
from escort_mj.behaviors.behavior import Avoidance, Behavior
from escort_mj.errors import PluginError
from escort_mj.metrics.metric import number
from escort_mj.plugin_calls import place_of, step
from escort_mj.robots import RobotKind

MOST = 1000  # coordinates, motors


def guard(member: type[RobotKind | Behavior]) -> None:
    """Have whatever goes wrong in a member's own methods become a `PluginError`, with file and line.

    Args:
        member: A plugin's; its methods are replaced: of a kind of robot all that its base has, of a behavior
            what says how it avoids bodies.
    """
    for name, function in list(vars(member).items()):
        known = hasattr(RobotKind, name) if issubclass(member, RobotKind) else name == "avoidance"
        if isfunction(function) and known and not name.startswith("_"):
            setattr(member, name, _guarded(member, name, function))


def _guarded(member: type[Any], name: str, function: Callable[..., Any]) -> Callable[..., Any]:
    base, key = (RobotKind, "kind") if issubclass(member, RobotKind) else (Behavior, "behavior")
    wanted = get_type_hints(getattr(base, name)).get("return")
    first = True

    @functools.wraps(function)
    def called(own: Any, *arguments: Any, **more: Any) -> Any:
        nonlocal first
        try:
            returned = step(function, first, lambda: function(own, *arguments, **more))
            first = False
            return _checked(name, returned, wanted)
        except BaseException as error:
            if isinstance(error, PluginError) or (
                isinstance(error, KeyboardInterrupt) and stopping.is_users()
            ):
                raise
            raise PluginError(f"the {key} {getattr(own, key)}: {place_of(error, function)}") from error

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
    if name == "avoidance" and returned is not None:
        if not isinstance(returned, Avoidance):
            raise TypeError(f"{name} returned {returned!r:.80}; expected an Avoidance, or None")
        for part, value in returned._asdict().items():
            if number(value, part, finite=True) < 0.0:
                raise ValueError(f"{name} returned {part}={value!r:.80}; expected 0 or more")
    return returned
