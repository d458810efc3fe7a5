import math

import numpy as np
import pytest

from escort_mj.measuring import measure
from tests.metrics.motions import TIME


def test_errors_are_root_mean_squares_of_vectors(make_trace):
    e = np.zeros((501, 2, 2))
    e[:, 0] = (3.0, 4.0)  # |e| is 5 for one robot of two
    trace = make_trace(TIME, robots=2, e=e, e_dot=2.0 * e)
    assert measure("tracking_error_rms", trace).value == pytest.approx(5.0 / math.sqrt(2.0))
    assert measure("velocity_error_rms", trace).value == pytest.approx(10.0 / math.sqrt(2.0))
