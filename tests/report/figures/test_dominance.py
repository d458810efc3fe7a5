"""Dominance regions: against circles of Apollonius and straight races, and as a picture."""

import numpy as np
import pytest
from matplotlib.patches import Circle

from escort_mj import palette
from escort_mj.report.figures.dominance import reaches
from escort_mj.report.figures.figures import plots_of
from tests.report.figures.test_knowledge import drawn, words
from tests.synthetic import make_trace

TIME = np.arange(0.0, 10.0, 0.1)
HEADINGS = np.linspace(0.0, 2.0 * np.pi, 100)


def around(headings):
    return np.column_stack([np.cos(headings), np.sin(headings)])


def test_a_slower_body_has_the_inside_of_a_circle_of_apollonius() -> None:
    here, robot, ratio = np.array([1.0, 2.0]), np.array([[5.0, -1.0]]), 2.0
    rim = here + reaches(here, robot, ratio, HEADINGS)[:, None] * around(HEADINGS)
    center = (ratio**2 * here - robot[0]) / (ratio**2 - 1.0)
    radius = ratio * 5.0 / (ratio**2 - 1.0)
    np.testing.assert_allclose(np.linalg.norm(rim - center, axis=1), radius, rtol=1e-12)


def test_of_equal_speeds_the_bisector_is_the_edge() -> None:
    found = reaches(np.zeros(2), np.array([[4.0, 0.0]]), 1.0, np.array([0.0, 0.5, np.pi]))
    np.testing.assert_allclose(found, [2.0, 2.0 / np.cos(0.5), np.inf])


@pytest.mark.parametrize("ratio", [0.4, 0.9, 1.0, 1.7])
def test_no_robot_is_anywhere_on_the_way_before(ratio: float) -> None:
    random = np.random.default_rng(3)
    here, robots = random.normal(size=2), random.normal(scale=3.0, size=(4, 2))
    lengths = np.minimum(reaches(here, robots, ratio, HEADINGS), 50.0)
    for length, way in zip(lengths, around(HEADINGS), strict=True):
        steps = np.linspace(0.0, length, 400)[:-1]
        gaps = np.linalg.norm((here + steps[:, None] * way)[:, None] - robots, axis=2)
        assert (gaps > ratio * steps[:, None]).all()
        if length < 50.0:
            assert np.linalg.norm(here + length * way - robots, axis=1).min() == pytest.approx(ratio * length)


def test_nobody_left_reaches_nothing_first() -> None:
    assert np.isinf(reaches(np.zeros(2), np.zeros((0, 2)), 1.0, HEADINGS)).all()


def test_the_region_of_a_target_with_a_policy_is_drawn() -> None:
    places = np.array([[5.0, 0.0], [0.0, 5.0], [-5.0, 0.0], [0.0, -5.0]])
    given = {
        "robots": 4,
        "q": np.tile(places, (len(TIME), 1, 1)),
        "target_position": np.zeros((len(TIME), 2)),
    }
    assert "dominance" not in plots_of(make_trace(TIME, **given)), "a target without a policy"
    trace = make_trace(TIME, about={"target_speed": 1.0, "max_speed": 1.0}, **given)
    canvas = drawn(trace, "dominance")
    assert [axes.get_title("left") for axes in canvas.axes][0] == "(a) 0.00 s"
    assert words(canvas) >= {"robot 4", "the target is first"}
    for axes in canvas.axes:
        region, target = axes.patches
        assert np.abs(region.get_xy()).max() == pytest.approx(2.5), "half way to each robot"
        assert isinstance(target, Circle) and target.get_facecolor()[:3] == palette.TARGET
