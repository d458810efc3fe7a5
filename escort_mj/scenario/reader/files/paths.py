"""The schema followed along a key path: which table or value stands there, and what it is by default."""

from __future__ import annotations

from typing import Any, NamedTuple, get_args, get_origin

from pydantic import BaseModel, Tag
from pydantic.fields import FieldInfo

from escort_mj.components.parameters import Member, description_of
from escort_mj.expectations.expectation import Expectation
from escort_mj.scenario.findings import Path
from escort_mj.scenario.schema.expectations import tag_of_kind
from escort_mj.scenario.schema.scenario import Scenario


class Location(NamedTuple):
    """A place in the schema.

    Attributes:
        path: The key path, as it stands in a file.
        annotation: Type of what stands there; None where the schema has nothing.
        holder: The table around it.
        field: The holder's field, if the path ends in one that the schema knows.
    """

    path: Path
    annotation: Any
    holder: type[BaseModel] | None
    field: FieldInfo | None

    @property
    def meaning(self) -> str:
        """Description of the field; empty where there is none."""
        return description_of(self.holder, str(self.path[-1])) if self.holder and self.field else ""


def locate(location: Path, root: type[BaseModel] = Scenario) -> Location:
    """Follow a key path, or the location of a pydantic error, which names union members on its way.

    Args:
        location: Keys and list indices.
        root: The table where they begin.
    """
    path: list[str | int] = []
    annotation: Any = root
    holder: type[BaseModel] | None = None
    field: FieldInfo | None = None
    for key in location:
        if (alternative := _alternative(annotation, key)) is not None:
            annotation = alternative
            continue
        tables = models(annotation)
        member = _member(tables, key)
        if member is not None and (len(tables) > 1 or key not in member.model_fields):
            annotation = member
            continue
        path.append(key)
        field = None
        if get_origin(annotation) is dict:
            annotation = get_args(annotation)[1]
        elif isinstance(key, int):
            annotation = _item(annotation)
        elif tables:
            holder = next((table for table in tables if key in table.model_fields), tables[0])
            field = holder.model_fields.get(key)
            annotation = field.annotation if field else None
        else:
            annotation = None
    return Location(tuple(path), annotation, holder, field)


def models(annotation: Any) -> list[type[BaseModel]]:
    """The tables that may stand where an annotation says; none for a list of tables."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    if get_origin(annotation) is tuple:
        return []
    return [model for arg in get_args(annotation) for model in models(arg)]


def tag_of(model: type[BaseModel]) -> tuple[str, str] | None:
    """The key that says which of several tables this one is, and the name that it says."""
    if issubclass(model, Member) and model.named_by and (name := model.own_name()):
        return model.named_by, name
    return None


def member_name(model: type[BaseModel]) -> str | None:
    """What a table is called among those that may stand in its place; None where it is the only one."""
    if issubclass(model, Expectation):
        return tag_of_kind(model.kind)
    tag = tag_of(model)
    return tag[1] if tag else None


def _alternative(annotation: Any, name: str | int) -> Any:
    """What a union has under a tag's name; None where it has nothing."""
    for part in get_args(annotation):
        if any(isinstance(mark, Tag) and mark.tag == name for mark in getattr(part, "__metadata__", ())):
            return get_args(part)[0]
        if (found := _alternative(part, name)) is not None:
            return found
    return None


def _member(tables: list[type[BaseModel]], name: str | int) -> type[BaseModel] | None:
    return next((table for table in tables if member_name(table) == name), None)


def _item(annotation: Any) -> Any:
    """What the items of a list are."""
    if get_origin(annotation) is tuple:
        return get_args(annotation)[0]
    return next((item for arg in get_args(annotation) if (item := _item(arg)) is not None), None)
