"""The choice of fast cases."""

from itertools import product

from tests.cases import covering


def test_every_value_is_in_a_fast_case_and_no_case_is_in_vain() -> None:
    cases = [set(enumerate(case)) for case in product("abc", "de", "fghi")]
    chosen = covering(cases)
    assert set().union(*(cases[k] for k in chosen)) == set().union(*cases)
    assert len(chosen) == 4


def test_cases_without_a_common_value_are_all_fast() -> None:
    assert covering([{1, 2}, {3, 4}, {5}]) == {0, 1, 2} and covering([]) == set()
