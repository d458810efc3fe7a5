"""Arguments of calls in Python: their kinds are checked here, by the annotations of the parameters.

`checked` compares the arguments of a call with the annotations of a function. Functions that are called in
every step, and those whose arguments have shapes of a mission, call `number`, `whole_number` and `numbers`.
"""

from __future__ import annotations

import functools
import inspect
import math
import operator
import os
import sys
import types
import typing
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from numbers import Integral, Real
from typing import Annotated, Any, ForwardRef, Literal, ParamSpec, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from escort_mj.errors import NO_PATH, UsageError, one_line
from escort_mj.scenario.findings import did_you_mean, shortened, shown, written

Array = NDArray[np.float64]
P = ParamSpec("P")
T = TypeVar("T")
MOST = 1e10  # m, m/s, N, kg, ...: beyond, doubles tell no micrometers apart, and squares of sums overflow
MANY = 10**7  # entries of a list that no argument has
FEW = 100  # numbers that Python adds faster than NumPy looks at them


@dataclass(frozen=True)
class Bound:
    """Bounds of a number, in an annotation; infinity is refused.

    Attributes:
        least: The least value.
        above: Whether the number must be above it.
        most: The largest value.
    """

    least: float = -math.inf
    above: bool = False
    most: float = sys.float_info.max

    def accepts(self, value: float) -> bool:
        """Whether a number is within the bounds; NaN is not."""
        enough = value > self.least if self.above else value >= self.least
        return enough and abs(value) <= self.most

    def __str__(self) -> str:
        if math.isinf(self.least):
            return " that is finite"
        most = f" and at most {self.most:g}" if self.most < sys.float_info.max else ""
        return (f" above {self.least:g}" if self.above else f" of at least {self.least:g}") + most


@dataclass(frozen=True)
class Words:
    """What an argument has to be, in words, in an annotation."""

    words: str


Count = Annotated[int, Bound(1, most=MANY)]
"""How many there are of something: at least one."""
SEEDS = "a whole number of at least 0"
Finite = Annotated[float, Bound()]
"""A finite number."""
NotNegative = Annotated[float, Bound(0.0)]
"""A finite number of at least 0."""
Positive = Annotated[float, Bound(0.0, above=True)]
"""A finite number above 0."""
Source = Annotated[
    str | os.PathLike[str] | Mapping[str, Any], Words("a file, the name of a shipped scenario, or a mapping")
]
"""What `load_scenario` accepts."""
StudySource = Annotated[
    str | os.PathLike[str] | Mapping[str, Any], Words("a file, the name of a shipped study, or a mapping")
]
"""What `sweep` accepts."""
Overrides = Annotated[
    str | Sequence[str | Mapping[str, Any]] | Mapping[str, Any],
    Words("values by key path, or texts key.path=value"),
]
"""Values to set in a scenario."""


@dataclass(frozen=True)
class Kind:
    """What an argument may be.

    Attributes:
        words: In words.
        accepts: Whether a value is of this kind.
    """

    words: str
    accepts: Callable[[Any], bool]


def argument_error(name: str, value: Any, expected: str) -> UsageError:
    """Return the error of an argument that is not what it must be."""
    if isinstance(value, np.ndarray) and value.ndim:
        words = f"an array of the shape {value.shape}"
    else:
        plain = written(value) if isinstance(value, list | tuple) else shown(value)
        words = "None" if value is None else shortened(one_line(plain), 80)
    return UsageError(f"{name}: found {words}; expected {expected}")


def number(value: Any, name: str, expected: str = "a number", bound: Bound = Bound()) -> float:  # noqa: B008
    """Return a finite number that was given as an argument.

    Args:
        value: As given.
        name: Of the argument.
        expected: In words, with the unit.
        bound: That it must be within.

    Raises:
        UsageError: If it is anything else: a text, a flag, a complex number, an array, NaN.
    """
    if not (_is_real(value) and bound.accepts(float(value))):
        raise argument_error(name, value, expected)
    return float(value)


def whole_number(
    value: Any, name: str, expected: str, least: int | None = None, most: int | None = None
) -> int:
    """Return a whole number that was given as an argument.

    Args:
        value: As given.
        name: Of the argument.
        expected: In words.
        least: The least that is allowed; None for any.
        most: The most that is allowed; None for any.

    Raises:
        UsageError: If it is anything else.
    """
    if not _is_whole(value):
        raise argument_error(name, value, expected)
    found = operator.index(value)
    if (least is not None and found < least) or (most is not None and found > most):
        raise argument_error(name, value, expected)
    return found


