"""Values of memory by name, for equations: of eight axes at once in kernels, of all axes in Python.

    r = axes_at(view, at)
    tau = r.rho_hat + gain * r.e

Compiled, `r` is nothing but addresses, and reading a name is one load. Interpreted, it is the same load.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from difflib import get_close_matches
from functools import cache
from math import prod
from typing import Any, NamedTuple

import numpy as np

from escort_mj.native.lanes import load, pick


class Names(NamedTuple):
    """By what names values are read.

    Attributes:
        fields: Name and field of the view: a number, one in a vector, or an array of axes.
        rows: Name, field, and the row of the field that has such an array, or a number.
        first: Field with the number of a first row, from which rows count; empty where they count from 0.
    """

    fields: tuple[tuple[str, str], ...]
    rows: tuple[tuple[str, str, int], ...] = ()
    first: str = ""

    @property
    def known(self) -> tuple[str, ...]:
        """All names."""
        return (*(name for name, _ in self.fields), *(name for name, *_ in self.rows))

    def first_row(self, view: Any) -> int:
        """Return the number of the first row."""
        return int(getattr(view, self.first)[0]) if self.first else 0


readers: list[tuple[Callable[..., Any], Names]] = []
"""Functions that return values, and the names by which these are read."""


numpy_forms: list[tuple[Callable[..., Any], int, Callable[..., Any]]] = []
"""Functions of NumPy, how many arguments they take, and what they are of eight numbers at once."""


class Values:
    """What equations read, by name: numbers, or arrays of numbers, that arithmetic takes all at once."""

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"{name} cannot be set: equations return their values")

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(name)


class Axes(Values):
    """Values of eight axes, of those of all robots in a row.

    Args:
        view: Memory with the fields.
        at: First of them, or their places.
        names: By what names values are read.
    """

    def __init__(self, view: Any, at: Any, names: Names) -> None:
        self.__dict__.update(_view=view, _at=at, _names=names)

    def __getattr__(self, name: str) -> Any:
        for known, field in self._names.fields:
            if known == name:
                return self._read(getattr(self._view, field), None)
        for known, field, row in self._names.rows:
            if known == name:
                return self._read(getattr(self._view, field), self._names.first_row(self._view) + row)
        raise AttributeError(unknown(name, self._names.known))

    def _read(self, value: Any, row: int | None) -> Any:
        if not isinstance(value, np.ndarray) or value.ndim == 1 and (row is not None or value.shape == (1,)):
            return float(value if np.ndim(value) == 0 else value[row or 0])
        first = 0 if row is None else row * prod(value.shape[1:])
        return load(value, first + self._at) if np.ndim(self._at) == 0 else pick(value, first + self._at)


class Arrays(Values):
    """The same values of all axes, as arrays with a row for each robot.

    Args:
        view: Memory with the fields; arrays are those of the view.
        names: By what names values are read.
    """

    def __init__(self, view: Any, names: Names) -> None:
        self.__dict__.update(_numbers={}, _names=names)
        for name, field in names.fields:
            value = getattr(view, field)
            if np.shape(value) == (1,):
                self._numbers[name] = value
            else:
                self.__dict__[name] = value
        for name, field, row in names.rows:
            self.__dict__[name] = getattr(view, field)[names.first_row(view) + row]

    def __getattr__(self, name: str) -> Any:
        if name in self._numbers:
            return float(self._numbers[name][0])
        raise AttributeError(unknown(name, self._names.known))


GIVEN = dict.fromkeys(("noise", "common_noise"), "draws: ClassVar[bool] = True")
GIVEN |= dict.fromkeys(("second_noise", "second_common_noise"), "draws: ClassVar[int] = 2")
GIVEN |= {"bias": "needs_model: ClassVar[bool] = True", "v_d_rate": "differentiates: ClassVar[bool] = True"}
GIVEN |= dict.fromkeys(("places", "mate"), "sees_others: ClassVar[bool] = True")
"""Names that only those components read that say so, and the line that does."""


def unknown(name: str, names: Iterable[str]) -> str:
    """Return what to say of a name that cannot be read, where only some names can."""
    if name in GIVEN:
        return f'"{name}" is given to what has the line {GIVEN[name]}'
    known = sorted(names)
    near = get_close_matches(name, known, 1)
    hint = f'; did you mean "{near[0]}"?' if near else ""
    return f'"{name}" is nothing that can be read here; expected one of {", ".join(known)}{hint}'


@cache
def reader_of(names: Names) -> Callable[[Any, Any], Any]:
    """Return a function that gives values of eight axes: of a view, and their first place or all places."""

    def axes_at(view: Any, at: Any) -> Any:
        return Axes(view, at, names)

    readers.append((axes_at, names))
    return axes_at


computed: list[tuple[Callable[..., Any], type, tuple[str, ...]]] = []
"""Functions that make values of a class, the class, and its parts."""


class Computed:
    """Values of annotated parts, and what properties compute of them: what equations are handed."""

    def __init__(self, *parts: Any) -> None:
        vars(self).update(zip(type(self).__annotations__, parts, strict=True))

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(unknown(name, names_of(type(self))))


def maker_of(kind: type[Computed]) -> Callable[..., Any]:
    """Return a function that makes values of a class, in kernels too, of its annotated parts in their order.

    There, properties and methods of the class are compiled as kernels are.

    Args:
        kind: The class.
    """

    def make(*parts: Any) -> Any:
        return kind(*parts)

    computed.append((make, kind, tuple(kind.__annotations__)))
    return make


def names_of(kind: type) -> list[str]:
    """Return what equations can read of values of a class: the names of its properties."""
    return [name for name, member in vars(kind).items() if isinstance(member, property)]


class _Withheld:
    """Stands in a class for a member of its base that cannot be read."""

    def __get__(self, owner: object, kind: type) -> None:
        raise AttributeError


def with_own(kind: type, owner: type, own: Mapping[str, property], withheld: Collection[str] = ()) -> Any:
    """Return a class whose values can be read by other names: its own members, and others.

    Args:
        kind: The class.
        owner: Whose the others are; kernels tell such classes by its name.
        own: The others.
        withheld: Names of members that cannot be read.
    """
    members = {name: member for name, member in vars(kind).items() if not name.startswith("_")}
    members |= dict.fromkeys(withheld, _Withheld())
    name = f"{kind.__name__} of {owner.__module__}.{owner.__qualname__} {getattr(owner, 'digest', '')}"
    return type(name, (kind,), {**members, **own, "__annotations__": kind.__annotations__})
