"""What components read: found from the classes that their methods are handed."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from typing import Any, get_type_hints

from escort_mj.components.equations import Equations, kind_word
from escort_mj.memory.layout import Plan, State
from escort_mj.native.fields import Declared, declared
from escort_mj.native.lanes import Lanes
from escort_mj.native.values import Computed, Values
from escort_mj.native.vectors import Vec
from escort_mj.scenario.kinds import EQUATIONS

FORMS = {
    Vec: "vector",
    Lanes: "number for each robot",
    float: "number",
    int: "whole number",
    Any: "condition",
}
SAID = re.compile(r"(?:Return )?(?P<meaning>.*?)(?: \[(?P<unit>[^]]*)\])?\.", re.DOTALL)
PARTS = re.compile(r"^ +(?P<name>\w+): (?P<said>.*?\.)$", re.MULTILINE | re.DOTALL)

Row = tuple[str, str, str, str, str]
"""Kind of component, name, form, unit, meaning."""


def values_read() -> Iterator[Row]:
    """Yield everything that components of each kind can read."""
    for base in EQUATIONS:
        given = get_type_hints(getattr(base, base.method))["r"]
        for name, form, unit, meaning in _named(base) if issubclass(given, Values) else _computed(given):
            yield kind_word(base), f"r.{name}", form, unit, meaning


def _named(base: type[Equations]) -> Iterator[tuple[str, str, str, str]]:
    """What is read of memory by name."""
    fields, own = declared(Plan) | declared(State), base.memories()
    for name, field in base.reads:
        yield name, _form(fields[field], 0), *_about(fields[field])
    for name, field, _ in base.names().rows:
        about = own[name][:2] if name in own else _about(fields[field])
        yield name, _form(fields[field], 1), *about


def _computed(given: type, told: tuple[type, ...] = ()) -> Iterator[tuple[str, str, str, str]]:
    """What are properties and methods of a class, and the parts of what these return.

    Args:
        given: The class.
        told: Classes whose members are told already.
    """
    for name, member in vars(given).items():
        function = member.fget if isinstance(member, property) else member
        if name.startswith("_") or not inspect.isfunction(function):
            continue
        result = get_type_hints(function).get("return", Any)
        called = name if isinstance(member, property) else f"{name}({', '.join(_arguments(function))})"
        yield called, FORMS.get(result, result.__name__.lower()), *_said(function)
        if result in (*FORMS, given, *told) or not issubclass(result, tuple | Computed):
            continue
        told = (*told, result)
        kinds = get_type_hints(result)
        for part in PARTS.finditer(result.__doc__ or ""):
            about = _parsed(part["said"])
            yield f"{called}.{part['name']}", FORMS.get(kinds[part["name"]], ""), *about
        for own, *said in _computed(result, told) if issubclass(result, Computed) else ():
            yield f"{called}.{own}", said[0], said[1], said[2]


def _arguments(function: Any) -> list[str]:
    return list(inspect.signature(function).parameters)[1:]


def _said(function: Any) -> tuple[str, str]:
    """Unit and meaning, as a function's description gives them."""
    return _parsed((inspect.getdoc(function) or "").split("\n\n")[0])


def _parsed(text: str) -> tuple[str, str]:
    found = SAID.match(" ".join(text.split()))
    unit, meaning = (found["unit"] or "", found["meaning"]) if found else ("", text)
    return unit, meaning[:1].upper() + meaning[1:]


def _about(field: Declared) -> tuple[str, str]:
    return (field.value.unit, field.value.meaning) if field.value is not None else ("", "")


def _form(field: Declared, rows: int) -> str:
    """A number, or an array of them, behind so many dimensions that names stand for."""
    return "number" if field.shape[rows:] in ((), ((1,),)) else "array"
