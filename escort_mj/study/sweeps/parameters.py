"""Parameters of a study: numbers with a name, which stand in the values of scenario keys."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

from escort_mj.scenario.findings import parse_key_path

NAME = r"[a-z][a-z0-9_]*"
_PLACE = re.compile(rf"\{{({NAME})\}}")


def in_order(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return scenario keys and values in the order in which they are set.

    A table comes before its keys: what sets the whole table must not undo what sets a part of it.
    """
    return {key: given[key] for key in sorted(given, key=lambda key: len(parse_key_path(key) or ()))}


def filled(value: Any, numbers: Mapping[str, float]) -> Any:
    """A value with every `{name}` replaced by the number of that name.

    A text that is nothing but `{name}` becomes the number itself; within a longer text, such as an expression
    in t, negative numbers get parentheses.
    """
    if isinstance(value, dict):
        return {key: filled(inner, numbers) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return type(value)(filled(inner, numbers) for inner in value)
    if not isinstance(value, str):
        return value
    whole = _PLACE.fullmatch(value)
    if whole and whole[1] in numbers:
        return numbers[whole[1]]
    return _PLACE.sub(lambda found: _written(numbers[found[1]]) if found[1] in numbers else found[0], value)


def names_in_braces(value: Any) -> Iterator[str]:
    """Names that a value has in braces."""
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list | tuple):
        for inner in value:
            yield from names_in_braces(inner)
    elif isinstance(value, str):
        yield from _PLACE.findall(value)


def _written(value: Any) -> str:
    """Return a value within a text; one that is no number makes the text wrong, which is found there."""
    return f"({value!r})" if isinstance(value, int | float) and value < 0 else repr(value)
