"""How the quantities of a study are shown: in which unit, on which scale, under which heading."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axis import Axis
from matplotlib.ticker import LogLocator, NullFormatter
from numpy.typing import NDArray

from escort_mj import palette
from escort_mj.report.figures.drawing.style import Key
from escort_mj.study.sweeps.quantities import RATES, Quantity
from escort_mj.study.sweeps.results import Factor

DECADES = 30.0  # times the least: positive values that reach so far are shown on a logarithmic scale
SHARES = frozenset(RATES.values())


class Scale(NamedTuple):
    """How values are shown.

    Attributes:
        factor: What they are multiplied with, 1000 for millimeters.
        unit: The unit that they have then; empty for none.
        label: For an axis.
        log: Whether on a logarithmic scale.
        low: Least of the finite values, multiplied.
        high: Largest of them, multiplied.
    """

    factor: float
    unit: str
    label: str
    log: bool
    low: float
    high: float


def heading(quantity: Quantity, between: str = ", ") -> str:
    """A quantity in words, and the part of a run that it looks at, with this between the two."""
    title = quantity.title[:1].upper() + quantity.title[1:]
    return between.join(filter(None, (title, quantity.window)))


def scale_of(quantity: Quantity, values: NDArray[np.float64]) -> Scale:
    """A scale for these values; shares are in percent, lengths below 1 m in millimeters."""
    if quantity in SHARES:
        return Scale(100.0, "%", f"{heading(quantity)} [%]", False, 0.0, 100.0)
    unit = quantity.unit
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 1.0)
    factor, unit = (
        (1000.0, "m" + unit) if unit in ("m", "m/s") and max(abs(low), abs(high)) < 1.0 else (1.0, unit)
    )
    unit = "" if unit == "1" else unit
    label = heading(quantity) + (f" [{unit}]" if unit else "")
    if low == high:
        low, high = low - 0.5 * abs(low) - 1e-9, high + 0.5 * abs(high) + 1e-9
    log = low > 0.0 and high > DECADES * low and not quantity.more_is_better
    return Scale(factor, unit, label, log, factor * low, factor * high)


def ticks_of(factor: Factor) -> Sequence[str]:
    """Levels of a factor along an axis: numbers with three digits, if these tell them apart."""
    short = [f"{number:.3g}" for number in factor.numbers]
    return short if short and len(set(short)) == len(short) else factor.levels


def logarithmic(axis: Axis) -> None:
    """Ticks of a logarithmic axis that few decades have enough of, as plain numbers."""
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=9))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter(NullFormatter())


def readable(value: float, unit: str = "") -> str:
    """A value for people: three digits; `-` for missing, `never` for infinite."""
    if math.isnan(value):
        return "-"
    if math.isinf(value):
        return "never"
    size = abs(value)
    text = f"{value:.0f}" if 100.0 <= size < 1e6 else f"{value:.3g}"
    return f"{text} {unit}".rstrip()


def level_keys(by: Factor | None, artist: Callable[[int], Artist]) -> list[Key]:
    """Legend entries of a factor's levels; no entries of no factor.

    Args:
        by: The factor.
        artist: What shows the level of a number.
    """
    levels = (
        [] if by is None else [level if len(level) >= 20 else f"{by.name} = {level}" for level in by.levels]
    )
    return [(words, artist(number)) for number, words in enumerate(levels)]


def colors_of(count: int) -> list[palette.Color]:
    """A color per level of a factor."""
    return palette.robot_colors(max(count, 1))
