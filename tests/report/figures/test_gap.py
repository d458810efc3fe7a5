"""The picture of a target that gets out of its team."""

import math

import numpy as np
import pytest

from escort_mj.report.figures.figures import plots_of
from tests.metrics.motions import ring
from tests.report.figures.test_knowledge import drawn, words
from tests.synthetic import make_trace

TIME = np.arange(0.0, 10.0, 0.005)
DRIVEN = {"body_motions": [*["free"] * 4, "driven", "still"]}


def test_gap_and_depth_of_a_target_that_moves_by_forces():
    """It runs out between robots 1 and 2, which touches it."""
    target = TIME[:, None] * [0.4, 0.4]
    touch = [1, 4, 5.0, 5.1, 0.1, 30.0, 5.05, 0.2, 1e-3, 0.5]
    given = {"q": ring(4, time=TIME), "target_position": target, "episodes": [touch]}
    trace = make_trace(TIME, robots=4, about=DRIVEN, **given)
    assert "gap" not in plots_of(make_trace(TIME, robots=4, **given)), "a target that is led"
    canvas = drawn(trace, "gap")
    angle, depth = canvas.axes
    time, gaps = angle.lines[0].get_data()
    assert len(time) <= 600 and gaps[0] == pytest.approx(0.5 * math.pi)
    assert gaps[np.searchsorted(time, 6.25)] == pytest.approx(math.pi, abs=0.02)
    np.testing.assert_allclose(depth.lines[0].get_ydata(), (5.0 - 0.8 * time) / math.sqrt(2.0), atol=1e-9)
    assert words(canvas) == {"caught (robot 2)", "escaped (robots 1 and 2)"}
