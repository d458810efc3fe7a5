"""Types of the scenario's values that several tables share, or that have more than one way to be written."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, PlainValidator, WithJsonSchema
from pydantic_core import PydanticCustomError

from escort_mj.control.behaviors import BEHAVIORS, BehaviorParameters
from escort_mj.control.laws import LAWS, LawParameters
from escort_mj.control.outer_loops import OUTER_LOOPS
from escort_mj.control.outer_loops import OuterLoop as OuterLoopParameters
from escort_mj.control.plan import MAX_LEVELS
from escort_mj.scenario.expressions import Expression, ExpressionError


def _component(value: Any) -> float | str:
    """A finite number, or text that is an expression in t."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise PydanticCustomError("component_type", "a number or an expression in t")
    if isinstance(value, str):
        try:
            Expression(value)
        except ExpressionError as error:
            raise PydanticCustomError("expression", "{reason}", {"reason": str(error)}) from None
        return value
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise PydanticCustomError("finite_number", "a finite number")
    return number


Component = Annotated[
    float | str,
    PlainValidator(_component),
    WithJsonSchema({"anyOf": [{"type": "number"}, {"type": "string", "maxLength": 200}]}),
]
"""A number, or an expression in the time `t` [s], such as `"3 + 0.1*t"`."""

Coordinate = Annotated[float, Field(ge=-1e6, le=1e6)]
Vector = tuple[Coordinate, ...]
Radius = Annotated[float, Field(ge=1e-3, le=1e5)]
Force = Annotated[float, Field(ge=1e-15, le=1e12)]
Mass = Annotated[float, Field(ge=1e-6, le=1e9)]

RUN_NAME = r"^[^\x00-\x20\x7f/\\.][^\x00-\x1f\x7f/\\]{0,79}$"
BODY_NAME = r"^[A-Za-z0-9_\-]{1,40}$"
PATTERNS = {
    RUN_NAME: "1 to 80 characters without / and \\, not beginning with a dot or space",
    BODY_NAME: "1 to 40 letters, digits, _ and -",
}


def named(key: str, default: str | None = None) -> Any:
    """Lets `chords` stand for `{behavior: chords}`, and a table without the name for the default's."""

    def expand(value: Any) -> Any:
        if isinstance(value, str):
            return {key: value}
        if default is not None and isinstance(value, dict) and key not in value:
            return {key: default, **value}
        return value

    return expand


BehaviorName = Literal[tuple(b.model_fields["behavior"].default for b in BEHAVIORS)]  # type: ignore[valid-type]
LoopName = Literal[tuple(loop.model_fields["loop"].default for loop in OUTER_LOOPS)]  # type: ignore[valid-type]
LawName = Literal[tuple(law.model_fields["law"].default for law in LAWS)]  # type: ignore[valid-type]
Behavior = Annotated[
    BehaviorParameters,
    Field(discriminator="behavior"),
    BeforeValidator(named("behavior"), json_schema_input_type=BehaviorName | BehaviorParameters),
]
Behaviors = Annotated[tuple[Behavior, ...], Field(min_length=1, max_length=MAX_LEVELS)]
Law = Annotated[
    LawParameters,
    Field(discriminator="law"),
    BeforeValidator(named("law", "apd_smc"), json_schema_input_type=LawName | LawParameters),
]
OuterLoop = Annotated[
    OuterLoopParameters,
    Field(discriminator="loop"),
    BeforeValidator(named("loop", "nsb"), json_schema_input_type=LoopName | OuterLoopParameters),
]
