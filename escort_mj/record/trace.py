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

    from escort_mj.record.recording import Recorded

Array = NDArray[np.float64]


def build_trace(
    samples: Array, sizes: Mapping[str, int], labels: Mapping[str, Any], episodes: Array = NONE
) -> xarray.Dataset:
    """The trace of recorded samples; arguments and errors are those of `recording.record`."""
    return record(samples, sizes, labels, episodes).to_dataset()


def save_trace(trace: Recorded, path: Path) -> None:
    """Write a trace as NetCDF-4, whole or not at all.

    HDF5 writes into memory only: it ends the process where it cannot write to a disk.

    Raises:
        WriteError: If it cannot be written.
    """
    from escort_mj.record.netcdf import to_netcdf

    write_bytes(path, to_netcdf(trace), durable=True)


def load_trace(path: Path) -> xarray.Dataset:
    """Read a trace into memory.

    Raises:
        RunFolderError: If there is none, or it cannot be read.
    """
    from escort_mj.record.netcdf import from_netcdf

    try:
        return from_netcdf(path).to_dataset()
    except FileNotFoundError:
        raise RunFolderError(f"{path}: there is no trace here; is this a run folder?") from None
    except Exception as error:  # whatever else the libraries stumble over, it is the file's fault
        words = str(error).partition("\n")[0] or type(error).__name__
        raise RunFolderError(f"{path}: the trace cannot be read: {words}") from None
