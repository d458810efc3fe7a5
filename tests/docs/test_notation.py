"""docs/notation.md: every name is one of the code, with its unit and shape; every symbol means one thing."""

import re
from collections import Counter

import pytest

from escort_mj.scenario.reader.files.paths import locate
from escort_mj.signals import SIGNALS
from tests.docs.pages import ROOT

PAGE = (ROOT / "docs" / "notation.md").read_text(encoding="utf-8")
ROWS = [
    [cell.strip() for cell in line.strip("|").split("|")]
    for line in PAGE.splitlines()
    if line.startswith("|") and "`" in line
]
OF_SIGNALS = [row for row in ROWS if len(row) == 6]
OF_KEYS = [row for row in ROWS if len(row) == 4]
SIZES = {"robot": "n", "axis": "p", "axis_2": "p", "obstacle": "m", "behavior": "b", "group": "g"}
BY_NAME = {signal.name: signal for signal in SIGNALS}


@pytest.mark.parametrize("row", OF_SIGNALS, ids=lambda row: row[1])
def test_signals(row: list[str]) -> None:
    signal = BY_NAME[row[1].strip("`")]
    assert row[3] == signal.unit
    assert row[4] == " × ".join(SIZES[dim] for dim in signal.dims)
    assert row[5] == ("world" if "axis" in signal.dims else "")


@pytest.mark.parametrize("row", OF_KEYS, ids=lambda row: row[1])
def test_keys(row: list[str]) -> None:
    path = [int(part) if part.isdigit() else part for part in re.findall(r"[\w]+", row[1].strip("`"))]
    if path[0] == "controller":
        path.insert(1, "apd_smc")
    if path[:2] == ["mission", "behaviors"]:
        path.insert(3, "chords")
    location = locate(tuple(path))
    assert location.field is not None, f"{row[1]} is no key"
    units = re.findall(r"\[([^]]+)\]", location.meaning)
    assert row[3] == "1" or row[3] in units


def test_no_symbol_and_no_name_twice() -> None:
    assert len(OF_SIGNALS) > 20 and len(OF_KEYS) > 10
    for column in (0, 1):
        twice = [cell for cell, count in Counter(row[column] for row in ROWS).items() if cell and count > 1]
        assert not twice
