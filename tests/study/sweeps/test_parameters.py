"""Numbers in the place of names in braces."""

import pytest

from escort_mj.study.sweeps.values import filled


@pytest.mark.parametrize(
    ("value", "expected"), [(2, "2*t"), (-2, "(-2)*t"), ({}, "{}*t"), ([1], "[1]*t"), ("x", "'x'*t")]
)
def test_what_is_no_number_stands_in_a_text_as_it_is(value: object, expected: str) -> None:
    """So that whoever reads the text refuses it."""
    assert filled("{a}*t", {"a": value}) == expected
