"""A trace as a table."""

from pathlib import Path

import numpy as np
import pandas
import pytest

from escort_mj.errors import WriteError
from escort_mj.record.export import dataframe_of, write_table
from escort_mj.record.tables import without_units
from tests.limits import files_up_to


def test_a_column_for_each_number(make_trace) -> None:
    trace = make_trace(np.linspace(0.0, 1.0, 7))
    rows = dataframe_of(trace)
    assert len(rows) == 7
    for robot in trace["robot"].values:
        for axis in trace["axis"].values:
            column = rows[f"q.robot_{robot}.{axis}"].values
            np.testing.assert_array_equal(column, trace["q"].sel(robot=robot, axis=axis).values)
    numbers = sum(s.size for s in trace.data_vars.values() if s.dims[:1] == ("time",))
    assert rows.size == numbers + 7
    assert {"heard_from.robot_1.slot_1", "heard_from.robot_1.slot_2"} <= {*rows}


def test_numbers_read_back_exactly(make_trace, tmp_path: Path) -> None:
    trace = make_trace(np.linspace(0.0, 1.0, 7) / 3.0)
    write_table(trace, tmp_path / "run.csv")
    table = pandas.read_csv(tmp_path / "run.csv")
    assert {"time [s]", "q.robot_1.x [m]", "v.robot_1.y [m/s]"} <= {*table}
    back = without_units(table)
    units = {name: unit for name, unit in dataframe_of(trace).attrs["units"].items() if unit != "1"}
    assert back.attrs["units"] == units
    pandas.testing.assert_frame_equal(back, dataframe_of(trace), check_exact=True, check_dtype=False)


def test_parquet_keeps_the_units(make_trace, tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    trace = make_trace(np.linspace(0.0, 1.0, 7))
    write_table(trace, tmp_path / "run.parquet")
    units = pandas.read_parquet(tmp_path / "run.parquet").attrs["units"]
    assert units == dataframe_of(trace).attrs["units"] and units["time"] == "s"
    robot, axis = trace["robot"].values[0], trace["axis"].values[0]
    assert units[f"q.robot_{robot}.{axis}"] == "m" and units[f"v.robot_{robot}.{axis}"] == "m/s"


def test_where_it_cannot_be_written(make_trace, tmp_path: Path) -> None:
    with pytest.raises(WriteError, match=r"nowhere/run.csv: cannot be written") as raised:
        write_table(make_trace(np.linspace(0.0, 1.0, 3)), tmp_path / "nowhere" / "run.csv")
    assert raised.value.exit_code == 2


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_a_full_disk_leaves_no_cut_file_and_keeps_an_earlier_one(make_trace, tmp_path, suffix) -> None:
    if suffix == ".parquet":
        pytest.importorskip("pyarrow")
    path = tmp_path / f"run{suffix}"
    path.write_text("earlier")
    with (
        pytest.raises(WriteError, match=r"run.\w+: cannot be written: File too large") as raised,
        files_up_to(3000),
    ):
        write_table(make_trace(np.linspace(0.0, 1.0, 500)), path)
    assert raised.value.exit_code == 3
    assert [each.name for each in tmp_path.iterdir()] == [path.name]
    assert path.read_text() == "earlier"
