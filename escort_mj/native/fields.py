"""How a component declares what it keeps in flat memory: each field's shape, unit and meaning, once.

    class SightParameters(Fields):
        sight_dropout: Annotated[float, Value("1", "probability that nothing comes of a look")]

    class TriggerState(Fields):
        held_since: Annotated[Array, "n", Value("s", "time of the last update")]

A field is a number (float, int or bool) or an array of doubles. An extent of an array is a whole number, the
name of a dimension or a product of such, as in "n*p". What a run records has a `Recorded` in place of the
`Value`. Several such classes become one by inheritance: its fields are theirs, base after base.
"""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType
from typing import Annotated, Any, NamedTuple, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Extent = tuple[str | int, ...]
"""A product of dimensions' names and whole numbers."""


@dataclass(frozen=True)
class Value:
    """What the numbers of a field are.

    Attributes:
        unit: SI unit, `1` for none.
        meaning: In a few words.
    """

    unit: str
    meaning: str


@dataclass(frozen=True)
class Recorded(Value):
    """What the numbers of a field are that is recorded as a signal of the same name.

    Attributes:
        dtype: Of the signal in a trace.
    """

    dtype: str = "float64"


class Declared(NamedTuple):
    """One field as its class declares it.

    Attributes:
        kind: `float`, `int` or `bool` for a number, ndarray for an array of doubles.
        shape: Extent of each of an array's dimensions.
        value: Its unit and meaning; None where the class does not say.
    """

    kind: Any
    shape: tuple[Extent, ...]
    value: Value | None


SCALARS = (float, int, bool)  # else it is an array, whose type releases of NumPy name differently


class Fields:
    """Base of classes that declare fields, and of those composed of them; an instance has the values."""

    addresses = (0, 0)
    """Where a view of memory has its plan, and its arrays."""

    def __init__(self, **values: Any) -> None:
        self.__dict__.update(values)

    @classmethod
    def packed(cls, setup: Any) -> dict[str, Any]:
        """Return the values of those fields that a mission's setup tells; none by default.

        A component, or one in a list, stands for the place where its parameters begin.

        Args:
            setup: Everything that the controller is given of the mission.
        """
        return {}


def declared(kind: type) -> dict[str, Declared]:
    """Return the fields that a class and its bases annotate, by name, the first base's first.

    Raises:
        TypeError: If two of them declare a field of the same name.
    """
    found: dict[str, Declared] = {}
    for owner in kind.__mro__:
        for name, field in _own(owner).items():
            if name in found:
                raise TypeError(f"{owner.__name__}.{name}: {kind.__name__} has a field of that name already")
            found[name] = field
    return found


@cache
def _own(owner: type) -> Mapping[str, Declared]:
    """Return the fields that a class itself annotates."""
    if issubclass(owner, tuple):  # a view: NamedTuple has references to types in place of their texts
        hints = get_type_hints(owner, include_extras=True)
    else:  # a sixth of the time
        hints = inspect.get_annotations(owner, locals={"Annotated": _Parts}, eval_str=True)
    return MappingProxyType({name: _declared(hint) for name, hint in hints.items()})


class _Parts:
    """Stands for `Annotated` where annotations are read: a tuple of its parts is made sooner."""

    def __class_getitem__(cls, parts: tuple[Any, ...]) -> tuple[Any, ...]:
        return parts


def _declared(hint: Any) -> Declared:
    """Return a field from its annotation, or from the parts of one."""
    parts = get_args(hint) if get_origin(hint) is Annotated else hint
    if not isinstance(parts, tuple):
        return Declared(parts, (), None)
    kind, *rest = parts
    value = rest.pop() if isinstance(rest[-1], Value) else None
    return Declared(kind if kind in SCALARS else np.ndarray, tuple(map(_extent, rest)), value)


def _extent(written: str | int) -> Extent:
    """Return the factors of an extent as it is written in an annotation."""
    parts = [part.strip() for part in str(written).split("*")]
    return tuple(int(part) if part.isdigit() else part for part in parts)
