import numpy as np
import pytest

from escort_mj.measuring import measure
from tests.metrics.motions import TIME


class TestTruth:
    def test_bounds_of_the_mass_matrix(self, make_trace):
        mass = np.broadcast_to(np.diag([2.0, 3.0]), (501, 2, 2, 2)).copy()
        mass[200, 1] = [[2.0, 1.0], [1.0, 2.0]]  # eigenvalues 1 and 3
        mass[300, 0] = np.diag([7.0, 2.5])
        trace = make_trace(TIME, robots=2, mass_matrix=mass)
        least, largest = (measure(f"mass_eigenvalue_{which}", trace) for which in ("min", "max"))
        assert (least.value, least.time, least.who) == (pytest.approx(1.0), TIME[200], "robot 2")
        assert (largest.value, largest.time, largest.who) == (pytest.approx(7.0), TIME[300], "robot 1")

    @pytest.mark.parametrize("name", ["skew_residual", "coriolis_residual"])
    def test_residuals(self, make_trace, name):
        values = np.zeros((501, 3))
        values[[50, 400], [0, 2]] = 0.5, 0.75
        found = measure(name, make_trace(TIME, robots=3, **{name: values}))
        assert (found.value, found.time, found.who) == (0.75, TIME[400], "robot 3")
        assert measure(name, make_trace(TIME, robots=3, **{name: values}), before=5.0).value == 0.5
