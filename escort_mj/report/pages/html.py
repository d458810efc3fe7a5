"""HTML of reports: one file that needs nothing beside it, for screens of either brightness and for paper."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path
from typing import NamedTuple

ASSETS = Path(__file__).parent / "assets"
TYPES = {".svg": "image/svg+xml", ".png": "image/png"}

STYLE = """
:root {
  color-scheme: light dark;
  --ink: #1c2024; --soft: #5a636e; --line: #d9dde2; --back: #ffffff; --band: #f4f6f8; --bad: #b00020;
  --good: #00684d; --link: #005ea8;
}
@media (prefers-color-scheme: dark) {
  :root {
    --ink: #e6e8eb; --soft: #a3adb8; --line: #3a4149; --back: #16191d; --band: #20252b; --bad: #ff8a80;
    --good: #6fd3b0; --link: #7cc0ff;
  }
}
body {
  font: 15px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--back);
  margin: 2rem auto; max-width: 76rem; padding: 0 1.2rem;
}
h1 { margin-bottom: .2rem; }
h2 { margin-top: 2.4rem; border-bottom: 1px solid var(--line); }
p, dl { max-width: 60rem; }
.soft, figcaption { color: var(--soft); }
.bad { color: var(--bad); font-weight: 600; }
a { color: var(--link); }
code { font-size: .92em; background: var(--band); padding: .1em .3em; user-select: all; }
code { overflow-wrap: anywhere; }
dt { font-weight: 600; }
dd { margin: 0 0 .3rem 1.2rem; overflow-wrap: anywhere; }
summary { cursor: pointer; margin: .6rem 0; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: .9rem; margin: .6rem 0; }
caption { text-align: left; color: var(--soft); padding-bottom: .3rem; }
th, td { padding: .25rem .7rem; text-align: left; border-bottom: 1px solid var(--line); vertical-align: top; }
thead th { background: var(--band); vertical-align: bottom; }
td.number { text-align: right; font-variant-numeric: tabular-nums; }
td.number, .word { white-space: nowrap; }
thead th.number { text-align: right; }
td.message { min-width: 22rem; }
th button { all: unset; cursor: pointer; }
th button:focus-visible { outline: 2px solid var(--link); }
th[aria-sort=ascending] button::after { content: " \\2191"; }
th[aria-sort=descending] button::after { content: " \\2193"; }
tbody tr:hover { background: var(--band); }
figure { margin: 1.2rem 0; }
figure img { width: min(100%, 60rem); height: auto; background: #fff; border-radius: 4px; }
@media print {
  body { margin: 0; max-width: none; font-size: 10px; }
  figure, tr { break-inside: avoid; }
  .wide { overflow: visible; }
  td.message { min-width: 0; }
}
"""

# Sorts a table by a column; without scripts the tables stand as they are.
SCRIPT = """
for (const table of document.querySelectorAll("table.sortable")) {
  const heads = [...table.tHead.rows[0].cells];
  heads.forEach((head, column) => {
    const button = document.createElement("button");
    button.append(...head.childNodes);
    head.append(button);
    button.addEventListener("click", () => {
      const up = head.getAttribute("aria-sort") !== "ascending";
      heads.forEach(other => other.removeAttribute("aria-sort"));
      head.setAttribute("aria-sort", up ? "ascending" : "descending");
      const key = row => row.cells[column].dataset.value ?? row.cells[column].textContent;
      const rows = [...table.tBodies[0].rows].sort((a, b) => {
        const [x, y] = [key(a), key(b)], numbers = Number(x) - Number(y);
        return (up ? 1 : -1) * (Number.isNaN(numbers) ? x.localeCompare(y) : numbers || 0);
      });
      table.tBodies[0].append(...rows);
    });
  });
}
"""


class Text(NamedTuple):
    """One cell of a table.

    Attributes:
        shown: What stands there.
        value: What it is sorted by; None: by what stands there.
        html: Whether `shown` is HTML already.
        kind: Class of the cell: `number`, `word`, `message`, or empty.
    """

    shown: str
    value: float | None = None
    html: bool = False
    kind: str = ""


def asset(name: str) -> str:
    """A script or a style sheet that comes with the package."""
    return (ASSETS / name).read_text(encoding="utf-8")


def page(title: str, body: Iterable[str], scripts: Sequence[str] = (), styles: Sequence[str] = ()) -> str:
    """A whole page.

    Args:
        title: Its title.
        body: Its parts.
        scripts: Assets that run once it is there, in this order.
        styles: Assets that add to its style.
    """
    style = "\n".join([STYLE, *map(asset, styles)])
    script = "".join(f"<script>\n{text}</script>\n" for text in (SCRIPT, *map(asset, scripts)))
    return "\n".join(
        [
            '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            '<link rel="icon" href="data:,">',  # or browsers ask for one
            f"<title>{escape(title)}</title>\n<style>{style}</style>\n</head>\n<body>\n<main>",
            *body,
            f"</main>\n{script}</body>\n</html>\n",
        ]
    )


def table(
    caption: str, head: Sequence[tuple[str, str]], rows: Iterable[Sequence[Text]], sortable: bool = True
) -> str:
    """A table; the first cell of each row is its heading.

    Args:
        caption: What it shows.
        head: Heading of each column, and what it means in full.
        rows: Their cells.
        sortable: Whether a click on a heading sorts it.
    """
    whole = list(rows)
    kinds = [cell.kind for cell in whole[0]] if whole else [""] * len(head)
    columns = "".join(
        f'<th scope="col"{_attribute("class", kind)}{_attribute("title", meaning)}>{escape(short)}</th>'
        for kind, (short, meaning) in zip(kinds, head, strict=True)
    )
    lines = ["".join(_cell(cell, index == 0) for index, cell in enumerate(row)) for row in whole]
    body = "\n".join(f"<tr>{line}</tr>" for line in lines)
    kind = ' class="sortable"' if sortable and len(lines) > 1 else ""
    return (
        f'<div class="wide" tabindex="0" role="region" aria-label="{escape(caption)}"><table{kind}>'
        f"<caption>{escape(caption)}</caption>\n<thead><tr>{columns}</tr></thead>\n"
        f"<tbody>\n{body}\n</tbody></table></div>"
    )


def _cell(cell: Text, heads: bool) -> str:
    tag = 'th scope="row"' if heads else "td"
    marks = _attribute("class", cell.kind)
    marks += "" if cell.value is None else _attribute("data-value", _sortable(cell.value))
    return f"<{tag}{marks}>{cell.shown if cell.html else escape(cell.shown)}</{tag.split()[0]}>"


def _attribute(name: str, value: str) -> str:
    return f' {name}="{escape(value)}"' if value else ""


def _sortable(value: float) -> str:
    """A number as JavaScript reads it; what is missing comes last."""
    return "Infinity" if value != value else repr(value).replace("inf", "Infinity")


def link(target: str, words: str) -> str:
    """A link."""
    return f'<a href="{escape(target)}">{escape(words)}</a>'


def picture(path: Path, words: str) -> str:
    """A picture, held in the page itself, with its caption."""
    content = base64.b64encode(path.read_bytes()).decode()
    return (
        f'<figure><img alt="{escape(words)}" src="data:{TYPES[path.suffix]};base64,{content}">'
        f"<figcaption>{escape(words)}</figcaption></figure>"
    )


def folded(summary: str, inside: str) -> str:
    """What is seen once it is asked for."""
    return f"<details><summary>{escape(summary)}</summary>\n{inside}\n</details>"
