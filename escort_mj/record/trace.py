"""The trace of a run: every recorded signal as a labelled array with its unit, in NetCDF."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from escort_mj.errors import RunFolderError
from escort_mj.signals import SIGNALS, record_size

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]

WHOLE = {"avoidance_active": "int8", "contacts": "int32", "contact_onsets": "int32"}


def build_trace(samples: Array, sizes: Mapping[str, int], labels: Mapping[str, Any]) -> xarray.Dataset:
    """Names the parts of recorded samples.

    Args:
        samples: Shape (k, record_size); no NaN.
        sizes: Size of each dimension: `robot`, `axis`, `obstacle`, `coordinate`.
        labels: `obstacles` (names), `robot_radius` (n,), `obstacle_radius` (m,), `obstacle_position` (m, p),
            `force_limit` (n,), `neighbors` (edges, 2) as robot numbers, and `attributes` of the dataset.

    Returns:
        Dataset with dimensions time, robot (from 1), axis (x, y, z), obstacle (names), coordinate, and
        edge (pairs of neighbors); every variable carries `units` and `long_name`.
    """
    import xarray

    if samples.shape[1:] != (record_size(sizes),):
        raise ValueError(
            f"samples of shape {samples.shape} do not fit a record of {record_size(sizes)} values"
        )
    variables: dict[str, Any] = {}
    time, place = np.zeros(0), 0
    for signal in SIGNALS:
        size = signal.size(sizes)
        values = samples[:, place : place + size].reshape(len(samples), *(sizes[dim] for dim in signal.dims))
        place += size
        if signal.name == "time":
            time = values.copy()
            continue
        if "clearance" in signal.name or signal.name == "robot_distance_min":
            if not np.isfinite(values).all():  # nothing to be clear of
                continue
        kind = WHOLE.get(signal.name, "float64")
        attributes = {"units": signal.unit, "long_name": signal.meaning}
        variables[signal.name] = (("time", *signal.dims), values.astype(kind), attributes)
    variables |= {
        "robot_radius": (
            "robot",
            np.asarray(labels["robot_radius"], float),
            _said("m", "radius of each robot"),
        ),
        "obstacle_radius": (
            "obstacle",
            np.asarray(labels["obstacle_radius"], float).reshape(-1),
            _said("m", "radius of each obstacle"),
        ),
        "obstacle_position": (
            ("obstacle", "axis"),
            np.asarray(labels["obstacle_position"], float).reshape(-1, sizes["axis"]),
            _said("m", "center of each obstacle"),
        ),
        "force_limit": (
            "robot",
            np.minimum(np.asarray([np.inf if x is None else x for x in labels["force_limit"]], float), 1e300),
            _said("N", "largest force of each motor, 1e300 for no limit"),
        ),
        "neighbors": (
            ("edge", "end"),
            np.asarray(labels["neighbors"], "int32").reshape(-1, 2),
            _said("1", "robots at the two ends of each edge of the formation"),
        ),
    }
    return xarray.Dataset(
        variables,
        coords={
            "time": ("time", time, _said("s", SIGNALS[0].meaning)),
            "robot": ("robot", np.arange(1, sizes["robot"] + 1), _said("1", "number of the robot, from 1")),
            "axis": ("axis", list("xyz")[: sizes["axis"]]),
            "obstacle": ("obstacle", np.array(list(labels["obstacles"]), dtype=object)),
        },
        attrs=dict(labels["attributes"]),
    )


def _said(unit: str, meaning: str) -> dict[str, str]:
    """Attributes of a variable."""
    return {"units": unit, "long_name": meaning}


def save_trace(trace: xarray.Dataset, path: Path) -> None:
    """Writes a trace as NetCDF-4 under a temporary name and moves it into place."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    compressed = {
        name: {"compression": "gzip", "compression_opts": 1, "shuffle": True}
        for name, variable in trace.data_vars.items()
        if variable.ndim and variable.size
    }
    trace.to_netcdf(temporary, engine="h5netcdf", encoding=compressed)
    os.replace(temporary, path)


def load_trace(path: Path) -> xarray.Dataset:
    """Reads a trace into memory.

    Raises:
        RunFolderError: If there is none, or it cannot be read.
    """
    import xarray

    try:
        return xarray.load_dataset(path, engine="h5netcdf")
    except FileNotFoundError:
        raise RunFolderError(f"{path}: there is no trace here; is this a run folder?") from None
    except (OSError, ValueError) as error:
        raise RunFolderError(f"{path}: the trace cannot be read: {error}") from None
