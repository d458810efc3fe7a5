"""Tables as text: for other programs, for Markdown, for LaTeX, for a terminal."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from itertools import zip_longest
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas

_LATEX = {letter: f"\\{letter}" for letter in "&%$#_{}"} | {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
    "±": r"$\pm$",
    "−": r"$-$",
    "×": r"$\times$",
    "°": r"$^\circ$",
    "µ": r"$\mu$",
    "∞": r"$\infty$",
    "\n": " ",
}
FORMULA = ("=", "+", "-", "@")  # how cells begin that spreadsheets run


def headed(name: str, unit: str) -> str:
    """Return the head of a column, `name [unit]`; the name alone where there is no unit."""
    return name if unit in ("", "1") else f"{name} [{unit}]"


def parted(head: str) -> tuple[str, str]:
    """Return name and unit of a column's head; the unit is empty where it has none."""
    name, mark, unit = head.partition(" [")
    return (name, unit[:-1]) if mark and unit.endswith("]") else (head, "")


def with_units(table: pandas.DataFrame) -> pandas.DataFrame:
    """Return a table whose heads are `name [unit]`, with the units in its `attrs["units"]`."""
    units = table.attrs.get("units", {})
    return table.set_axis([headed(name, units.get(name, "")) for name in table.columns], axis="columns")


def without_units(table: pandas.DataFrame) -> pandas.DataFrame:
    """Return a table whose heads are names; units that stood in them are in its `attrs["units"]`."""
    parts = [parted(str(head).strip()) for head in table.columns]
    plain = table.set_axis([name for name, _ in parts], axis="columns")
    stated = table.attrs.get("units")
    known = stated if isinstance(stated, dict) else {}
    plain.attrs["units"] = known | {name: unit for name, unit in parts if unit}
    return plain


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


def latex(head: Sequence[str], rows: Iterable[Sequence[str]], caption: str, label: str) -> str:
    """Return a table for LaTeX with the package booktabs; the first column is left-aligned.

    Args:
        head: Headings.
        rows: Cells as plain text; `**text**` is bold.
        caption: What the table shows.
        label: By which the text refers to it, behind `tab:`.
    """
    import pandas

    cells = pandas.DataFrame([[_latex_cell(cell) for cell in row] for row in rows])
    text: str = cells.to_latex(
        index=False,
        header=[*map(_latex_cell, head)],
        escape=False,
        caption=in_latex(caption),
        label=f"tab:{label}",
        column_format="l" + "r" * (len(head) - 1),
    )
    return "% \\usepackage{booktabs}\n" + text.replace(r"\begin{table}", "\\begin{table}\n\\centering", 1)


def in_latex(text: str) -> str:
    """Return plain text so that LaTeX prints it as it is."""
    return "".join(_LATEX.get(letter, letter) for letter in text)


def _latex_cell(text: str) -> str:
    """Return a cell; its row must not begin with a bracket, which would end the row before it otherwise."""
    bold = len(text) > 4 and text.startswith("**") and text.endswith("**")
    words = in_latex(text.strip("*") if bold else text)
    if bold:
        return rf"\textbf{{{words}}}"
    return f"{{}}{words}" if words.startswith("[") else words


def aligned(rows: Iterable[Sequence[str]]) -> list[str]:
    """Return the lines of a table whose columns stand below each other."""
    table = list(rows)
    widths = [max(map(len, column)) for column in zip_longest(*table, fillvalue="")]
    return ["  ".join(map(str.ljust, row, widths)).rstrip() for row in table]
