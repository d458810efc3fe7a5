"""Files of NumPy arrays that scenarios name."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from escort_mj.components.grid import Grid
from escort_mj.components.mission import axis_names
from escort_mj.recognize import irregular

SUFFIX = ".npz"
LARGEST = 2**20  # bytes of all arrays


def read_arrays(file: Path, what: str) -> dict[str, Any]:
    """Return the arrays of a file by name.

    Args:
        file: The file.
        what: What of a scenario it is given for, in words.

    Raises:
        ValueError: If it cannot be read; the words follow the name of the file.
    """
    if file.suffix != SUFFIX:
        raise ValueError(f": {what}, or the name of a file with the suffix {SUFFIX}")
    if kind := irregular(file):
        raise ValueError(f": is {kind}, not a file")
    try:
        with zipfile.ZipFile(file) as members:
            size = sum(member.file_size for member in members.infolist())
        if size > LARGEST:
            raise ValueError(f": found {size:,} bytes; expected at most {LARGEST:,}")
        with np.load(file, allow_pickle=False) as arrays:
            found = {name: arrays[name] for name in arrays.files}
    except FileNotFoundError:
        raise ValueError(": there is no such file beside the scenario") from None
    except Exception as error:  # whatever the libraries stumble over, it is the file's fault
        words = str(getattr(error, "strerror", None) or error).partition("\n")[0] or type(error).__name__
        raise ValueError(words if words.startswith(": ") else f": cannot be read: {words}") from None
    for name, array in found.items():
        if not isinstance(array, np.ndarray):  # NumPy hands out other files as they are
            raise ValueError(f": {name} is no array of NumPy")
    return found


def listed(found: dict[str, Any], name: str, axes: int) -> Any:
    """Return an array as lists.

    Raises:
        ValueError: If it is missing, has other axes, or does not consist of finite numbers.
    """
    if name not in found:
        raise ValueError(f": {name} is missing")
    array = found[name]
    if array.ndim != axes or array.dtype.kind not in "fiu" or not np.isfinite(array).all():
        words = f"{array.dtype} of the shape {array.shape}"
        raise ValueError(f": {name}: found {words}; expected finite numbers with {axes} axes")
    return array.astype(float).tolist()


def read_grid(file: Path) -> dict[str, Any]:
    """Return the table of a grid of velocities, from the arrays x, y and so on, velocity and time.

    Raises:
        ValueError: If the file cannot be read, or an array is wrong; the words follow the name of the file.
    """
    found = read_arrays(file, "a grid is a table")
    timed = "time" in found
    names = axis_names(max(len(found) - 1 - timed, 2))
    if found.keys() - {"time"} != {*names, "velocity"}:
        words = ", ".join(sorted(found)) or "nothing"
        raise ValueError(f": found {words}; expected the arrays x, y and so on, velocity and perhaps time")
    points = [listed(found, name, 1) for name in names]
    times = listed(found, "time", 1) if timed else []
    listed(found, "velocity", len(names) + 1 + timed)
    velocity, shape = found["velocity"], (*[len(times)] * timed, *map(len, points), len(names))
    if velocity.shape != shape:
        raise ValueError(f": velocity: found the shape {velocity.shape}; expected {shape}")
    table = {"time": times, "points": points, "velocity": velocity.astype(float).ravel().tolist()}
    try:
        Grid.model_validate(table)
    except ValidationError as error:
        raise ValueError(f": {error.errors()[0]['msg'].removeprefix('Value error, ')}") from None
    return table
