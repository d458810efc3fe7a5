"""A value against its bounds, in numbers and in words."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from escort_mj.expectations.expectation import Fault, Judgment, not_judged, nothing_found
from escort_mj.metrics.measure import Measure
from escort_mj.metrics.watching import Last

NEAR = 0.05  # a margin below this share of the bound is a near miss


@dataclass(frozen=True)
class Limits:
    """One side of what a value may be.

    Attributes:
        value: The bound.
        upper: Whether values must not be above it, or not below it.
        least: No value is below this.
    """

    value: float
    upper: bool = True
    least: float = 0.0

    def margin(self, value: float) -> float:
        """Distance of a value from the bound, negative beyond it."""
        return self.value - value if self.upper else value - self.value

    def is_near(self, margin: float) -> bool:
        """Whether a margin is a near miss; a bound of zero has none."""
        return 0.0 <= margin < NEAR * abs(self.value - self.least)

    def words(self, unit: str) -> str:
        """As `at most 3 m`."""
        return f"at {'most' if self.upper else 'least'} {self.value:g}{unit and ' ' + unit}"


def held_against(found: Measure, unit: str, bounds: Sequence[Limits]) -> Judgment:
    """A value against its bounds, of which the one with the least margin counts."""
    if found.unlogged:
        return not_judged(found.reason)
    if found.value is None:
        return nothing_found(found.reason, unit)
    margin, bound = min(((one.margin(found.value), one) for one in bounds), key=lambda pair: pair[0])
    counted = not unit and found.value.is_integer() and bound.value.is_integer()  # nothing lies between
    near = bound.is_near(margin) and not counted
    words = f"{text_of(found.value, unit)}{circumstances(found)}"
    words += f"{found.manner and ', ' + found.manner}{', a near miss' if near else ''}"
    return Judgment(margin >= 0.0, words, found.value, unit, found.time, found.bodies, margin, near)


def since(last: Last, never: str) -> str:
    """Since when nobody is far from where all are to be, in words.

    Args:
        last: The last time that somebody was.
        never: What to say if somebody is at the end.
    """
    if last.time is None:
        return ", from the start"
    return f", {never}" if last.since == math.inf else f", from {last.since:.9g} s on"


def text_of(value: float, unit: str) -> str:
    """A value as text."""
    if math.isinf(value):
        return "never" if unit == "s" else "nothing near"
    return f"{value:.4g}{unit and ' ' + unit}"


def circumstances(found: Measure, at: str = "at") -> str:
    """Who and when, where known; `by` a time that is that of the sample after it."""
    when = "" if found.time is None else f"{at} {found.time:.2f} s"
    words = " ".join(filter(None, (found.who, when)))
    return f" ({words})" if words else ""


def order_faults(low: float | None, high: float | None) -> Iterator[Fault]:
    """What is wrong with a lower and an upper bound together."""
    if low is not None and high is not None and low > high:
        yield (), f"no value is at least {low:g} and at most {high:g}"
