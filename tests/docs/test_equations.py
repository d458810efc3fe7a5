"""docs/equations.md: each file is there, and says that it has the equation."""

import re

import pytest

from tests.docs.pages import ROOT

PAGE = (ROOT / "docs" / "equations.md").read_text(encoding="utf-8")
ROWS = re.findall(r"^\| (\d+) \|[^|]*\| `([\w/.]+)` \|$", PAGE, flags=re.MULTILINE)


def equations_in(text: str) -> set[int]:
    """Numbers of the equations that a text cites: `eq. 4`, `eqs. 3, 23-24`."""
    found: set[int] = set()
    for cited in re.findall(r"\beqs?\. ((?:\d+(?:-\d+)?(?:, | and )?)+)", text):
        for first, last in re.findall(r"(\d+)(?:-(\d+))?", cited):
            found.update(range(int(first), int(last or first) + 1))
    return found


def test_every_equation_has_one_file() -> None:
    numbers = [int(number) for number, _ in ROWS]
    assert numbers == sorted(set(numbers)) and {2, 3, 4, 5, 7, 9, 10, 17, 19, 23, 24} <= set(numbers)


@pytest.mark.parametrize(("number", "file"), ROWS)
def test_the_file_has_the_equation(number: str, file: str) -> None:
    assert int(number) in equations_in((ROOT / "escort_mj" / file).read_text(encoding="utf-8"))


def test_citations_are_read() -> None:
    assert equations_in("(paper eqs. 3, 23-24); see eq. 9") == {3, 9, 23, 24}
