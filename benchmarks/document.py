"""Tables measured by a benchmark, and their places in the docs: nobody types them."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import escort_mj
from escort_mj.record.tables import markdown

if TYPE_CHECKING:
    import pandas

DOCS = Path(__file__).parents[1] / "docs"


def table(head: list[str], rows: Iterable[list[str]]) -> str:
    """A Markdown table."""
    return "\n".join(markdown(head, rows))


def table_of(rows: Iterable[Mapping[str, Any]], columns: Mapping[str, str]) -> str:
    """A table of what was measured: by head, the format of its cells, which names entries of the rows."""
    return table([*columns], ([form.format_map(row) for form in columns.values()] for row in rows))


def swept(study: Mapping[str, Any] | str) -> pandas.DataFrame:
    """Makes the runs of a study that are missing; a row each."""
    return escort_mj.sweep(study, confirmed=True).table


def grid(
    runs: pandas.DataFrame,
    row: str,
    column: str,
    cell: Callable[[pandas.DataFrame], str],
    name: Callable[[Any], str] = str,
) -> list[list[str]]:
    """The runs of a study as a table: a row per level of one factor, a column per level of another."""
    columns = runs[column].unique()
    return [
        [name(level), *(cell(some[some[column] == each]) for each in columns)]
        for level, some in runs.groupby(row, sort=False)
    ]


def several(values: Iterable[float]) -> str:
    """Numbers that share a cell."""
    return " / ".join(f"{value:.2g}" for value in values)


def parser_for(description: str | None, page: str) -> argparse.ArgumentParser:
    """The command line of a benchmark: whether the tables are to be written into their page."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--docs", action="store_true", help=f"write the tables into docs/{page}")
    return parser


def wants_docs(description: str | None, page: str) -> bool:
    """Reads a command line that has nothing else: whether to write the tables into their page."""
    return bool(parser_for(description, page).parse_args().docs)


def measure_page(description: str | None, page: str, tables: Callable[[], Mapping[str, str]]) -> None:
    """Measures tables, prints them, and writes them into their page if the command line says so."""
    write = wants_docs(description, page)
    publish(page, tables(), write)


def publish(page: str, tables: Mapping[str, str], write: bool) -> None:
    """Prints tables by name, and puts them between the marks of their names in a page of the docs."""
    path = DOCS / page
    text = path.read_text(encoding="utf-8")
    for name, found in tables.items():
        print(f"{name}\n\n{found}\n")
        place = re.compile(rf"(<!-- {name} -->\n).*?(\n<!-- end -->)", re.DOTALL)
        text, count = place.subn(r"\g<1>" + found.replace("\\", r"\\") + r"\g<2>", text)
        if count != 1:
            raise SystemExit(f"{path} has {count} places for {name}")
    if write:
        path.write_text(text, encoding="utf-8")
        print(f"wrote {path}")
