"""Every key of a scenario as a page of the docs, made from the schema."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from escort_mj.record.tables import markdown
from escort_mj.scenario.reader.dump import flow, json_schema
from escort_mj.scenario.reader.paths import TAGS
from escort_mj.scenario.schema.scenario import Scenario

Node = dict[str, Any]

INTRODUCTION = """\
# Every key of a scenario

Made by `escort-mj schema --markdown`; editors complete and check the same keys by `scenarios/schema.json`.
A key that is left out has its default. SI units, radians, world frame. Where a table is told by its name
(a behavior, a law, a robot's kind), its name alone stands for the table with all defaults.
"""
LONGEST = 60  # characters of a default; longer ones are tables whose own defaults are listed
FAR = 1e5  # bounds from here on keep numbers finite and say nothing to a reader


def handbook(kind: type[Scenario] = Scenario) -> str:
    """The page, Markdown: a section for each table, each key with its type, default, bounds and meaning.

    Args:
        kind: The type of scenarios, which plugins make (`catalog.scenario_type`).
    """
    root = json_schema(kind)
    tables: dict[str, Node] = root["$defs"]
    parts = [INTRODUCTION, *_section("Scenario", root, tables)]
    for name in _found_from(root, tables, []):
        parts += _section(name, tables[name], tables)
    return "\n".join(parts)


def _found_from(table: Node, tables: dict[str, Node], order: list[str]) -> list[str]:
    """Names of tables, each before those that it holds."""
    for name in _references(table["properties"]):
        if name not in order:
            order.append(name)
            _found_from(tables[name], tables, order)
    return order


def _references(node: Any) -> Iterator[str]:
    if isinstance(node, dict):
        if "$ref" in node:
            yield node["$ref"].rpartition("/")[2]
        for key, value in node.items():
            if key != "default":
                yield from _references(value)
    elif isinstance(node, list):
        for value in node:
            yield from _references(value)


def _section(title: str, table: Node, tables: dict[str, Node]) -> Iterator[str]:
    yield f"## {title}\n"
    yield f"{_tag(table)}{_words(table)}\n"
    rows = [(key, value) for key, value in table["properties"].items() if "const" not in value]
    if not rows:
        yield "It has no keys of its own.\n"
        return
    required, cells = table.get("required", ()), []
    for key, value in rows:
        default = "required" if key in required else _default(value)
        meaning = _words(value) or _words(tables[next(_references(value))])
        cells.append([f"`{key}`", _kind(value), default, meaning])
    yield from markdown(["key", "is", "default", "meaning"], cells)
    yield ""


def _tag(table: Node) -> str:
    """The name that tells a table apart from others in its place, if it has one."""
    for tag in TAGS:
        if value := table["properties"].get(tag, {}).get("const"):
            return f"`{tag}: {value}`. "
    return ""


def _words(node: Node) -> str:
    """What the schema says of a key or table, in one line."""
    return " ".join(node.get("description", "").split()).replace("|", "\\|")


def _default(node: Node) -> str:
    if "default" not in node:
        return ""
    text = flow(node["default"])
    return f"`{text}`" if len(text) <= LONGEST else "see there"


def _kind(node: Node) -> str:
    """What may stand under a key, in words."""
    if "$ref" in node:
        name = node["$ref"].rpartition("/")[2]
        return f"table [{name}](#{name.lower()})"
    if "enum" in node:
        return ", ".join(f"`{value}`" for value in node["enum"])
    for union in ("anyOf", "oneOf"):
        if union in node:
            tables = [_kind(part).removeprefix("table ") for part in node[union] if "$ref" in part]
            others = [
                _kind(part) for part in node[union] if "$ref" not in part and part.get("type") != "null"
            ]
            return " or ".join([*others, *([f"table {', '.join(tables)}"] if tables else [])])
    kind = node.get("type", "")
    if kind == "array":
        return f"list of {_kind(node['items'])}" if "items" in node else "list"
    if kind == "object":
        inner = node.get("additionalProperties")
        return f"table of {_kind(inner)}" if isinstance(inner, dict) else "table"
    word = {"number": "number", "integer": "whole number", "boolean": "true or false", "string": "text"}
    return f"{word.get(kind, kind)}{_bounds(node)}"


def _bounds(node: Node) -> str:
    """The bounds of a number that mean something."""
    found = []
    for key, sign in (
        ("exclusiveMinimum", ">"),
        ("minimum", ">="),
        ("maximum", "<="),
        ("exclusiveMaximum", "<"),
    ):
        bound = node.get(key)
        if bound is not None and abs(bound) < FAR and math.isfinite(bound):
            found.append(f"{sign} {bound:g}")
    return f" {', '.join(found)}" if found else ""
