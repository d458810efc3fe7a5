"""Types of the scenario's values that several tables share, or that have more than one way to be written."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple, TypeAlias, Union

from pydantic import BeforeValidator, Field, GetCoreSchemaHandler, PlainValidator, WithJsonSchema
from pydantic_core import PydanticCustomError
from pydantic_core.core_schema import tagged_union_schema

from escort_mj.behaviors.behavior import Behavior as AnyBehavior
from escort_mj.behaviors.task import MAX_LEVELS
from escort_mj.components.parameters import TEXT, Deferred, Member, OfTime, one_of
from escort_mj.control.outer_loops import OuterLoop as AnyOuterLoop
from escort_mj.disturbances import Disturbance as AnyDisturbance
from escort_mj.estimators import Estimator as AnyEstimator
from escort_mj.failures import Failure as AnyFailure
from escort_mj.laws.law import Law as AnyLaw
from escort_mj.policies import Policy as AnyPolicy
from escort_mj.radios import Radio as AnyRadio
from escort_mj.robots import RobotKind as AnyRobotKind
from escort_mj.rules import Rule as AnyRule
from escort_mj.scenario.kinds import KINDS
from escort_mj.scenario.schema.expressions import Expression, ExpressionError


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
    OfTime,
    PlainValidator(_component),
    WithJsonSchema({"anyOf": [{"type": "number"}, {"type": "string", "maxLength": 200}]}),
]
"""A number, or an expression in the time `t` [s], such as `"3 + 0.1*t"`."""

_UNSEEN = r"\x00-\x1f\x7f-\x9f\u061c\u200b\u200e\u200f\u2028-\u202e\u2060-\u2069\ufeff"  # or turns text
RUN_NAME = rf"^[^{_UNSEEN} /\\.][^{_UNSEEN}/\\]{{0,79}}$"
LABEL = rf"^[^{_UNSEEN}]{{1,200}}$"
BODY_NAME = r"^[A-Za-z0-9_\-]{1,40}$"
PATTERNS = {
    TEXT: "text without control characters",
    RUN_NAME: "1 to 80 visible characters without / and \\, not beginning with a dot or space",
    LABEL: "1 to 200 visible characters",
    BODY_NAME: "1 to 40 letters, digits, _ and -",
}


class OneOf(NamedTuple):
    """Marks a union of tables.

    Attributes:
        key: The key that tells them apart.
        models: The tables.
    """

    key: str
    models: tuple[type[Member], ...]

    def __get_pydantic_core_schema__(self, _: Any, handler: GetCoreSchemaHandler) -> Any:
        """Return the schema that compiles the checks of those tables only that values ask for."""
        tables = {
            str(model.own_name()): handler.generate_schema(Annotated[model, Deferred()])
            for model in self.models
        }
        return tagged_union_schema(tables, discriminator=self.key)


def named(key: str, default: str | None = None) -> Any:
    """Lets `chords` stand for `{behavior: chords}`, and a table without the name for the default's."""

    def expand(value: Any) -> Any:
        if isinstance(value, str):
            return {key: value}
        if default is not None and isinstance(value, dict) and key not in value:
            return {key: default, **value}
        return value

    return expand


def one_of_kinds(models: Sequence[type[Member]], default: str | None = None) -> Any:
    """Type of a table that is one of several, told by a key or by its name alone.

    Args:
        models: The tables.
        default: Name of the one that a table without the key is; None where the key must be there.
    """
    key = models[0].named_by
    names = Literal[tuple(model.own_name() for model in models)]  # type: ignore[valid-type]
    table: Any = Union[tuple(models)]  # noqa: UP007 - of types that are known at run time only
    deferred: Any = Union[tuple(Annotated[model, Deferred()] for model in models)]  # noqa: UP007
    return Annotated[
        table,
        OneOf(key, tuple(models)),
        BeforeValidator(named(key, default), json_schema_input_type=names | deferred),
    ]


def member_of(base: type[Member]) -> Any:
    """Type of a table that is any of the members of a kind, those of plugins too."""
    return one_of(base, lambda models: one_of_kinds(models, base.default_name), KINDS[base])


if TYPE_CHECKING:
    Behavior: TypeAlias = AnyBehavior
    Disturbance: TypeAlias = AnyDisturbance
    Estimator: TypeAlias = AnyEstimator
    Failure: TypeAlias = AnyFailure
    Law: TypeAlias = AnyLaw
    OuterLoop: TypeAlias = AnyOuterLoop
    Policy: TypeAlias = AnyPolicy
    Radio: TypeAlias = AnyRadio
    RobotKind: TypeAlias = AnyRobotKind
    Rule: TypeAlias = AnyRule
else:
    Behavior = member_of(AnyBehavior)
    Disturbance = member_of(AnyDisturbance)
    Estimator = member_of(AnyEstimator)
    Failure = member_of(AnyFailure)
    Law = member_of(AnyLaw)
    OuterLoop = member_of(AnyOuterLoop)
    Policy = member_of(AnyPolicy)
    Radio = member_of(AnyRadio)
    RobotKind = member_of(AnyRobotKind)
    Rule = member_of(AnyRule)
Behaviors = Annotated[tuple[Behavior, ...], Field(min_length=1, max_length=MAX_LEVELS)]
