"""The trace of a run: every recorded signal as a labelled array with its unit, in NetCDF."""

from __future__ import annotations

import os
from pathlib import Path

from escort_mj.errors import RunFolderError
from escort_mj.files import write_bytes
from escort_mj.recognize import irregular
from escort_mj.record.recording import Recorded, Recording


def save_trace(trace: Recorded, path: Path) -> None:
    """Write a trace as NetCDF-4, whole or not at all.

    HDF5 writes into memory only: it ends the process where it cannot write to a disk.

    Raises:
        WriteError: If it cannot be written.
    """
    from escort_mj.record.netcdf import to_netcdf

    write_bytes(path, to_netcdf(trace), durable=True)


def load_recording(path: Path) -> Recording:
    """Read a trace into memory.

    Raises:
        RunFolderError: If there is none, or it cannot be read.
    """
    from escort_mj.record.netcdf import from_netcdf

    if kind := irregular(path):
        raise RunFolderError(f"{path}: is {kind}, not a file")
    try:
        recording = from_netcdf(path)
        for name, one in (*recording.coords.items(), *recording.data_vars.items()):
            if one.values.shape != tuple(recording.sizes[dim] for dim in one.dims):
                raise ValueError(f"{name} has other sizes than its dimensions")
        return recording
    except FileNotFoundError:
        raise RunFolderError(f"{path}: there is no trace here; is this a run folder?") from None
    except Exception as error:  # whatever else the libraries stumble over, it is the file's fault
        known = getattr(error, "errno", None)  # HDF5 tells of the system in many words
        words = os.strerror(known) if known else str(error).partition("\n")[0] or type(error).__name__
        raise RunFolderError(f"{path}: the trace cannot be read: {words}") from None