def numbers(
    value: ArrayLike, name: str, shape: tuple[int, ...], what: str, *, unknown: bool = False
) -> Array:
    """Return a copy of what was given as an array of real numbers within -MOST and MOST.

    Args:
        value: As given.
        name: Of the argument.
        shape: That it must have.
        what: The numbers in words, with their unit.
        unknown: Whether numbers may be missing: NaN, beyond MOST or masked; they are NaN in the result.

    Raises:
        UsageError: If it is anything else: other shapes, texts, flags, complex numbers, masked or missing
            ones.
    """
    if type(value) is np.ndarray and value.dtype.char == "d" and value.shape == shape and _is_within(value):
        return value.copy()  # at once what a control loop gives
    found = _real_array(value)
    if found is None:
        raise UsageError(f"{name}: found {_kind_of_array(value)}; expected {what}, shape {shape}")
    if found.shape != shape:
        raise UsageError(f"{name}: found the shape {found.shape}; expected {what}, shape {shape}")
    if np.ma.isMaskedArray(value) and np.ma.getmaskarray(value).any():
        if not unknown:
            raise UsageError(f"{name}: found masked numbers; expected {what}, shape {shape}")
        found[np.ma.getmaskarray(value)] = np.nan
    if not _is_within(found):
        beyond = ~(np.abs(found) <= MOST)
        if unknown:
            found[beyond] = np.nan
        elif beyond.any():
            place = [int(index) for index in np.argwhere(beyond)[0]]
            wrong = found[tuple(place)]
            allowed = f"between {-MOST:g} and {MOST:g}" if np.isfinite(wrong) else "finite"
            raise UsageError(f"{name}: found {wrong} at {place}; every number must be {allowed}")
    return found


def _is_within(array: Array) -> bool:
    """Whether all numbers are surely within -MOST and MOST; one product tells."""
    return bool(np.vdot(array, array) <= MOST * MOST)


def is_finite(array: Array) -> bool:
    """Whether all numbers of an array are finite; for small arrays, faster than NumPy alone."""
    if array.size <= FEW and math.isfinite(sum(array.ravel().tolist())):
        return True
    return bool(np.isfinite(array).all())


def checked(function: Callable[P, T]) -> Callable[P, T]:
    """Let a function refuse arguments that its annotations do not allow, with a `UsageError`.

    Names that only type checkers import cannot be checked: import what parameters are annotated with.
    """
    signature = inspect.signature(function)
    name = function.__qualname__.removesuffix(".__init__")

    @functools.cache
    def kinds() -> dict[str, Kind]:
        scope = function.__globals__
        return {
            each.name: kind_of(each.annotation, scope)
            for each in signature.parameters.values()
            if each.annotation is not each.empty and each.kind not in (each.VAR_POSITIONAL, each.VAR_KEYWORD)
        }

    @functools.wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> T:
        __tracebackhide__ = True
        try:
            given = signature.bind(*args, **kwargs).arguments
        except TypeError as error:
            unknown = [key for key in kwargs if key not in signature.parameters]
            hint = did_you_mean(unknown[0], signature.parameters) if unknown else ""
            raise UsageError(f"{name}: {error}{hint}") from None
        for argument, kind in kinds().items():
            if argument in given and not kind.accepts(given[argument]):
                raise argument_error(argument, given[argument], kind.words)
        try:
            return function(*args, **kwargs)
        except OSError as error:
            if error.errno not in NO_PATH:
                raise
            raise UsageError(f"{shortened(str(error.filename))}: {error.strerror}") from None

    return call


def checked_fields(record: type[T]) -> type[T]:
    """Let a data class refuse fields that their annotations do not allow, see `checked`."""
    setattr(record, "__init__", checked(record.__init__))  # noqa: B010  # mypy lets nobody assign it
    return record


def kind_of(annotation: Any, scope: dict[str, Any] | None = None) -> Kind:
    """Return what an annotation allows.

    Args:
        annotation: A type, or its text.
        scope: Names that the text uses.
    """
    if isinstance(annotation, str):
        holder = types.SimpleNamespace(__annotations__={"it": annotation})
        annotation = typing.get_type_hints(holder, scope, include_extras=True)["it"]
    if annotation in (Any, ArrayLike) or isinstance(annotation, TypeVar | ForwardRef):
        return Kind("anything", lambda value: True)
    origin, parts = typing.get_origin(annotation), typing.get_args(annotation)
    if origin is Annotated:
        return _annotated(parts)
    if origin in (typing.Union, types.UnionType):
        options = [kind_of(part) for part in parts]
        words = ", ".join(each.words for each in options[:-1]) + " or " + options[-1].words
        is_path = any(typing.get_origin(part) is os.PathLike for part in parts)
        return Kind(
            words.replace("a text", "a text that is not empty") if is_path else words,
            lambda value: (
                not (is_path and isinstance(value, str) and not value)
                and any(each.accepts(value) for each in options)
            ),
        )
    if origin is Literal:
        words = " or ".join(filter(None, (", ".join(map(str, parts[:-1])), str(parts[-1]))))
        return Kind(words, lambda value: isinstance(value, str) and value in parts)
    if origin is tuple:
        inner = [kind_of(part) for part in parts]
        return Kind(
            f"{len(inner)} of: {inner[0].words}",
            lambda value: (
                _is_list(value)
                and len(value) == len(inner)
                and all(kind.accepts(each) for kind, each in zip(inner, value, strict=True))
            ),
        )
    if origin in (Sequence, list):
        one = kind_of(parts[0])
        return Kind(
            f"a list of: {one.words}",
            lambda value: (
                _is_list(value)
                and not isinstance(value, np.ndarray)  # which is neither true nor false
                and all(map(one.accepts, value))
            ),
        )
    if origin is Iterable:
        item = kind_of(parts[0])
        return Kind(
            f"a list of: {item.words}",
            lambda value: (
                all(map(item.accepts, value))
                if _is_list(value)
                else isinstance(value, Iterable) and not isinstance(value, _NO_LISTS)
            ),
        )
    if origin is Mapping:
        key, inside = (kind_of(part) for part in parts)
        return Kind(
            f"a mapping from {key.words} to {inside.words}",
            lambda value: (
                isinstance(value, Mapping)
                and all(key.accepts(each) for each in value)
                and all(inside.accepts(each) for each in value.values())
            ),
        )
    if origin in _CONTAINERS:
        return _CONTAINERS[origin]
    return _PLAIN.get(annotation) or Kind(
        f"{_article(annotation.__name__)} {annotation.__name__}", lambda value: isinstance(value, annotation)
    )


