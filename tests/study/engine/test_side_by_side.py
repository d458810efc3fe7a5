import math
import os
import signal

import pytest

from escort_mj.errors import EscortError
from escort_mj.study.engine.parallel import side_by_side
from escort_mj.study.sweeps.quantities import value_text


def double(number):
    return 2 * number


@pytest.mark.parametrize("workers", [1, 2])
def test_results_come_in_the_order_of_the_items(workers):
    assert side_by_side(double, [3, 1, 2], workers) == [6, 2, 4]
    assert side_by_side(double, [], workers) == []
    large = ["x" * 1_000_000] * 8  # more than a pipe holds
    assert side_by_side(double, large, workers) == [2 * one for one in large]


def kill_itself(item):
    os.kill(os.getpid(), signal.SIGKILL)


def test_a_worker_that_is_killed_is_said_in_one_sentence():
    with pytest.raises(EscortError, match="killed 3 times .killed by SIGKILL; out of memory"):
        side_by_side(kill_itself, [1, 2], 2)


def test_numbers_are_written_for_people():
    assert value_text(None) == value_text(math.nan, "m") == "-"
    assert value_text(math.inf, "s") == "never"
    assert value_text(0.00123, "m") == "1.23 mm"
    assert value_text(0.0869, "m/s") == "86.9 mm/s"
    assert value_text(19946.3, "N/s") == "19946 N/s"
    assert value_text(0.0, "1") == "0"
