import math

import numpy as np

from escort_mj.measuring import measure
from tests.metrics.test_hull_margin import by_hand, polygon

TIME = np.linspace(0.0, 4.0, 9)


def recomputed_escaped(again):
    """Over a mission of `test_recomputed`."""
    around, seen, value, last = again.q - again.target[:, None], np.zeros((0, again.p)), 0.0, -1
    for row in reversed(range(again.steps)):
        points = around[row][again.alive[row]]
        moved = np.linalg.norm(points - seen, axis=1).max() if len(points) == len(seen) else math.inf
        if value + moved >= 0.0:  # a margin changes by no more than the largest motion of a point
            value, seen = by_hand(points), points
            if value >= 0.0:
                last = row
                break
    return math.inf if last == again.steps - 1 else float(again.time[last + 1])


def escape(make_trace, out, robots=4, axes=2):
    """A target that is outside, straight between two robots, in some samples."""
    q = np.vstack([np.eye(axes), -np.eye(axes)])[:robots] if axes == 3 else polygon(robots, 1.0)
    target = np.zeros((9, axes))
    target[out, :2] = 3.0
    return measure("escaped", make_trace(TIME, robots=robots, axes=axes, q=q, target_position=target))


def test_when_and_between_whom(make_trace):
    assert escape(make_trace, [2, 5, 6, 7, 8])[:3] == (2.5, 2.5, ("robot_1", "robot_2"))
    assert escape(make_trace, [6, 7, 8], robots=6, axes=3)[:3] == (3.0, 3.0, ())
    assert escape(make_trace, range(9))[:2] == (0.0, 0.0)


def test_one_that_comes_back_has_not_escaped(make_trace):
    found = escape(make_trace, [2, 3, 7])
    assert (found.value, found.reason) == (math.inf, "never escapes")


def test_it_escapes_when_a_robot_is_lost(make_trace):
    lost = np.zeros((9, 4))
    lost[5:, 0] = 1.0
    trace = make_trace(TIME, robots=4, q=polygon(4), lost=lost, target_position=(0.1, 0.0))
    assert measure("escaped", trace)[:3] == (2.5, 2.5, ("robot_2", "robot_4"))
    assert measure("escaped", trace, before=2.0).value == math.inf
