"""Text in pictures, as it was written: letters that the font lacks, and signs that are no mathematics."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import lru_cache
from pathlib import Path

import matplotlib
from matplotlib.artist import Artist
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.font_manager import fontManager, get_font
from matplotlib.text import Text
from matplotlib.ticker import FixedFormatter, Formatter, FuncFormatter, ScalarFormatter

FONT = "DejaVu Sans"  # which matplotlib ships: a machine need not have any other
BOX = "□"
NO_FONT = "Last Resort"  # how matplotlib's font begins its name that has a sign for every code point


def font_file(bold: bool = False) -> str:
    """Where the pictures' own font lies."""
    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    return str(Path(matplotlib.get_data_path()) / "fonts" / "ttf" / name)


def legible(words: str) -> str:
    """Words with a box for every letter that the pictures' own font lacks."""
    return "".join(letter if letter in _letters(font_file()) else BOX for letter in words)


def finish_texts(figure: Figure) -> None:
    """Make every text of a figure appear as it was written."""
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis, *([axes.zaxis] if hasattr(axes, "zaxis") else [])):
            if isinstance(axis.get_major_formatter(), FixedFormatter | FuncFormatter):
                _spell(axis.get_ticklabels(which="both"))
                axis.set_major_formatter(_Literal(axis.get_major_formatter()))
            elif type(axis.get_major_formatter()) is ScalarFormatter:
                axis.set_major_formatter(_Numbers())
    texts = list(_texts(figure))
    _spell(texts)
    for text in texts:
        text.set_parse_math(False)


def _texts(artist: Artist) -> Iterator[Text]:
    """Texts of a figure except for numbers along its axes, which alone are mathematics."""
    for child in [artist.label] if isinstance(artist, Axis) else artist.get_children():
        if isinstance(child, Text):
            yield child
        yield from _texts(child)


def _spell(texts: Iterable[Text]) -> None:
    """Give texts the fonts that their letters need, and boxes where no font has them."""
    for text in texts:
        words = text.get_text()
        lacking, families = set(words) - _letters(font_file()) - {"\n"}, list(text.get_fontfamily())
        while lacking:
            letter = min(lacking)
            family, letters = _font_with(letter)
            if family:
                families.append(family)
            else:
                words = words.replace(letter, BOX)
            lacking -= letters
        if len(families) > len(text.get_fontfamily()):
            text.set_fontfamily(families)
            text.set_fontweight("normal")  # which every font has
        if words != text.get_text():
            text.set_text(words)


class _Literal(Formatter):
    """Words along an axis, none of them mathematics; axes that are shared have one in common."""

    def __init__(self, words: Formatter) -> None:
        self._words = words

    def __call__(self, x: float, pos: int | None = None) -> str:
        return self._words(x, pos).replace("$", r"\$")


class _Numbers(ScalarFormatter):
    """Numbers along an axis; only their common factor is set as mathematics, which takes long."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        return super().__call__(x, pos).removeprefix(r"$\mathdefault{").removesuffix("}$")


@lru_cache(maxsize=64)
def _letters(file: str) -> frozenset[str]:
    """All letters of a font; none of a file that cannot be read as one."""
    try:
        return frozenset(map(chr, get_font(file).get_charmap()))
    except (OSError, RuntimeError):
        return frozenset()


@lru_cache(maxsize=256)
def _font_with(letter: str) -> tuple[str, frozenset[str]]:
    """Name and letters of the first installed font that has a letter; no name where none has it."""
    for entry in sorted(fontManager.ttflist, key=lambda font: (font.name, font.fname)):
        if not entry.name.startswith(NO_FONT) and letter in (letters := _letters(entry.fname)):
            return entry.name, letters
    return "", frozenset(letter)
