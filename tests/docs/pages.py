"""What stands in the pages: fenced blocks, each with its place."""

import re
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
RUN = "<!-- run -->"  # before a block of Python that a test runs

_FENCE = re.compile(
    r"^(?P<indent> *)(?P<ticks>```+)(?P<kind>[\w{}-]*)[^\n]*\n(?P<text>.*?)^(?P=indent)(?P=ticks)$",
    re.MULTILINE | re.DOTALL,
)


class Block(NamedTuple):
    """A fenced block.

    Attributes:
        place: Page and line, for people.
        kind: What the fence says it is; empty for what is typed into a terminal, and what is none of these.
        text: What is in it.
        runs: Whether it is marked to be run.
    """

    place: str
    kind: str
    text: str
    runs: bool


_FILE = re.compile(r"<!-- file: (\S+) -->\n```\w+\n(.*?)```", re.DOTALL)


def write_files(page: str, folder: Path) -> None:
    """Write what a page has its readers save as files."""
    for name, text in _FILE.findall((ROOT / page).read_text(encoding="utf-8")):
        (folder / name).write_text(text)


def blocks(*kinds: str) -> list[Block]:
    """All blocks of these kinds."""
    found = []
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        for match in _FENCE.finditer(text):
            line = text.count("\n", 0, match.start()) + 1
            before = text[: match.start()].rstrip().endswith(RUN)
            inside = re.sub(rf"^{match['indent']}", "", match["text"], flags=re.MULTILINE)
            found.append(Block(f"{page.relative_to(ROOT)}:{line}", match["kind"], inside, before))
    return [block for block in found if block.kind in kinds]
