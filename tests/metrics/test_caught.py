import math

import numpy as np

from escort_mj.measuring import measure
from tests.metrics.motions import TIME


def recomputed_caught(again):
    """Over a mission of `test_recomputed`."""
    gaps = np.min([again.gaps(i, again.n) for i in range(again.n)], axis=0)
    steps = np.flatnonzero(gaps <= 0.0)
    return float(again.time[steps[0]]) if len(steps) else math.inf


def test_the_first_touch_of_the_target_by_a_robot(make_trace):
    rows = [
        [0, 1, 1.0, 1.1, 0.1, 30.0, 1.05, 0.2, 1e-3, 0.5],  # robots
        [2, 3, 2.0, 2.1, 0.1, 30.0, 2.05, 0.2, 1e-3, 0.5],  # target and rock
        [1, 2, 3.0, 5.0, 2.0, 30.0, 3.05, 0.2, 1e-3, 0.5],
        [0, 2, 4.0, 6.0, 2.0, 30.0, 4.05, 0.2, 1e-3, 0.5],
    ]
    trace = make_trace(TIME, robots=2, obstacles=1, episodes=rows)
    assert measure("caught", trace)[:3] == (3.0, 3.0, ("robot_2",))
    assert measure("caught", trace, after=4.5)[:3] == (4.5, 4.5, ("robot_2",)), "touched since before"
    assert measure("caught", trace, after=5.5).bodies == ("robot_1",)
    never = measure("caught", trace, before=2.5)
    assert (never.value, never.reason) == (math.inf, "never caught")
