"""Values of scenario keys in a study: numbers between bounds, and parameters that stand in values by name."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Discriminator, Field, Tag

from escort_mj.components.parameters import Parameters
from escort_mj.scenario.findings import Finding, Path, parse_key_path
from escort_mj.scenario.schema.fields import LABEL


class Range(Parameters):
    """Numbers between two bounds."""

    low: float
    """Least value, in the key's unit."""
    high: float
    """Largest value, in the key's unit."""
    scale: Literal["linear", "log"] = "linear"
    """How values are spread between them."""
    whole: bool = False
    """Whether only whole numbers are meant."""

    def at(self, share: float) -> float | int:
        """The number at a share of the way through, from 0 to less than 1."""
        if self.whole:
            return min(math.floor(self.low + share * (self.high - self.low + 1.0)), math.floor(self.high))
        if self.scale == "log":
            return self.low * (self.high / self.low) ** share
        return self.low + share * (self.high - self.low)

    def findings(self, path: Path) -> Iterator[Finding]:
        """What is wrong with its numbers, at a path."""
        if not self.low < self.high:
            yield Finding((*path, "high"), f"found {self.high:g}; expected more than low, {self.low:g}")
        elif self.whole and not (self.low.is_integer() and self.high.is_integer()):
            words = f"found {self.low:g} and {self.high:g}; bounds of whole numbers are whole numbers"
            yield Finding(path, words)
        elif self.scale == "log" and self.low <= 0.0:
            yield Finding((*path, "low"), f"found {self.low:g}; a logarithmic scale needs more than 0")


class Steps(Range):
    """Evenly spread numbers, both bounds among them."""

    count: Annotated[int, Field(ge=2, le=10_000)]
    """Number of values."""

    def values(self) -> list[float | int]:
        """The numbers; fewer where whole numbers are meant and there are not so many."""
        spread = np.geomspace if self.scale == "log" else np.linspace
        numbers = spread(self.low, self.high, self.count)
        return sorted({round(x) for x in numbers}) if self.whole else numbers.tolist()


def _kind_of_levels(value: Any) -> str:
    if isinstance(value, dict) and value and all(isinstance(one, dict) for one in value.values()):
        return "named"
    return "steps" if isinstance(value, dict | Steps) else "list"


Alternatives = dict[Annotated[str, Field(pattern=LABEL)], dict[str, Any]]
Levels = Annotated[
    Annotated[tuple[Any, ...], Tag("list")]
    | Annotated[Steps, Tag("steps")]
    | Annotated[Alternatives, Tag("named")],
    Discriminator(_kind_of_levels),
]
"""Values of one factor: written out, or evenly spread; or named alternatives, each a table of keys."""
Draw = Annotated[
    Annotated[tuple[Any, ...], Tag("list")] | Annotated[Range, Tag("range")],
    Discriminator(lambda value: "range" if isinstance(value, dict | Range) else "list"),
]
"""What one value is drawn from: values written out, each as likely, or numbers between two bounds."""
Box = Annotated[dict[str, Range], Field(min_length=1, max_length=64)]
"""Scenario keys, such as `robots.mass`, or parameters of the study, and the range of each."""


def drawn(draw: tuple[Any, ...] | Range, share: float) -> Any:
    """Return the value at a share of the way through, from 0 to less than 1."""
    return draw.at(share) if isinstance(draw, Range) else draw[int(share * len(draw))]


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
