"""Lines and planes cut to a box, and the part of a rectangle behind them."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from escort_mj.report.video.cuts import behind, cut, hatched


def vectors(axes: int, size: float):
    return arrays(float, axes, elements=st.floats(-size, size))


def area(points):
    """Of a polygon in the plane, by the shoelace formula."""
    (x, y), (u, v) = points.T, np.roll(points, -1, axis=0).T
    return 0.5 * abs((x * v - u * y).sum())


@pytest.mark.parametrize("axes", [2, 3])
@given(data=st.data())
def test_corners_are_on_the_plane_and_on_the_box_in_order(axes, data):
    point, normal = data.draw(vectors(axes, 2.0)), data.draw(vectors(axes, 1.0))
    assume(np.linalg.norm(normal) > 0.1)
    low, high = -np.arange(1.0, axes + 1.0), np.full(axes, 1.5)
    found = cut(point, normal, low, high)
    assert found.shape[1] == axes and len(found) in ((0, 2) if axes == 2 else (0, 3, 4, 5, 6))
    assert np.abs((found - point) @ normal).max(initial=0.0) < 1e-9
    assert ((found > low - 1e-9) & (found < high + 1e-9)).all()
    rim = np.minimum(np.abs(found - low), np.abs(found - high)).min(axis=1, initial=np.inf)
    assert (rim < 1e-9).all()
    if len(found) > 3:  # neighbors share a face
        shared = [
            np.isclose(found, np.roll(found, -1, axis=0)) & np.isclose(found, end) for end in (low, high)
        ]
        assert np.any(shared, axis=(0, 2)).all()


def test_known_cuts():
    low, high = np.zeros(2), np.array([4.0, 2.0])
    line = cut(np.array([0.0, 1.5]), np.array([0.0, -3.0]), low, high)
    np.testing.assert_allclose(line[np.argsort(line[:, 0])], [[0.0, 1.5], [4.0, 1.5]])
    assert not len(cut(np.array([0.0, 2.5]), np.array([0.0, -1.0]), low, high))
    corners = cut(np.zeros(3), np.ones(3), -np.ones(3), np.ones(3))  # the hexagon across a cube
    assert len(corners) == 6 and np.allclose(np.linalg.norm(corners, axis=1), np.sqrt(2.0))
    assert np.allclose(np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1), np.sqrt(2.0))


@given(point=vectors(2, 2.0), angle=st.floats(0.0, 6.28))
def test_the_two_sides_of_a_line_make_up_the_rectangle(point, angle):
    low, high = np.array([-1.0, -2.0]), np.array([3.0, 1.0])
    normal = np.array([np.cos(angle), np.sin(angle)])
    sides = [behind(point, sign * normal, low, high) for sign in (1.0, -1.0)]
    assert sum(area(side) for side in sides if len(side)) == pytest.approx(12.0)
    for sign, side in zip((1.0, -1.0), sides, strict=True):
        assert (sign * (side - point) @ normal < 1e-9).all()


def test_lines_across_a_square():
    square = np.array([[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [2.0, 2.0, 1.0], [0.0, 2.0, 1.0]])
    lines = list(hatched(square, 0.5))
    assert len(lines) >= 6
    assert all((line[:, 2] == 1.0).all() and np.linalg.norm(line[1] - line[0]) > 0.1 for line in lines)
