"""How fast robots may come nearer to bodies, and how they let faster ones pass."""

import numpy as np
import pytest

from escort_mj.control.outer_loops.passing import Rules, approach, aside_of, breadth, leave_path
from escort_mj.native.vectors import Vec
from tests.oracle.constraints import left_path, widths


@pytest.mark.parametrize("axes", [2, 3])
def test_a_path_is_left_on_the_side_where_the_robot_is_or_goes(axes: int) -> None:
    rng = np.random.default_rng(axes)
    rules = Rules(4.0, 3.0, 0.0, 1.0, 0.0, 0.0)
    for _ in range(100):
        x, v, motion = rng.normal(scale=2.0, size=(3, axes))
        motion *= np.sign(motion @ x)
        apart, reach = float(np.linalg.norm(x)), float(rng.uniform(0.1, 2.0))
        away, needed = left_path(x, reach, v, motion, rules)
        speed, other, away_from = (Vec(tuple(each)) for each in (v, motion, x / apart))
        by_kernel, direction = leave_path(apart, reach, speed, other, rules, away_from)
        np.testing.assert_allclose([*direction], away, atol=1e-12)
        assert by_kernel == pytest.approx(needed, abs=1e-12)
        assert away @ motion == pytest.approx(0.0, abs=1e-12)
        assert left_path(x, reach, 0.0 * v, motion, rules)[0] @ x > 0.0
        assert left_path(x, reach, 1e3 * v, motion, rules)[0] @ v > 0.0, "it cannot turn back in time"
    ahead, left = np.eye(axes)[:2]
    head_on, needed = left_path(ahead, 0.5, 0.0 * ahead, ahead, rules)
    assert (head_on == left).all() and needed == 2.0


def test_the_approach_stops_in_time() -> None:
    """Proportional near the safe distance, then v^2 / 2 = braking * way; both parts meet with one slope."""
    rules = Rules(4.0, 2.0, 0.0, 1.0, 0.0, 0.0)
    margins = np.linspace(-0.5, 3.0, 701)
    speeds = np.array([approach(float(margin), rules) for margin in margins])
    near = margins <= 2.0 / 16.0
    np.testing.assert_allclose(speeds[near], 4.0 * margins[near], atol=1e-12)
    deceleration = speeds[1:-1] * (speeds[2:] - speeds[:-2]) / (margins[2:] - margins[:-2])
    assert deceleration[margins[1:-1] > 0.13] == pytest.approx(2.0, rel=1e-3)
    assert deceleration.max() < 2.002 and (np.diff(speeds) > 0.0).all()


def test_what_a_box_sweeps_is_as_wide_as_its_corners() -> None:
    rng = np.random.default_rng(5)
    for _ in range(50):
        extent, motion = rng.uniform(0.1, 2.0, 2), rng.normal(size=2)
        across = np.array([-motion[1], motion[0]]) / np.linalg.norm(motion)
        corners = extent * np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])
        wide = breadth(extent, motion, float(np.linalg.norm(motion)))
        assert wide == pytest.approx((corners @ across).max())
        assert widths(extent, motion) == pytest.approx(wide, abs=1e-12)


def test_fleeing_ahead_leaves_the_speed_limit_its_rest() -> None:
    assert aside_of(-1.0, 2.0) == 2.0
    assert aside_of(0.6, 1.0) == pytest.approx(0.8)
    assert aside_of(1.0, 1.0) == 0.0
