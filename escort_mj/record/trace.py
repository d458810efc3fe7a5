"""The trace of a run: every recorded signal as a labelled array with its unit, in NetCDF."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from escort_mj.errors import RunFolderError
from escort_mj.record.episodes import NONE
from escort_mj.record.files import write_bytes
from escort_mj.record.recording import record

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]


def build_trace(
    samples: Array, sizes: Mapping[str, int], labels: Mapping[str, Any], episodes: Array = NONE
) -> xarray.Dataset:
    """The trace of recorded samples; arguments and errors are those of `recording.record`."""
    return record(samples, sizes, labels, episodes).to_dataset()


def save_trace(trace: xarray.Dataset, path: Path) -> None:
    """Write a trace as NetCDF-4, whole or not at all.

    HDF5 writes into memory only: it ends the process where it cannot write to a disk.

    Raises:
        WriteError: If it cannot be written.
    """
    compressed = {"compression": "gzip", "compression_opts": 1, "shuffle": True}
    encoding: dict[str, dict[str, Any]] = {
        str(name): {"_FillValue": None} | (compressed if variable.ndim and variable.size else {})
        for name, variable in trace.variables.items()
        if variable.dtype.kind in "fi"
    }
    write_bytes(path, trace.to_netcdf(engine="h5netcdf", encoding=encoding), durable=True)


def load_trace(path: Path) -> xarray.Dataset:
    """Reads a trace into memory.

    Raises:
        RunFolderError: If there is none, or it cannot be read.
    """
    import xarray

    try:
        return xarray.load_dataset(path, engine="h5netcdf", decode_times=False)
    except FileNotFoundError:
        raise RunFolderError(f"{path}: there is no trace here; is this a run folder?") from None
    except Exception as error:  # whatever else the libraries stumble over, it is the file's fault
        words = str(error).partition("\n")[0] or type(error).__name__
        raise RunFolderError(f"{path}: the trace cannot be read: {words}") from None
