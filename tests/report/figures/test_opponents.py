"""Paths of opponents: one that a robot intercepts, one that reaches the target, and one that waits."""

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from escort_mj import palette, run
from tests.metrics.motions import MISSIONS
from tests.report.figures.test_knowledge import drawn, words


@pytest.mark.parametrize("axes", [2, 3])
def test_ways_of_opponents_and_what_became_of_them(compiled: None, axes: int) -> None:
    given = MISSIONS["opponents"]
    rest = [0.0] * (axes - 2)
    robots = {"positions": [[*place, *rest] for place in given["robots"]["positions"]]}
    opponents = [
        group | {"positions": [[*place, *rest] for place in group["positions"]]}
        for group in given["opponents"]
    ]
    target = {"position": [0.0] * axes, "radius": 0.3}
    trace = run(given | {"axes": axes, "robots": robots, "opponents": opponents, "target": target}).trace
    canvas = drawn(trace, "paths")
    assert {"opponent", "intercepted", "reached the target"} < words(canvas)
    assert not {"obstacle", "safe distance"} & words(canvas)
    lines = [line for line in canvas.axes[0].lines if to_rgb(line.get_color()) == palette.OPPONENT]
    marks = {line.get_marker(): line for line in lines if line.get_marker() in "X*" and len(line.get_xdata())}
    status, way = trace["opponent_status"].values, trace["obstacle_position"].values
    for mark, end in (("X", 2), ("*", 3)):
        row, number = np.argwhere(status == end)[0]
        place = np.ravel(marks[mark].get_data_3d() if axes == 3 else marks[mark].get_data())
        np.testing.assert_allclose(place, way[row, number], atol=1e-12)
