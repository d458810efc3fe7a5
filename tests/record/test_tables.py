"""Tables as text."""

import csv
import io

import pytest

from escort_mj.record.tables import aligned, comma_separated, in_latex, latex, markdown


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


def test_latex_prints_every_sign_as_it_is() -> None:
    assert in_latex("a_b & 5 % of $R^2$ ~ {#1} \\ 1 ± 2") == (
        r"a\_b \& 5 \% of \$R\textasciicircum{}2\$ \textasciitilde{} \{\#1\} \textbackslash{} 1 $\pm$ 2"
    )


def test_a_table_for_latex() -> None:
    lines = latex(
        ["", "PD_1"], [["rms e", "**1.5 ± 0.2 mm**"], ["share", "[0, 1]"]], "50 % better", "cells-1"
    ).splitlines()
    body = [line.strip() for line in lines]
    assert (
        body[1] == r"\begin{table}" and r"\caption{50 \% better}" in body and r"\begin{tabular}{lr}" in body
    )
    assert r"\label{tab:cells-1}" in body
    assert body[body.index(r"\toprule") + 1 : body.index(r"\bottomrule")] == [
        r" & PD\_1 \\".strip(),
        r"\midrule",
        r"rms e & \textbf{1.5 $\pm$ 0.2 mm} \\",
        r"share & {}[0, 1] \\",
    ]
