"""How figures look, those of runs and of studies alike: their size, letters and file formats."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import NamedTuple

from matplotlib.font_manager import fontManager

from escort_mj.errors import UsageError
from escort_mj.report.figures.drawing.fonts import FONT
from escort_mj.scenario.arguments import checked

WIDTHS = {"column": 3.5, "page": 7.2}
"""Widths of one and of two columns of a journal's page [inches]."""
FORMATS = ("png", "pdf", "svg")
NARROW = 5.0  # inches; panels of narrower figures stand below each other
LEAST_WIDTH, MOST_WIDTH = 2.0, 40.0  # inches
LEAST_SIZE, MOST_SIZE = 4.0, 40.0  # points
GENERIC = ("serif", "sans-serif", "monospace")
_LENGTH = re.compile(r"(\d+(?:\.\d*)?|\.\d+) ?(in|cm|mm)")
_INCHES = {"in": 1.0, "cm": 1 / 2.54, "mm": 1 / 25.4}


class Look(NamedTuple):
    """How figures look.

    Attributes:
        width: Inches; None for what each figure takes by itself, most of them a page.
        font: Family of their letters; what it lacks is taken from the usual one.
        size: Of most letters [points].
        title: Whether the name of the scenario and what is shown stand above.
    """

    width: float | None = None
    font: str = FONT
    size: float = 8.5
    title: bool = True


USUAL = Look()
WIDTH = WIDTHS["page"]
_PRESENT: ContextVar[Look] = ContextVar("look", default=USUAL)


@contextmanager
def looking(look: Look) -> Iterator[None]:
    """Give every figure that is drawn meanwhile this look."""
    token = _PRESENT.set(look)
    try:
        yield
    finally:
        _PRESENT.reset(token)


def present() -> Look:
    """Return the look of figures that are drawn now."""
    return _PRESENT.get()


def abreast(most: int) -> int:
    """Return how many panels stand beside each other: as many as may, or in narrow figures one."""
    return 1 if (present().width or WIDTH) <= NARROW else most


@checked
def look_of(
    width: str | float | None = None,
    font: str | None = None,
    font_size: float | None = None,
    title: bool = True,
) -> Look:
    """Return a look as users ask for it.

    Args:
        width: Width of figures: `column` (3.5in), `page` (7.2in), or a length such as `88mm`, and in Python a
            number of inches; None for what each takes by itself, most of them a page.
        font: Font of figures: an installed family, or `serif`, `sans-serif`, `monospace`.
        font_size: Font size of figures [pt].
        title: Whether figures have a title.

    Raises:
        UsageError: If something of it is not possible.
    """
    look = USUAL._replace(title=title)
    if width is not None:
        look = look._replace(width=_inches(width))
    if font is not None:
        families = {entry.name for entry in fontManager.ttflist}
        if font not in families and font not in GENERIC:
            raise UsageError(
                f"font: found {font}, which is not installed here; allowed are {', '.join(GENERIC)} and "
                f"installed families such as {', '.join(sorted(families - {'Last Resort'})[:5])}"
            )
        look = look._replace(font=font)
    if font_size is not None:
        if not LEAST_SIZE <= font_size <= MOST_SIZE:
            raise UsageError(
                f"font size: found {font_size:g}; allowed are {LEAST_SIZE:g} to {MOST_SIZE:g} pt"
            )
        look = look._replace(size=font_size)
    return look


def check_formats(formats: Sequence[str]) -> tuple[str, ...]:
    """Return file formats, each once.

    Raises:
        UsageError: If one is not known.
    """
    for name in formats:
        if name not in FORMATS:
            raise UsageError(f"figure format: found {name}; allowed are {', '.join(FORMATS)}")
    return tuple(dict.fromkeys(formats))


def _inches(width: str | float) -> float:
    """A width in inches."""
    text = str(width).strip()
    if text in WIDTHS:
        return WIDTHS[text]
    found = _LENGTH.fullmatch(text if text[-1:].isalpha() else f"{text}in")
    inches = float(found[1]) * _INCHES[found[2]] if found else 0.0
    if not LEAST_WIDTH <= inches <= MOST_WIDTH:
        raise UsageError(
            f"width: found {width}; allowed are {', '.join(WIDTHS)}, and lengths from {LEAST_WIDTH:g}in to "
            f"{MOST_WIDTH:g}in such as 3.5in, 8.8cm or 88mm"
        )
    return inches
