"""Numbers between bounds, as studies vary, tune and search them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Discriminator, Field, Tag

from escort_mj.components.parameters import Parameters
from escort_mj.scenario.findings import Finding, Path
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
