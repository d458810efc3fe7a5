"""Pairs of groups or bodies, as keys of expectations."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import PlainValidator, WithJsonSchema
from pydantic_core import PydanticCustomError

from escort_mj.expectations.expectation import Sides

_SIDE = "a group (robots, target, obstacles, walls, floor) or the name of a body"


def sides(*words: str) -> Any:
    """Type of a pair of groups or bodies, or of one of the words that stand for many pairs."""
    wanted = ", ".join((*words, f"{'or ' if words else ''}a list of two, each {_SIDE}"))
    choices: list[dict[str, Any]] = [{"enum": list(words)}] if words else []
    pair = {"type": "array", "items": {"type": "string"}, "minItems": 2, "maxItems": 2}

    def read(value: Any) -> str | Sides:
        if isinstance(value, str) and value in words:
            return value
        if isinstance(value, list | tuple) and len(value) == 2 and all(isinstance(x, str) for x in value):
            return value[0], value[1]
        raise PydanticCustomError("choice", "{wanted}", {"wanted": wanted})

    return Annotated[
        Literal[words] | Sides if words else Sides,
        PlainValidator(read),
        WithJsonSchema({"anyOf": [*choices, pair]}),
    ]
