"""docs/equations.md: all equations, each with files that say that they have it, and with what judges it."""

import re
from typing import NamedTuple

import pytest

from escort_mj.metrics import METRIC_NAMES
from escort_mj.study.sweeps.definition import load_study
from tests.docs.pages import ROOT

CLAIMS = load_study(ROOT / "scenarios" / "studies" / "paper.yaml").study.expect
PAGE = (ROOT / "docs" / "equations.md").read_text(encoding="utf-8")
_ROW = re.compile(r"^\| (\d+) \|(.*)\|$", flags=re.MULTILINE)


class Row(NamedTuple):
    """One equation of the page; text as it stands there."""

    number: int
    printed: str
    used: str
    why: str
    files: str
    judged: str


ROWS = [
    Row(int(number), *(cell.strip() for cell in re.split(r"(?<!\\)\|", rest)))
    for number, rest in _ROW.findall(PAGE)
]


def equations_in(text: str) -> set[int]:
    """Numbers of the equations that a text cites: `eq. 4`, `eqs. 3, 23-24`."""
    found: set[int] = set()
    for cited in re.findall(r"\beqs?\. ((?:\d+(?:-\d+)?(?:, | and )?)+)", text):
        for first, last in re.findall(r"(\d+)(?:-(\d+))?", cited):
            found.update(range(int(first), int(last or first) + 1))
    return found


def test_the_page_has_all_equations_and_says_how_each_is_judged() -> None:
    assert sorted(row.number for row in ROWS) == list(range(1, 27))
    for row in ROWS:
        assert row.printed and row.used and row.files and row.judged.startswith(("yes: ", "no: ")), row.number
        assert row.why or row.used.startswith("the same"), row.number


@pytest.mark.parametrize("row", ROWS, ids=lambda row: str(row.number))
def test_its_files_have_the_equation(row: Row) -> None:
    for file in re.findall(r"`([\w/.]+)`", row.files):
        assert row.number in equations_in((ROOT / file).read_text(encoding="utf-8")), file


@pytest.mark.parametrize("row", ROWS, ids=lambda row: str(row.number))
def test_what_judges_it_is_there(row: Row) -> None:
    tests = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "tests").rglob("test_*.py"))
    for name in re.findall(r"`([\w/.]+)`", row.judged):
        if "/" in name:
            assert (ROOT / name).is_file(), name
        else:
            assert name == "truth" or name in METRIC_NAMES or f"def {name}(" in tests, name
    for words in re.findall(r'"([^"]+)"', row.judged):
        assert any(words in one.claim for one in CLAIMS), words


def test_citations_are_read() -> None:
    assert equations_in("(paper eqs. 3, 23-24); see eq. 9") == {3, 9, 23, 24}
