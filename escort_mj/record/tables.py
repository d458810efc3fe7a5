"""Tables as text: for other programs, for Markdown, for a terminal."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from itertools import zip_longest
from typing import Any

FORMULA = ("=", "+", "-", "@")  # how cells begin that spreadsheets run


def comma_separated(rows: Iterable[Iterable[Any]]) -> str:
    """Return rows as comma-separated values.

    None is an empty cell. Text that a spreadsheet would run as a formula (it begins with `=`, `+`, `-` or
    `@`, and is not a number) gets an apostrophe before it, which spreadsheets take for the mark of text.
    """
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([inert(cell) for cell in row] for row in rows)
    return text.getvalue()


def inert(cell: Any) -> Any:
    """Return a cell that no spreadsheet runs; numbers are what they are."""
    if not isinstance(cell, str):
        return cell
    cell = cell.replace("\r\n", "\n").replace("\r", "\n")  # which Python's writer does not quote by itself
    if not cell.lstrip().startswith(FORMULA):
        return cell
    try:
        float(cell)
    except ValueError:
        return f"'{cell}"
    return cell


def markdown(head: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Return the lines of a table in Markdown; a bar within a cell would end the cell."""
    return [
        "| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |"
        for row in [head, ["---"] * len(head), *rows]
    ]


def aligned(rows: Iterable[Sequence[str]]) -> list[str]:
    """Return the lines of a table whose columns stand below each other."""
    table = list(rows)
    widths = [max(map(len, column)) for column in zip_longest(*table, fillvalue="")]
    return ["  ".join(map(str.ljust, row, widths)).rstrip() for row in table]
