"""Scenarios written out: as complete YAML that reads back the same, and the format's JSON Schema."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

import numpy as np
from pydantic import BaseModel

from escort_mj.expectations import EXPECTATIONS
from escort_mj.laws.gains import LAWS_WITH_A_RULE
from escort_mj.scenario.kinds import NAME_KEYS
from escort_mj.scenario.reader.document import plain_scalar
from escort_mj.scenario.reader.files.paths import tag_of
from escort_mj.scenario.reader.gains import AUTO, KEY
from escort_mj.scenario.schema.scenario import Scenario

_FIRST = {*NAME_KEYS, *(kind.kind for kind in EXPECTATIONS)}  # keys that say what a table is
_PLAIN_WORD = re.compile(r"[A-Za-z_][A-Za-z0-9_]*\Z")


def dump_scenario(scenario: Scenario) -> str:
    """The whole scenario as YAML, defaults written out; `parse_scenario` reads the same scenario from it."""
    return "\n".join(_table(scenario.model_dump(), "")) + "\n"


def short_dump(scenario: Scenario) -> str:
    """The scenario as YAML, what is at its default left out; `parse_scenario` reads the same from it."""
    return "\n".join(_table(differing(scenario), "")) + "\n"


def differing(table: BaseModel) -> dict[str, Any]:
    """What a table has beside its defaults, as plain data: the same table can be read from it.

    Names that tell which of several tables it is stay, and so do the scenario's version, name and seed.
    """
    tag = tag_of(type(table))
    kept = {"version", "name", "seed"} if isinstance(table, Scenario) else {tag[0]} if tag else set()
    fields = type(table).model_fields
    return {
        name: _differing(value)
        for name, value in table
        if name in kept
        or fields[name].is_required()
        or value != fields[name].get_default(call_default_factory=True)
    }


def _differing(value: Any) -> Any:
    """The same for whatever a table holds."""
    if isinstance(value, BaseModel):
        return differing(value)
    return [_differing(item) for item in value] if isinstance(value, list | tuple) else value


def json_schema(kind: type[Scenario] = Scenario) -> dict[str, Any]:
    """The JSON Schema of scenario files, by which editors complete and check them.

    Args:
        kind: The type of scenarios, which plugins make (`catalog.scenario_type`).
    """
    schema = kind.model_json_schema()
    for table in schema["$defs"].values():
        if table.get("properties", {}).get("law", {}).get("const") in LAWS_WITH_A_RULE:
            words = "`auto`: gains that fit the robots are computed; those that are set here stay."
            table["properties"][KEY] = {"const": AUTO, "description": words}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **schema,
        "title": "escort_mj scenario, version 1",
    }


def flow(value: Any) -> str:
    """A value in one line of YAML; floats are written so that they read back exactly."""
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if isinstance(value, BaseModel):
        value = value.model_dump()
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return repr(value).replace("inf", ".inf").replace("nan", ".nan")
    if isinstance(value, str):
        return value if _PLAIN_WORD.match(value) and plain_scalar(value) == value else _quoted(value)
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_quoted(str(key))}: {flow(inner)}" for key, inner in value.items()) + "}"
    return "[" + ", ".join(map(flow, value)) + "]"


def _quoted(text: str) -> str:
    """Double-quoted as in JSON; what does not print is escaped."""
    return "".join(
        char if char.isprintable() else f"\\U{ord(char):08x}" for char in json.dumps(text, ensure_ascii=False)
    )


def _comes_later(entry: tuple[str, Any]) -> bool:
    """Whether an entry of a table is another than the one that says which table it is."""
    return entry[0] not in _FIRST or isinstance(entry[1], dict)


def _table(table: dict[str, Any], indent: str) -> Iterator[str]:
    for key, value in sorted(table.items(), key=_comes_later):
        if isinstance(value, dict) and value:
            yield f"{indent}{key}:"
            yield from _table(value, indent + "  ")
        elif isinstance(value, list | tuple) and any(isinstance(item, dict | list | tuple) for item in value):
            yield f"{indent}{key}:"
            for item in value:
                yield from _item(item, indent + "  ")
        else:
            yield f"{indent}{key}: {flow(value)}"


def _item(item: Any, indent: str) -> Iterator[str]:
    if not isinstance(item, dict) or not item:
        yield f"{indent}- {flow(item)}"
        return
    first, *rest = _table(item, indent + "  ")
    yield f"{indent}- {first.lstrip()}"
    yield from rest
