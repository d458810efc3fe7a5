"""What is asked of parameters: that the schema tells their meaning and unit, and refuses what is none."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from pydantic import BaseModel, ValidationError

from escort_mj.components.parameters import Member, description_of
from escort_mj.conformance.stand import CheckResult
from escort_mj.scenario.schema.scenario import Scenario

UNIT = re.compile(r"\[[^\]]+\]")
BOUNDS = {"minimum": ">=", "exclusiveMinimum": ">", "maximum": "<=", "exclusiveMaximum": "<"}


def own_parameters(member: type[Member]) -> list[str]:
    """The parameters that a member declares itself, beside those of its base class."""
    shared: set[str] = set()
    for base in member.__mro__[1:]:
        if base.__module__.startswith("escort_mj.") and issubclass(base, BaseModel):
            shared |= set(base.model_fields)
    return [name for name in member.model_fields if name not in shared and name != member.named_by]


def check_parameters(member: type[Member], kind: type[Scenario]) -> Iterator[CheckResult]:
    """Check the parameters of a member.

    Args:
        member: What has them.
        kind: The type of scenarios that knows it.
    """
    names = own_parameters(member)
    table = member.model_json_schema()["properties"]
    numbers = [name for name in names if member.model_fields[name].annotation is float]
    mute = [name for name in names if not description_of(member, name)]
    bare = [name for name in numbers if name not in mute and not UNIT.search(description_of(member, name))]
    words = ", ".join(_told(name, table[name]) for name in names) or "none"
    if mute:
        words = f"no words below {', '.join(mute)}: a text in triple quotes says what it is"
    elif bare:
        words = f"no unit for {', '.join(bare)}: its text has one in brackets, such as [N/m], or [1] for none"
    yield CheckResult("parameters", not (mute or bare), words)
    try:
        given = {name: field.default for name, field in member.model_fields.items() if name in names}
        missing = {name for name in names if member.model_fields[name].is_required()}
        told = {name: value for name, value in given.items() if name not in missing}
        for name, value in told.items():
            member.__pydantic_validator__.validate_assignment(member.model_construct(), name, value)
        yield CheckResult("defaults", True, "are allowed values")
    except ValidationError as error:
        first = error.errors()[0]
        yield CheckResult("defaults", False, f"{'.'.join(map(str, first['loc']))}: {first['msg']}")
    taken = [name for name in numbers if _takes(member, name, float("nan"))]
    yield CheckResult(
        "wrong values",
        not taken,
        "are refused" if not taken else f"{taken[0]} takes NaN: declare it as float",
    )


def _takes(member: type[Member], name: str, value: Any) -> bool:
    try:
        member.model_validate({name: value}, strict=True)
    except ValidationError:
        return False
    return True


def _told(name: str, node: dict[str, Any]) -> str:
    """A parameter with its default and bounds."""
    bounds = [f"{sign} {node[key]:g}" for key, sign in BOUNDS.items() if key in node]
    return " ".join([name, str(node["default"]) if "default" in node else "(required)", *bounds])
