"""What all parameter tables share: typed, bounded, frozen, no unknown keys, no NaN or infinity."""

import ast
import inspect
import textwrap
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, NamedTuple

from pydantic import BaseModel, ConfigDict, Field, ValidationInfo
from pydantic_core import PydanticKnownError
from pydantic_core.core_schema import (
    definitions_schema,
    no_info_after_validator_function,
    with_info_plain_validator_function,
)

if TYPE_CHECKING:
    from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler

MODEL_ONLY = frozenset(dir(BaseModel)).difference(dir(object))
STRICT = "strict"
"""Context of a validation in which no text stands for a number."""
UNLIMITED = 1e300  # stands for an infinite limit, which XML cannot hold
TEXT = r"^[^\x00-\x08\x0b-\x1f\x7f-\x9f\ufffe\uffff]*$"  # what NetCDF and XML can hold


class FunctionOfTime(NamedTuple):
    """Marks a number, or a text that is an expression in the time `t` [s], which scenarios check."""


OfTime = Annotated[float | str, FunctionOfTime()]
Coordinate = Annotated[float, Field(ge=-1e6, le=1e6)]
Vector = tuple[Coordinate, ...]
Radius = Annotated[float, Field(ge=1e-3, le=1e5)]
Distance = Annotated[float, Field(gt=0.0, le=1e5)]
Force = Annotated[float, Field(ge=1e-15, le=1e12)]
Mass = Annotated[float, Field(ge=1e-6, le=1e9)]
Speed = Annotated[float, Field(ge=0.0, le=1e3)]


class Parameters(BaseModel):
    """Base of every table of parameters that a scenario can set."""

    largest: ClassVar[float] = 1e12
    """Largest size of its numbers: what is worked out with them stays finite."""
    _in_place_of_setting: ClassVar[str] = "scenario.replace(...) returns a scenario with other values"

    # pydantic's own `use_attribute_docstrings` reads all sources at import, which takes 0.2 s.
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, defer_build=True)

    def __init_subclass__(cls, **words: Any) -> None:
        """Forget its bases' annotations of class variables: pydantic evaluates them for each subclass."""
        super().__init_subclass__(**words)
        for base in cls.__bases__:
            known = vars(base).get("__annotations__", {})
            for name in getattr(base, "__class_vars__", set()) & known.keys():
                del known[name]

    def __setattr__(self, name: str, value: Any) -> None:
        """Set what is private; parameters stay.

        Raises:
            AttributeError: If it is no private attribute.
        """
        if not name.startswith("_"):
            words = f"{type(self).__name__}.{name}: cannot be set: parameters do not change"
            raise AttributeError(f"{words}; {self._in_place_of_setting}")
        super().__setattr__(name, value)

    def __dir__(self) -> list[str]:
        """Return what is its own, for completion."""
        return sorted({*super().__dir__()} - MODEL_ONLY)

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: "GetCoreSchemaHandler") -> Any:
        """Return the schema with limited numbers; with a `field_validator`, it takes twice as long."""
        schema = handler(source)
        table = handler.resolve_ref_schema(schema)
        while table["type"] != "model-fields":
            table = table["schema"]
        for field in table["fields"].values():
            holder = field["schema"] if field["schema"]["type"] == "default" else field
            if holder["schema"].get("function", {}).get("function") != cls._not_too_large:
                holder["schema"] = no_info_after_validator_function(cls._not_too_large, holder["schema"])
        return schema

    @classmethod
    def _not_too_large(cls, value: Any) -> Any:
        for number in value if isinstance(value, tuple) else (value,):
            if isinstance(number, float) and abs(number) > cls.largest:
                if number < 0.0:
                    raise PydanticKnownError("greater_than_equal", {"ge": -cls.largest})
                raise PydanticKnownError("less_than_equal", {"le": cls.largest})
        return value

    @classmethod
    def __get_pydantic_json_schema__(
        cls, core_schema: Any, handler: "GetJsonSchemaHandler"
    ) -> dict[str, Any]:
        """Return the JSON Schema, in which the docstring below a field is its description."""
        schema = handler(core_schema)
        properties = handler.resolve_ref_schema(schema).get("properties", {})
        for name in properties.keys() & cls.model_fields.keys():
            found, description = properties[name], description_of(cls, name)
            if description and handler.resolve_ref_schema(found).get("description") != description:
                found["description"] = description
        return schema


