"""Tables as text."""

import csv
import io

import pytest

from escort_mj.record.tables import aligned, comma_separated, markdown


@pytest.mark.parametrize("formula", ["=1+1", "+cmd|' /C calc'!A0", "-2+3", "@SUM(A1)", "\t=1", " =1", "\n=1"])
def test_no_spreadsheet_runs_a_cell(formula: str) -> None:
    ((cell,),) = csv.reader(io.StringIO(comma_separated([[formula]]), newline=""))
    assert cell == f"'{formula}"


def test_numbers_and_other_text_stay_as_they_are() -> None:
    row = [-1.5, "-1.5", "+1e3", "-inf", "a=b", 'a-b, "c"', None, True, 0.1 + 0.2]
    (found,) = csv.reader([comma_separated([row])])
    assert found == ["-1.5", "-1.5", "+1e3", "-inf", "a=b", 'a-b, "c"', "", "True", "0.30000000000000004"]


def test_no_cell_breaks_out_of_its_row() -> None:
    assert [*csv.reader(io.StringIO(comma_separated([["a\r=1", "b\r\nc"]]), newline=""))] == [
        ["a\n=1", "b\nc"]
    ]


def test_columns_of_a_terminal_stand_below_each_other() -> None:
    assert aligned([("a", "bb", "c"), ("dddd", "", "e"), ("", "f", "")]) == [
        "a     bb  c",
        "dddd      e",
        "      f",
    ]
    assert aligned([]) == []


def test_no_bar_ends_a_cell_of_markdown() -> None:
    assert markdown(["|e|", "n"], [["1", "2|3"]]) == ["| \\|e\\| | n |", "| --- | --- |", "| 1 | 2\\|3 |"]
