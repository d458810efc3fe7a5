"""What the types of keys say of their values, in whatever table they stand, plugins' too."""

from __future__ import annotations

import types
from collections.abc import Iterator, Sequence
from functools import cache, lru_cache
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
    for path, vector, kinds in typed_in(mission.scenario):
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
    for path, value, kinds in typed_in(mission.scenario):
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


def typed_in(table: BaseModel, path: Path = ()) -> Iterator[tuple[Path, Any, Sequence[Any]]]:
    """Yield place, value and types of what has something for each axis, and of functions of time."""
    for name, kinds in _kinds_of(type(table)).items():
        yield from _found(getattr(table, name), kinds, (*path, name))


@cache
def _kinds_of(table: type[BaseModel]) -> dict[str, list[Any]]:
    """The types that each field of a table may have."""
    return {name: list(_alternatives(field)) for name, field in table.model_fields.items()}


def _found(value: Any, kinds: Sequence[Any], path: Path) -> Iterator[tuple[Path, Any, Sequence[Any]]]:
    """What a value of one of these types holds."""
    if isinstance(value, BaseModel):
        yield from typed_in(value, path)
    elif isinstance(value, tuple | list):
        nested = any(isinstance(each, tuple | list | BaseModel) for each in value)
        if not nested and any(kind in PER_AXIS for kind in kinds):
            yield path, value, kinds
            return
        inner = [
            one for kind in kinds if kind not in PER_AXIS for part in get_args(kind) for one in _plain(part)
        ]
        for place, each in enumerate(value):
            yield from _found(each, inner, (*path, place))
    elif value is not None and OfTime in kinds:
        yield path, value, kinds


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