class Member(Parameters):
    """Base of tables of which one of several stands in a place; the base class of a kind tells them apart."""

    plural: ClassVar[str] = ""
    """What commands call the members."""
    named_by: ClassVar[str] = ""
    """Key with the name of a member, which is its default."""
    default_name: ClassVar[str | None] = None
    """Name of the member that a table without that key is; None where the key must be there."""
    method: ClassVar[str] = ""
    """Name of the method that every member has; empty where there is none."""
    of_plugins: ClassVar[bool] = True
    """Whether plugins may bring members."""

    @classmethod
    def misstated(cls) -> Iterator[tuple[str, str]]:
        """Yield the names of what a class says of itself that is not as it must be, and what is expected."""
        yield from ()

    @classmethod
    def own_name(cls) -> str | None:
        """Return the name by which a scenario asks for it; None for a base class."""
        name = cls.model_fields[cls.named_by].default if cls.named_by else None
        return name if isinstance(name, str) else None


class Deferred(NamedTuple):
    """Marks a table that compiles its checks when a value for it comes: scenarios name few of all members."""

    def __get_pydantic_core_schema__(self, source: Any, handler: "GetCoreSchemaHandler") -> Any:
        """Return the schema that leaves the value to the table's own; the context says whether strictly."""

        def of(value: Any, info: ValidationInfo) -> Any:
            return source.model_validate(value, strict=info.context == STRICT, context=info.context)

        return with_info_plain_validator_function(of, metadata={"table": source})

    def __get_pydantic_json_schema__(self, core_schema: Any, handler: "GetJsonSchemaHandler") -> Any:
        """Return the table's own JSON Schema."""
        return handler(definitions_schema(core_schema["metadata"]["table"].__pydantic_core_schema__, []))


class Members(NamedTuple):
    """Marks the type of a key as that of the members of a kind: those of plugins may stand there, too.

    Attributes:
        base: The kind.
        make: Makes the type, of the members.
        known: The members.
    """

    base: type[Any]
    make: Callable[[Sequence[Any]], Any]
    known: tuple[Any, ...]


def one_of(base: type[Any], make: Callable[[Sequence[Any]], Any], known: tuple[Any, ...]) -> Any:
    """Return the type of a key that may be one of the members of a kind.

    Arguments are those of `Members`.
    """
    return Annotated[make(known), Members(base, make, known)]


def description_of(table: type[BaseModel], name: str) -> str:
    """Return what a field means: the docstring below it; empty where there is none.

    Args:
        table: The class of the table.
        name: Name of the field.
    """
    field = table.model_fields[name]
    return field.description or next(filter(None, (_docstrings(each).get(name) for each in table.mro())), "")


@cache
def _docstrings(table: type) -> dict[str, str]:
    """Docstrings below the fields that a class itself declares."""
    if table is Parameters or not issubclass(table, Parameters):
        return {}
    try:
        body = ast.parse(textwrap.dedent(inspect.getsource(table))).body[0]
    except (OSError, TypeError):  # made by code
        return {}
    assert isinstance(body, ast.ClassDef)
    return {
        field.target.id: inspect.cleandoc(text.value.value)
        for field, text in pairwise(body.body)
        if isinstance(field, ast.AnnAssign)
        and isinstance(field.target, ast.Name)
        and isinstance(text, ast.Expr)
        and isinstance(text.value, ast.Constant)
        and isinstance(text.value.value, str)
    }
