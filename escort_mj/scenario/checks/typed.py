"""What the types of keys say of their values, in whatever table they stand, plugins' too."""

from __future__ import annotations

import types
from collections.abc import Iterable, Iterator, Sequence
from functools import cache, cached_property, lru_cache
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import numpy as np
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from escort_mj.components.parameters import FunctionOfTime, OfTime, Vector
from escort_mj.scenario.findings import Finding, Path
from escort_mj.scenario.mission import Mission
from escort_mj.scenario.schema.expressions import Expression, ExpressionError
from escort_mj.scenario.schema.fields import Component

FUNCTIONS = (tuple[Component, ...], tuple[OfTime, ...])
"""Types that have a function of time for each axis."""
PER_AXIS = (Vector, *FUNCTIONS)
"""Types that have something for each axis; with a length of their own they do not."""
IN_SPACE = 3  # axes
SAMPLES = 20_001
LARGEST = 1e6  # m, N: far beyond any mission, far below where MuJoCo gives up


def check_vectors(mission: Mission) -> Iterator[Finding]:
    """Every vector has one number per axis; those that are directions have some length."""
    axes = mission.scenario.axes
    for path, vector, kinds in _typed_in(mission):
        if not isinstance(vector, tuple | list):
            continue
        if len(vector) != axes:
            words = f"found {len(vector)} numbers; expected {axes}, as axes says"
            words += " (axes: 3 is space)" * (len(vector) == IN_SPACE > axes)
            yield Finding(path, words + ", or one number" * (float in kinds))
        elif path[-1] == "normal" and not any(vector):
            yield Finding(path, f"found {[*vector]}; expected a vector of some length")


def check_functions(mission: Mission) -> Iterator[Finding]:
    """Every function of time is one, and has finite values and derivatives through the whole run."""
    for path, value, kinds in _typed_in(mission):
        if OfTime in kinds and value not in _names(kinds):
            yield from check_function(path, value, mission.scenario.duration)
        elif any(kind in FUNCTIONS for kind in kinds):
            for axis, component in enumerate(value):
                yield from check_function((*path, axis), component, mission.scenario.duration)


def check_function(path: Path, value: float | str, duration: float) -> Iterator[Finding]:
    """A number or an expression in t is defined through a time [s]."""
    if words := _undefined(value, duration):
        yield Finding(path, words)


@lru_cache(maxsize=1024)  # the missions of a study share most of them
def _undefined(value: float | str, duration: float) -> str:
    """What is wrong with a function of time; empty if nothing is."""
    try:
        function = Expression(value)
    except ExpressionError as error:
        return str(error)
    t = np.linspace(0.0, duration, SAMPLES)
    for what, values in zip(("value", "time derivative"), function.evaluate(t), strict=True):
        wrong = np.flatnonzero(~np.isfinite(values))
        if len(wrong):
            return f"has no finite {what} at t = {t[wrong[0]]:g} s; expected one from 0 to {duration:g} s"
        large = np.flatnonzero(np.abs(values) > LARGEST)
        if len(large):
            at = large[0]
            return f"has the {what} {values[at]:.3g} at t = {t[at]:g} s; expected at most {LARGEST:g}"
    return ""


def _typed_in(mission: Mission) -> Iterator[tuple[Path, Any, Sequence[Any]]]:
    """Yield place, value and types of what has something for each axis, and of functions of time."""
    for path, table in mission.parts:
        if isinstance(table, BaseModel):
            for name, kinds in _kinds_of(type(table)).items():
                yield from _found(getattr(table, name), kinds, (*path, name))


class _Kinds:
    """The types that a value may have, and those of what is in it."""

    def __init__(self, kinds: Iterable[Any]) -> None:
        self.kinds = list(kinds)
        self.of_time, self.per_axis = OfTime in self.kinds, any(kind in PER_AXIS for kind in self.kinds)

    @cached_property
    def inner(self) -> _Kinds:
        others = (kind for kind in self.kinds if kind not in PER_AXIS)
        return _Kinds(one for kind in others for part in get_args(kind) for one in _plain(part))

    @cached_property
    def may_hold(self) -> bool:
        """Whether there can be something for each axis, or a function of time."""
        return self.per_axis or self.of_time or (bool(self.inner.kinds) and self.inner.may_hold)


@cache
def _kinds_of(table: type[BaseModel]) -> dict[str, _Kinds]:
    """The types of those fields of a table that may have something for each axis or a function of time."""
    every = {name: _Kinds(_alternatives(field)) for name, field in table.model_fields.items()}
    return {name: kinds for name, kinds in every.items() if kinds.may_hold}


def _found(value: Any, kinds: _Kinds, path: Path) -> Iterator[tuple[Path, Any, Sequence[Any]]]:
    """What a value of one of these types holds, but for tables, which hold it themselves."""
    if isinstance(value, tuple | list):
        if kinds.per_axis and not any(isinstance(each, tuple | list | BaseModel) for each in value):
            yield path, value, kinds.kinds
            return
        for place, each in enumerate(value):
            yield from _found(each, kinds.inner, (*path, place))
    elif kinds.of_time and value is not None and not isinstance(value, BaseModel):
        yield path, value, kinds.kinds


def _alternatives(field: FieldInfo) -> Iterator[Any]:
    """The types that a field may have."""
    if any(isinstance(one, FunctionOfTime) for one in field.metadata):
        yield OfTime
    elif field.annotation not in PER_AXIS or not field.metadata:
        yield from _plain(field.annotation)
    elif field.annotation in FUNCTIONS:
        yield tuple[OfTime]  # with a length of their own, one by one


def _names(kinds: Sequence[Any]) -> list[Any]:
    """The names that stand for themselves among the values of some types."""
    return [name for kind in kinds if get_origin(kind) is Literal for name in get_args(kind)]


def _plain(kind: Any) -> Iterator[Any]:
    """A type, or those that it joins, without what they are annotated with."""
    if kind in PER_AXIS or kind == OfTime:
        yield kind
    elif get_origin(kind) in (Union, types.UnionType):
        for part in get_args(kind):
            yield from _plain(part)
    elif get_origin(kind) is Annotated:
        inner, *about = get_args(kind)
        if any(isinstance(one, FunctionOfTime) for one in about):
            yield OfTime
        elif inner not in PER_AXIS or not any(isinstance(one, FieldInfo) for one in about):
            yield from _plain(inner)
    else:
        yield kind
