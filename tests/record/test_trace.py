import os

import h5py
import numpy as np
import pytest
import xarray
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from escort_mj.errors import RunFolderError
from escort_mj.record.stored import read_run
from escort_mj.record.trace import load_recording, save_trace
from escort_mj.signals import (
    MEMORIES,
    MOVERS,
    OPPONENTS,
    POLICIES,
    RADII,
    READINGS,
    SIGNALS,
    TEAMS,
    WAITING,
    WATCHES,
)
from tests.synthetic import build_trace

MAY_BE_INFINITE = ("clearance", "target_clearance", "body_thickness")


def test_every_signal_is_named_with_its_dimensions_unit_and_meaning(record):
    samples, sizes, labels = record(7)
    trace = build_trace(samples, sizes, labels)
    for signal in (one for one in SIGNALS if one.recorded(sizes)):
        variable = trace[signal.name]
        assert variable.dims == (("time",) if signal.name == "time" else ("time", *signal.dims))
        assert variable.attrs == {"units": signal.unit, "long_name": signal.meaning}
    for name, variable in trace.data_vars.items():
        assert {"units", "long_name"} <= variable.attrs.keys(), name
    assert list(trace["robot"].values) == [1, 2, 3]
    assert list(trace["axis"].values) == ["x", "y"]
    assert list(trace["obstacle"].values) == ["rock 1", "rock 2"]
    assert {"robot_radius", "obstacle_radius", "obstacle_position", "force_limit"} <= set(trace.data_vars)
    assert trace["neighbors"].values.tolist() == [[1, 2], [2, 3]]
    assert trace.attrs["title"] == "synthetic"


def test_parts_stand_where_the_table_puts_them(record):
    samples, sizes, labels = record(5, robots=2, axes=3, obstacles=1)
    trace = build_trace(samples, sizes, labels)
    place = 0
    for signal in (one for one in SIGNALS if one.recorded(sizes)):
        size = signal.size(sizes)
        part = trace[signal.name].values.reshape(5, size)
        np.testing.assert_array_equal(part, samples[:, place : place + size], err_msg=signal.name)
        place += size
    assert place == samples.shape[1]


def test_whole_numbers_are_integers(record):
    trace = build_trace(*record(4))
    assert trace["avoidance_active"].dtype == np.int8
    assert trace["clearance_body"].dtype == np.int32
    assert trace["contacts_untold"].dtype == np.int64
    assert {v.dtype for n, v in trace.data_vars.items() if n in ("q", "tau", "effort")} == {np.dtype("f8")}


@settings(max_examples=6, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    rows=st.integers(0, 40),
    robots=st.integers(1, 4),
    axes=st.sampled_from([2, 3]),
    obstacles=st.integers(0, 3),
    seed=st.integers(0, 99),
)
def test_a_file_gives_back_every_bit(tmp_path, record, rows, robots, axes, obstacles, seed):
    samples, sizes, labels = record(rows, robots, axes, obstacles, seed)
    trace = build_trace(samples, sizes, labels)
    save_trace(trace, tmp_path / "trace.nc")
    back = load_recording(tmp_path / "trace.nc").to_dataset()
    xarray.testing.assert_identical(back, trace)
    for name, variable in trace.variables.items():
        assert back[name].dtype == variable.dtype, name
        assert back[name].values.tobytes() == variable.values.tobytes(), name


@pytest.mark.parametrize("extreme", [5e-324, -0.0, 1.7976931348623157e308, 0.1 + 0.2])
def test_a_file_keeps_extreme_numbers(tmp_path, make_trace, extreme):
    save_trace(make_trace([0.0, 1.0], q=extreme), tmp_path / "trace.nc")
    values = load_recording(tmp_path / "trace.nc").to_dataset()["q"].values
    assert values.tobytes() == np.full(values.shape, extreme).tobytes()


