"""The vectors of a scenario, found by their types: whatever table they stand in, plugins' too."""

from __future__ import annotations

import types
from collections.abc import Iterator, Sequence
from functools import cache
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from escort_mj.components.parameters import Vector
from escort_mj.scenario.findings import Finding, Path
from escort_mj.scenario.mission import Mission
from escort_mj.scenario.schema.fields import Component

PER_AXIS = (Vector, tuple[Component, ...], tuple[float | str, ...])
"""Types that have a number, or an expression, for each axis; with a length of their own they do not."""


def check_vectors(mission: Mission) -> Iterator[Finding]:
    """Every vector has one number per axis; those that are directions have some length."""
    axes = mission.scenario.axes
    for path, vector, alone in vectors_of(mission.scenario):
        if len(vector) != axes:
            words = f"found {len(vector)} numbers; expected {axes}, as axes says"
            yield Finding(path, words + ", or one number" * alone)
        elif path[-1] == "normal" and not any(vector):
            yield Finding(path, f"found {[*vector]}; expected a vector of some length")


def vectors_of(table: BaseModel, path: Path = ()) -> Iterator[tuple[Path, Sequence[Any], bool]]:
    """Yield the place and the numbers of each vector of a table, and whether one number would do, too."""
    for name, kinds in _kinds_of(type(table)).items():
        yield from _found(getattr(table, name), kinds, (*path, name))


@cache
def _kinds_of(table: type[BaseModel]) -> dict[str, list[Any]]:
    """The types that each field of a table may have."""
    return {name: list(_alternatives(field)) for name, field in table.model_fields.items()}


def _found(value: Any, kinds: list[Any], path: Path) -> Iterator[tuple[Path, Sequence[Any], bool]]:
    """What a value of one of these types holds."""
    if isinstance(value, BaseModel):
        yield from vectors_of(value, path)
    elif isinstance(value, tuple | list):
        nested = any(isinstance(each, tuple | list | BaseModel) for each in value)
        if not nested and any(kind in PER_AXIS for kind in kinds):
            yield path, value, float in kinds
            return
        inner = [
            one for kind in kinds if kind not in PER_AXIS for part in get_args(kind) for one in _plain(part)
        ]
        for place, each in enumerate(value):
            yield from _found(each, inner, (*path, place))


def _alternatives(field: FieldInfo) -> Iterator[Any]:
    """The types that a field may have."""
    if field.annotation in PER_AXIS and field.metadata:
        return
    yield from _plain(field.annotation)


def _plain(kind: Any) -> Iterator[Any]:
    """A type, or those that it joins, without what they are annotated with."""
    if kind in PER_AXIS:
        yield kind
    elif get_origin(kind) in (Union, types.UnionType):
        for part in get_args(kind):
            yield from _plain(part)
    elif get_origin(kind) is Annotated:
        inner, *about = get_args(kind)
        if inner not in PER_AXIS or not any(isinstance(one, FieldInfo) for one in about):
            yield from _plain(inner)
    else:
        yield kind
