"""Values of quantities in words."""

import math

from escort_mj.study.sweeps.quantities import value_text


def test_numbers_are_written_for_people():
    assert value_text(None) == value_text(math.nan, "m") == "-"
    assert value_text(math.inf, "s") == "never"
    assert value_text(0.00123, "m") == "1.23 mm"
    assert value_text(0.0869, "m/s") == "86.9 mm/s"
    assert value_text(19946.3, "N/s") == "19946 N/s"
    assert value_text(0.0, "1") == "0"
