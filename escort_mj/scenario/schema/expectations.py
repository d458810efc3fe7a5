"""What must hold for a run to pass: one table per kind of expectation, told apart by the key naming it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any, Union

from pydantic import Discriminator, Tag

from escort_mj.components.parameters import Deferred, one_of
from escort_mj.expectations import EXPECTATIONS, Expectation


def tag_of_kind(kind: str) -> str:
    """What messages call the expectations of a kind."""
    return f"{kind} expectations"


def expectation_of(kinds: Sequence[type[Expectation]]) -> Any:
    """Type of an expectation that is one of several kinds, told by the first key of all kinds that it has."""

    def kind_of(value: Any) -> str | None:
        if isinstance(value, Expectation):
            return tag_of_kind(value.kind)
        names = (kind.kind for kind in kinds) if isinstance(value, dict) else ()
        return next((tag_of_kind(name) for name in names if name in value), None)

    tagged = [Annotated[kind, Deferred(), Tag(tag_of_kind(kind.kind))] for kind in kinds]
    one: Any = Union[tuple(tagged)]  # noqa: UP007 - of types that are known at run time only
    asked = Discriminator(kind_of, custom_error_type="kind", custom_error_message="an expectation")
    return Annotated[one, asked]


if TYPE_CHECKING:
    AnyExpectation = Expectation
else:
    AnyExpectation = one_of(Expectation, expectation_of, EXPECTATIONS)