def _annotated(parts: Sequence[Any]) -> Kind:
    """Return what an annotation with bounds or words allows."""
    kind = kind_of(parts[0])
    for extra in parts[1:]:
        if isinstance(extra, Words):
            kind = Kind(extra.words, kind.accepts)
        elif isinstance(extra, Bound):
            kind = Kind(kind.words + str(extra), _both(kind.accepts, extra.accepts))
    return kind


def _both(one: Callable[[Any], bool], other: Callable[[Any], bool]) -> Callable[[Any], bool]:
    return lambda value: one(value) and other(value)


def _article(word: str) -> str:
    return "an" if word[0] in "AEIOU" else "a"


def _is_real(value: Any) -> bool:
    """Whether a value is one real number: no flag, no text, no array but one of no dimension; NaN is none."""
    if isinstance(value, np.ndarray) and value.ndim == 0 and value.dtype.kind in "fiu":
        value = value[()]
    if not isinstance(value, Real) or isinstance(value, bool | np.bool_):
        return False
    try:
        return not math.isnan(float(value))
    except OverflowError:
        return False


def _is_whole(value: Any) -> bool:
    return isinstance(value, Integral) and not isinstance(value, bool)


def _is_list(value: Any) -> bool:
    if isinstance(value, np.ndarray):
        return value.ndim > 0
    return isinstance(value, Sequence) and not isinstance(value, str | bytes)


def _is_path(value: Any) -> bool:
    name = os.fspath(value) if hasattr(value, "__fspath__") else value
    return isinstance(name, str) and "\0" not in name


_NO_LISTS = (str, bytes, np.ndarray, Mapping, set, frozenset)  # of sets, each run has an order of its own
_PLAIN: dict[Any, Kind] = {
    type(None): Kind("None", lambda value: value is None),
    bool: Kind("True or False", lambda value: isinstance(value, bool | np.bool_)),
    int: Kind("a whole number", _is_whole),
    float: Kind("a number", _is_real),
    str: Kind("a text", lambda value: isinstance(value, str) and "\0" not in value),
}
_CONTAINERS: dict[Any, Kind] = {
    os.PathLike: Kind("a path", lambda value: not isinstance(value, str) and _is_path(value)),
    Callable: Kind("a function", callable),
    type: Kind("a class", lambda value: isinstance(value, type)),
}


def shape_of(value: Any) -> tuple[int, ...]:
    """Return the shape of an argument; of what is no array, nothing, and of what is too long, its length."""
    if _is_too_long(value):
        return (len(value),)
    try:
        return np.shape(value)
    except Exception:  # rows of several lengths, or what it raises when it is asked for an array
        return ()


def _is_too_long(value: Any) -> bool:
    """Whether it has more entries than any argument, such as a range, which would fill the memory."""
    return isinstance(value, Sequence) and len(value) > MANY


def _real_array(value: ArrayLike) -> Array | None:
    """Return a copy of real numbers as an array of float64; None for anything else."""
    try:
        if _is_too_long(value):
            return None
        raw = np.asarray(value)
        if raw.dtype.kind == "O" and all(map(_is_number, raw.ravel())):
            return raw.astype(float)
        return np.array(raw, dtype=float) if raw.dtype.kind in "fiu" else None
    except Exception:  # what it raises when it is asked for an array, too
        return None


def _is_number(value: Any) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool | np.bool_)


def _kind_of_array(value: Any) -> str:
    """What was found in place of real numbers, in words."""
    dtype = getattr(value, "dtype", None)
    kinds = {"c": "complex numbers", "b": "flags", "U": "texts", "S": "texts"}
    if dtype is not None and dtype.kind in kinds:
        return kinds[dtype.kind]
    return "None" if value is None else shortened(one_line(shown(value)), 80)
