import numpy as np
import pytest
import xarray
from hypothesis import given, settings
from hypothesis import strategies as st

from escort_mj.metrics.reading import mean
from tests.metrics.motions import TIME


class TestMeans:
    @settings(max_examples=30)
    @given(extra=st.lists(st.integers(1, 4999), max_size=6, unique=True))
    def test_further_samples_change_no_mean(self, extra):
        """A ramp and its mean, with more samples at some places."""
        time = np.unique(np.append(np.arange(0, 5001, 10), extra)) * 0.002
        trace = xarray.Dataset(coords={"time": time}, attrs={"timestep": 0.002})
        assert mean(trace, 3.0 * time[:, None]) == pytest.approx(15.0, rel=2e-3)
        assert mean(trace, np.ones((len(time), 2))) == 1.0

    def test_a_mean_of_even_samples_is_that_of_their_values(self):
        values = np.random.default_rng(1).standard_normal((501, 3))
        values[300:, 1] = np.nan
        trace = xarray.Dataset(coords={"time": TIME}, attrs={"timestep": 0.002})
        assert mean(trace, values) == np.nanmean(values)
