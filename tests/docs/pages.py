"""What stands in the pages: fenced blocks, each with its place."""

import re
import shutil
from pathlib import Path
from typing import NamedTuple

from escort_mj.cli.listing import reference_pages

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
REFERENCE = {DOCS / name: text for name, text in reference_pages().items()}
"""Pages that are made when the site is built."""
SITE = sorted({*DOCS.glob("*.md"), *REFERENCE})
PAGES = [ROOT / "README.md", *SITE]
RUN = "<!-- run -->"  # before a block of Python that a test runs

_FENCE = re.compile(
    r"^(?P<indent> *)(?P<ticks>```+)(?P<kind>[\w{}-]*)[^\n]*\n(?P<text>.*?)^(?P=indent)(?P=ticks)$",
    re.MULTILINE | re.DOTALL,
)


def text_of(page: Path) -> str:
    """What stands in a page."""
    return REFERENCE[page] if page in REFERENCE else page.read_text(encoding="utf-8")


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
    """Write what a page has its readers save as files, and the scenery of the shipped depot."""
    shutil.copy(ROOT / "scenarios/worlds/depot.xml", folder)
    for name, text in _FILE.findall((ROOT / page).read_text(encoding="utf-8")):
        (folder / name).write_text(text)


def blocks(*kinds: str) -> list[Block]:
    """All blocks of these kinds."""
    found = []
    for page in PAGES:
        text = text_of(page)
        for match in _FENCE.finditer(text):
            line = text.count("\n", 0, match.start()) + 1
            before = text[: match.start()].rstrip().endswith(RUN)
            inside = re.sub(rf"^{match['indent']}", "", match["text"], flags=re.MULTILINE)
            found.append(Block(f"{page.relative_to(ROOT)}:{line}", match["kind"], inside, before))
    return [block for block in found if block.kind in kinds]
