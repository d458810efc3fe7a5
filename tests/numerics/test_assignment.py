"""Small assignments are those of SciPy, also where several are best."""

import subprocess
import sys

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

from escort_mj.numerics.assignment import SMALL, best_assignment


@pytest.mark.parametrize("count", [1, 2, 3, 5, 8, SMALL, SMALL + 1])
def test_assignments_are_those_of_scipy(count: int) -> None:
    random = np.random.default_rng(count)
    for _ in range(60):
        for values in (
            random.normal(size=(count, count)),
            random.integers(-1, 2, size=(count, count)).astype(float),  # many are best
            np.full((count, count), 0.1),
        ):
            expected = linear_sum_assignment(values, maximize=True)[1]
            assert best_assignment(values).tolist() == expected.tolist()


def test_even_figures_of_small_teams_need_no_optimizer() -> None:
    program = """
import sys
import numpy as np
from escort_mj.numerics.thomson import even_figure
even_figure(np.random.default_rng(0).normal(size=(5, 2)), np.zeros(2))
assert not any(name.split(".")[0] == "scipy" for name in sys.modules)
"""
    subprocess.run([sys.executable, "-c", program], check=True)
