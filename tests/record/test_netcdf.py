"""The format, beside what else writes and reads it: xarray."""

import h5py
import numpy as np
import pytest
import xarray

from escort_mj.record.netcdf import from_netcdf, to_netcdf
from tests.synthetic import build_trace


@pytest.fixture(params=[(0, 1, 2, 0), (40, 3, 3, 2)], ids=["empty", "full"])
def trace(record, request) -> xarray.Dataset:
    samples, sizes, labels = record(*request.param)
    about = labels["attributes"] | {"least_energy": [0.5, 0.25], "words": "ä\n€"}
    return build_trace(samples, sizes, labels | {"attributes": about})


@pytest.mark.slow_cases("empty")
def test_xarray_reads_what_we_write(trace, tmp_path):
    (tmp_path / "trace.nc").write_bytes(to_netcdf(trace))
    with xarray.open_dataset(tmp_path / "trace.nc", engine="h5netcdf", decode_times=False) as read:
        xarray.testing.assert_identical(read, trace)
        without_labels = set(trace.sizes) - set(trace.coords)
        assert read.encoding["unlimited_dims"] == {dim for dim in without_labels if not trace.sizes[dim]}


@pytest.mark.slow_cases("empty")
def test_we_read_what_xarray_writes(trace, tmp_path):
    """Run folders of earlier versions, and traces that somebody changed and saved."""
    trace.to_netcdf(tmp_path / "trace.nc", engine="h5netcdf")
    read = from_netcdf(tmp_path / "trace.nc").to_dataset()
    xarray.testing.assert_identical(read, trace)
    for name, variable in trace.variables.items():
        assert read[name].values.tobytes() == variable.values.tobytes(), name


def test_what_has_no_place_in_the_format_is_refused(trace):
    for wrong in (
        trace.assign(flags=("robot", np.ones(trace.sizes["robot"], bool))),
        trace.assign_attrs(a=object()),
    ):
        with pytest.raises(TypeError):
            to_netcdf(wrong)
    with pytest.raises(ValueError, match="NUL"):
        to_netcdf(trace.assign_attrs(title="\0"))


def test_a_file_of_groups_is_refused(tmp_path):
    xarray.Dataset({"q": ("time", [1.0])}).to_netcdf(tmp_path / "a.nc", engine="h5netcdf", group="inner")
    with pytest.raises(ValueError, match="inner is not a variable"):
        from_netcdf(tmp_path / "a.nc")


def test_texts_of_fixed_size_are_texts(trace, tmp_path):
    """So the C library of NetCDF writes them."""
    (tmp_path / "trace.nc").write_bytes(to_netcdf(trace))
    with h5py.File(tmp_path / "trace.nc", "r+") as file:
        file.attrs["title"] = np.bytes_("synthetic")
        file["body_thickness"].attrs["coordinates"] = np.bytes_("body_group body_motion")
    xarray.testing.assert_identical(from_netcdf(tmp_path / "trace.nc").to_dataset(), trace)