def test_the_file_is_plain_hdf5_compressed_and_without_nan(tmp_path, make_trace):
    noise = np.random.default_rng(0).normal(size=(50, 1, 2))
    save_trace(make_trace(np.arange(50.0), q=1.0, v=noise), tmp_path / "trace.nc")
    with h5py.File(tmp_path / "trace.nc") as file:
        assert file["q"].compression == "gzip"
        assert file["v"].compression is None, "it is noise, which does not shrink"
        assert file["q"].compression_opts == 1
        assert file["q"].shuffle
        assert file["q"].dtype == np.dtype("<f8")
        units = file["q"].attrs["units"]
        assert (units.decode() if isinstance(units, bytes) else units) == "m"
        for name, dataset in file.items():
            assert "_FillValue" not in dataset.attrs
            if dataset.dtype.kind == "f":
                assert not np.isnan(dataset[()]).any()
                assert np.isfinite(dataset[()]).all() or name in MAY_BE_INFINITE


@pytest.mark.parametrize(("robots", "obstacles"), [(1, 0), (1, 1), (2, 0), (2, 1)])
def test_distances_to_what_is_not_there(make_trace, robots, obstacles):
    """Center to center they are left out; clearances, which have a place for each group, are infinite."""
    trace = make_trace([0.0, 1.0], robots=robots, obstacles=obstacles)
    absent = {"robot_distance_min"} if robots == 1 else set()
    channels = {TEAMS} if obstacles else {TEAMS, OPPONENTS, MOVERS}
    channels |= {RADII, WATCHES, MEMORIES, READINGS, POLICIES, WAITING}
    absent |= {signal.name for signal in SIGNALS if signal.channel in channels}
    assert {signal.name for signal in SIGNALS} - set(trace.variables) == absent
    there = np.isfinite(trace["clearance"].values).all(axis=(0, 1))
    assert dict(zip(trace["group"].values, there, strict=True)) == {
        "robots": robots > 1,
        "target": True,
        "obstacles": obstacles > 0,
        "walls": False,
    }
    for name, variable in trace.variables.items():
        assert variable.dtype.kind != "f" or np.isfinite(variable.values).all() or name in MAY_BE_INFINITE


def test_without_the_truth_channel_its_signals_are_left_out(make_trace):
    trace = make_trace([0.0, 1.0], robots=2, truth=False)
    told = {signal.name for signal in SIGNALS if signal.channel}
    assert told & set(trace.variables) == set()
    assert not {"axis_2", "cause"} & set(trace.dims)
    assert {"mass_matrix", "lyapunov_change"} <= told
    assert make_trace([0.0], robots=2)["lyapunov_change"].sel(cause="unexplained").shape == (1, 2)


def test_no_force_limit_is_a_number_all_the_same(make_trace):
    trace = make_trace([0.0], robots=2, about={"force_limit": [None, 3.0]})
    assert trace["force_limit"].values.tolist() == [1e300, 3.0]


def test_an_attribute_without_a_value_is_left_out(tmp_path, make_trace):
    trace = make_trace([0.0], about={"nothing": None, "words": "ä\n€"})
    save_trace(trace, tmp_path / "trace.nc")
    attributes = load_recording(tmp_path / "trace.nc").to_dataset().attrs
    assert "nothing" not in attributes
    assert attributes["words"] == "ä\n€"


def test_samples_of_another_size_are_refused(record):
    samples, sizes, labels = record(3)
    with pytest.raises(ValueError, match="do not fit a record"):
        build_trace(samples[:, :-1], sizes, labels)


def test_a_file_that_cannot_be_read_is_one_clear_error(tmp_path, record):
    path = tmp_path / "trace.nc"
    with pytest.raises(RunFolderError, match="no trace here"):
        load_recording(path).to_dataset()
    save_trace(build_trace(*record(50)), path)
    path.write_bytes(path.read_bytes()[:3000])
    with pytest.raises(RunFolderError, match="cannot be read"):
        load_recording(path).to_dataset()
    path.write_text("not a trace")
    with pytest.raises(RunFolderError, match="cannot be read"):
        load_recording(path).to_dataset()
    path.unlink()
    path.symlink_to(path)
    with pytest.raises(RunFolderError, match="cannot be read: Too many levels of symbolic links$"):
        load_recording(path).to_dataset()


def test_a_model_that_would_be_waited_for_is_refused(tmp_path):
    os.mkfifo(tmp_path / "model.xml")
    with pytest.raises(RunFolderError, match=r"model.xml: is a FIFO, not a file"):
        read_run(tmp_path)
