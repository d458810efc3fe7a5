"""The figure of `vertices` turns to fit the robots, wherever it begins."""

import numpy as np
import pytest

from tests.oracle.behaviors import turned_rotation


@pytest.mark.parametrize("axes", [2, 3, 5])
@pytest.mark.parametrize("angle", [0.3, 1.2, np.radians(89.9), np.radians(89.9999)])
def test_a_figure_turns_to_its_robots_from_nearly_a_quarter_turn(axes: int, angle: float) -> None:
    vertices = np.vstack([np.eye(axes), -np.eye(axes)])
    turn = np.eye(axes)
    turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    rotation = np.eye(axes)
    for _ in range(60):
        rotation = turned_rotation(rotation, 3.0 * vertices @ turn.T, np.zeros(axes), vertices)
        assert np.abs(rotation).max() < 1.5
    assert rotation == pytest.approx(turn, abs=1e-9)
