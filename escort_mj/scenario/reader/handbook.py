"""Every key of a scenario as a page of the docs, made from the schema."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import Any

from escort_mj.record.tables import markdown
from escort_mj.scenario.kinds import NAME_KEYS
from escort_mj.scenario.reader.dump import flow, json_schema
from escort_mj.scenario.schema.scenario import Scenario

Node = dict[str, Any]

INTRODUCTION = """\
# All keys

This page lists every key of a scenario; `escort-mj schema --markdown` writes it. With
`scenarios/schema.json`, editors complete and check these keys. An omitted key has its default. Values are in
SI units and radians, and vectors in the world frame, unless a key's meaning says otherwise. A component, such
as a behavior or a law, can be given by its name alone: all its keys then have their defaults.
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
        yield "No keys.\n"
        return
    required, cells = table.get("required", ()), []
    for key, value in rows:
        default = "required" if key in required else _default(value)
        meaning = _words(value) or _words(tables[next(_references(value))])
        cells.append([f"`{key}`", _kind(value), default, meaning])
    yield from markdown(["key", "type", "default", "meaning"], cells)
    yield ""


def _tag(table: Node) -> str:
    """The name that tells a table apart from others in its place, if it has one."""
    for tag in NAME_KEYS:
        if value := table["properties"].get(tag, {}).get("const"):
            return f"`{tag}: {value}`. "
    return ""


def _words(node: Node) -> str:
    """Return the description of a key or table in one line, without the sections of a docstring."""
    text = re.split(r"\n\s*(?:Args|Attributes|Raises):\n", node.get("description", ""))[0]
    return with_links(" ".join(text.split()))


def with_links(text: str) -> str:
    """Text for a page of docs/, with links to the pages that it names."""
    return re.sub(r"\(docs/(\w+)\.md\)", r"([\1](\1.md))", text)


def _default(node: Node) -> str:
    if "default" not in node:
        return ""
    text = flow(_by_name(node["default"]))
    return f"`{text}`" if len(text) <= LONGEST else "table defaults"


def _by_name(default: Any) -> Any:
    """Return a default in which each table with a name is that name."""
    if isinstance(default, list):
        return [_by_name(one) for one in default]
    named = default if isinstance(default, dict) else {}
    return next((named[tag] for tag in NAME_KEYS if isinstance(named.get(tag), str)), default)


def _kind(node: Node) -> str:
    """Return the type of a key in words."""
    if "$ref" in node:
        name = node["$ref"].rpartition("/")[2]
        return f"[{name}](#{name.lower()})"
    if "const" in node:
        return f"`{flow(node['const'])}`"
    if "enum" in node:
        return ", ".join(f"`{flow(value)}`" for value in node["enum"])
    for union in ("anyOf", "oneOf"):
        if union in node:
            kinds = [part for part in node[union] if part.get("type") != "null"]
            tables = [_kind(part) for part in kinds if "$ref" in part]
            others = [_kind(part) for part in kinds if "$ref" not in part]
            return " or ".join([*others, *([", ".join(tables)] if tables else [])])
    kind = node.get("type", "")
    if kind == "array":
        return f"list of {_kind(node['items'])}" if "items" in node else "list"
    if kind == "object":
        inner = node.get("additionalProperties")
        return f"table of {_kind(inner)}" if isinstance(inner, dict) else "table"
    word = {"integer": "whole number", "boolean": "true or false", "string": "text"}
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
