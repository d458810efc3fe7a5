"""A trace as one table, a row for each sample, for programs that read tables."""

from __future__ import annotations

import math
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from escort_mj.errors import UsageError
from escort_mj.files import replaced
from escort_mj.record.tables import with_units

if TYPE_CHECKING:
    import pandas
    import xarray

CSV, PARQUET = ".csv", ".parquet"


def dataframe_of(trace: xarray.Dataset) -> pandas.DataFrame:
    """Every signal over time, one number a column.

    Args:
        trace: Of a run.

    Returns:
        Columns `time` [s] and `signal` or `signal.label.label ...`, with the labels of the signal's other
        dimensions, such as `q.robot_1.x`; `attrs["units"]` has the unit of each.
    """
    import pandas

    columns, units = {"time": trace["time"].values}, {"time": "s"}
    for name, signal in trace.data_vars.items():
        if signal.dims[:1] != ("time",):
            continue
        rest = [_labels(trace, str(dim)) for dim in signal.dims[1:]]
        values = signal.values.reshape(len(signal), math.prod(signal.shape[1:]))
        for column, labels in zip(values.T, product(*rest), strict=True):
            label = ".".join((str(name), *labels))
            columns[label], units[label] = column, str(signal.attrs.get("units", "1"))
    found = pandas.DataFrame(columns)
    found.attrs["units"] = units
    return found


def _labels(trace: xarray.Dataset, dim: str) -> list[str]:
    """What the places of a dimension are called: by its names, or by its name and numbers from 1."""
    values = trace[dim].values if dim in trace.coords else np.arange(trace.sizes[dim]) + 1
    if np.issubdtype(values.dtype, np.number):
        return [f"{dim}_{value}" for value in values]
    return [str(value) for value in values]


def write_table(trace: xarray.Dataset, path: Path) -> None:
    """Write the table of a trace; the suffix says how.

    Args:
        trace: Of a run.
        path: A `.csv` file, whose heads are `name [unit]` and whose numbers read back exactly, or a
            `.parquet` file, which keeps `attrs`.

    Raises:
        UsageError: If nothing that writes Parquet is installed.
        WriteError: If the file cannot be written; an earlier one stays as it was.
    """
    write_frame(dataframe_of(trace), path)


def write_frame(table: pandas.DataFrame, path: Path) -> None:
    """Write a table whose units are in its `attrs["units"]`; see `write_table`."""
    try:
        with replaced(path) as temporary, temporary.open("wb") as file:
            if path.suffix == PARQUET:
                table.to_parquet(file, index=False)
            else:
                with_units(table).to_csv(file, index=False)
    except ImportError:
        raise UsageError(f"{path}: writing Parquet needs pyarrow; pip install pyarrow adds it") from None
