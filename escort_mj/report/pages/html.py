"""HTML of reports: one file that needs nothing beside it, for screens of either brightness and for paper.

Templates lay pages out; what they are handed is text until it stands there, unless it is `Markup`.
"""

from __future__ import annotations

import base64
from collections.abc import Iterator, Sequence
from functools import cache
from itertools import zip_longest
from pathlib import Path
from typing import Any, NamedTuple

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from escort_mj.errors import UsageError
from escort_mj.expect.verdicts import mark
from escort_mj.files import check_place
from escort_mj.record.outcome import Verdict

HERE = Path(__file__).parent
TYPES = {".svg": "image/svg+xml", ".png": "image/png", ".mp4": "video/mp4"}


class Text(NamedTuple):
    """One cell of a table.

    Attributes:
        shown: What stands there.
        value: What it is sorted by; None: by what stands there.
        kind: Class of the cell: `number`, `word`, `message`, or empty.
    """

    shown: str
    value: float | None = None
    kind: str = ""

    @property
    def order(self) -> str | None:
        """The value as JavaScript reads it; what is missing comes last."""
        if self.value is None:
            return None
        return "Infinity" if self.value != self.value else repr(self.value).replace("inf", "Infinity")


class Table(NamedTuple):
    """A table; the first cell of each row is its heading.

    Attributes:
        caption: What it shows.
        head: Heading of each column, and what it means in full.
        rows: Their cells.
        sortable: Whether a click on a heading sorts it.
    """

    caption: str
    head: Sequence[tuple[str, str]]
    rows: Sequence[Sequence[Text]]
    sortable: bool = True

    @property
    def columns(self) -> Iterator[tuple[str, str, str]]:
        """Heading, meaning and kind of each column."""
        kinds = [cell.kind for cell in self.rows[0]] if self.rows else []
        return ((*words, kind) for words, kind in zip_longest(self.head, kinds, fillvalue=""))


def asset(name: str) -> str:
    """A script or a style sheet that comes with the package."""
    return (HERE / "assets" / name).read_text(encoding="utf-8")


def embedded(path: Path) -> str:
    """A file as an address that holds it."""
    return f"data:{TYPES[path.suffix]};base64,{base64.b64encode(path.read_bytes()).decode()}"


@cache
def templates() -> Environment:
    """The templates of all pages, and what they may call."""
    found = Environment(
        loader=FileSystemLoader(HERE / "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    found.policies["json.dumps_kwargs"] = {"allow_nan": False, "separators": (",", ":")}
    found.globals |= {"asset": asset, "embedded": embedded}
    return found


def page_file(out: Path | None, usual: Path) -> Path:
    """Return the file of a page: as it was asked for, or the usual one.

    Raises:
        UsageError: If its suffix says that it is something else, or it cannot be written there.
    """
    if out is not None and out.suffix not in ("", ".html", ".htm"):
        raise UsageError(f"{out}: found the suffix {out.suffix}; a page is HTML, as FILE.html")
    if out is not None:
        check_place(out)
    return usual if out is None else out


def page(template: str, parts: dict[str, Any]) -> str:
    """A whole page.

    Args:
        template: File of `templates/` that lays it out.
        parts: What it names; `scripts` and `styles` are assets that the page has beside those of all pages.
    """
    return templates().get_template(template).render({"scripts": (), "styles": ()} | parts)


COLORS = {"pass": "#1b7a3d", "xfail": "#1b7a3d", "skip": "#777777"}
FAILED = "#b00020"


def run_in_html(
    name: str, words: str, passed: bool, verdicts: Sequence[Verdict], picture: bytes | None = None
) -> str:
    """A run as HTML of a cell.

    Args:
        name: Of the run.
        words: How it ended.
        passed: Whether every verdict holds.
        verdicts: What was expected.
        picture: A PNG; None for none.
    """
    cell = Markup('<td style="text-align:left;color:{}">{}</td>')
    rows = []
    for one in verdicts:
        color = COLORS.get(mark(one), FAILED)
        cells = [cell.format(color, mark(one))]
        cells += [cell.format("inherit", words) for words in (one.metric, one.demanded, one.found)]
        rows.append(Markup("<tr>{}</tr>").format(Markup("").join(cells)))
    color = COLORS["pass"] if passed else FAILED
    head = Markup('<b>{}</b>: <span style="color:{}">{}</span>').format(name, color, words)
    table = Markup("<table>{}</table>").format(Markup("").join(rows))
    parts = [Markup("<div>{}</div>").format(head), table]
    if picture is not None:
        data = base64.b64encode(picture).decode()
        parts.append(Markup('<img alt="paths" src="data:image/png;base64,{}">').format(data))
    return str(Markup("").join(parts))
