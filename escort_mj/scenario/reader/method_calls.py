"""Methods of plugins that set-up calls: what they do and return is looked at at each call."""

from __future__ import annotations

import functools
from collections.abc import Callable, Collection, Iterator
from inspect import isfunction
from typing import Any, get_args, get_type_hints

from escort_mj import stopping
from escort_mj.behaviors.behavior import Avoidance, Plane
from escort_mj.components.parameters import Member
from escort_mj.errors import PluginError
from escort_mj.metrics.metric import number
from escort_mj.plugin_calls import place_of, step

MOST = 1000  # coordinates, motors
NOT_NEGATIVE = ("period", "longest", "late", "deviation", "variance", "density")


def guard(member: type[Member], base: type[Any], left_out: Collection[str] = ()) -> None:
    """Have whatever goes wrong in a member's own methods become a `PluginError`, with file and line.

    Args:
        member: A plugin's; its methods and properties are replaced.
        base: The class that says which are called, and what they return.
        left_out: Methods that are guarded where the loop calls them.
    """
    for name, own in list(vars(member).items()):
        if name.startswith("_") or name in left_out or not hasattr(base, name):
            continue
        if isfunction(own):
            setattr(member, name, _guarded(member, name, own, getattr(base, name)))
        elif isinstance(own, property) and own.fget and isinstance(vars(base).get(name), property):
            setattr(member, name, property(_guarded(member, name, own.fget, vars(base)[name].fget)))


def _guarded(
    member: type[Member], name: str, function: Callable[..., Any], of_base: Callable[..., Any]
) -> Callable[..., Any]:
    key = member.named_by
    wanted = get_type_hints(of_base).get("return") if isfunction(of_base) else None
    first = True

    @functools.wraps(function)
    def called(own: Any, *arguments: Any, **more: Any) -> Any:
        nonlocal first
        try:
            returned = step(function, first, lambda: _whole(function(own, *arguments, **more)))
            first = False
            return _checked(name, returned, wanted)
        except BaseException as error:
            if isinstance(error, PluginError) or (
                isinstance(error, KeyboardInterrupt) and stopping.is_users()
            ):
                raise
            raise PluginError(f"the {key} {getattr(own, key)}: {place_of(error, function)}") from error

    return called


def _whole(returned: Any) -> Any:
    """What a method returned, or all that it yielded."""
    return [*returned] if isinstance(returned, Iterator) else returned


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
        if name in NOT_NEGATIVE and returned < 0.0:
            raise ValueError(f"{name} returned {returned!r:.80}; expected 0 or more")
    if name == "misfits":
        (kind,) = get_args(wanted)
        found: list[Any] = returned if isinstance(returned, list) else [returned]
        if wrong := [each for each in found if not isinstance(each, kind)]:
            raise TypeError(f"{name} yielded {wrong[0]!r:.80}; expected {kind.__name__}(words, ...)")
        return found
    if name == "avoidance" and returned is not None:
        if not isinstance(returned, Avoidance):
            raise TypeError(f"{name} returned {returned!r:.80}; expected an Avoidance, or None")
        for part, value in returned._asdict().items():
            if number(value, part, finite=True) < 0.0:
                raise ValueError(f"{name} returned {part}={value!r:.80}; expected 0 or more")
    if name == "border" and returned is not None:
        if not isinstance(returned, Plane):
            raise TypeError(f"{name} returned {returned!r:.80}; expected a Plane, or None")
        for part, vector in returned._asdict().items():
            for value in vector:
                number(value, part, finite=True)
        if not any(returned.normal):
            raise ValueError(f"{name} returned {returned!r:.80}; expected a normal that is not 0")
    return returned
