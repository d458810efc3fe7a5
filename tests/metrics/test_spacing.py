import numpy as np
import pytest

from escort_mj.measuring import measure
from escort_mj.metrics.spacing import SHAPELESS
from tests.metrics.motions import TIME


class TestSpacing:
    def test_a_displaced_robot(self, make_trace):
        q = np.zeros((501, 3, 2))
        q[:, :, 0] = [0.0, 2.0, 4.0]
        q[77, 1, 0] = 2.5  # 0.5 too far from robot 1 and too near to robot 3
        q[:, 2, 0] += 0.1  # always a little too far
        trace = make_trace(TIME, robots=3, q=q, about={"neighbors": [[1, 2], [2, 3]], "spacing": 2.0})
        found = measure("spacing_error_max", trace)
        assert found.value == pytest.approx(0.5)
        assert (found.time, found.who) == (TIME[77], "robots 1 and 2")
        assert measure("spacing_error_mean", trace, after=2.0).value == pytest.approx(0.05)

    def test_without_a_formation(self, make_trace):
        trace = make_trace(TIME, robots=3, about={"neighbors": []})
        for name in ("spacing_error_mean", "spacing_error_max"):
            found = measure(name, trace)
            assert (found.value, found.reason) == (None, SHAPELESS)
