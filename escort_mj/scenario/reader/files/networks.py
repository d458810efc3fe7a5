"""Networks of learned policies, from a file of NumPy arrays."""

from __future__ import annotations

import zipfile
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from escort_mj.recognize import irregular

SUFFIX = ".npz"
LARGEST = 2**20  # bytes of all arrays


def read_network(file: Path) -> list[dict[str, Any]]:
    """Return the layers of a network: the arrays weights_1, bias_1, weights_2 and so on.

    Raises:
        ValueError: If the file cannot be read, or an array is wrong; the words follow the name of the file.
    """
    if file.suffix != SUFFIX:
        raise ValueError(f": a network is a list of layers, or the name of a file with the suffix {SUFFIX}")
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
    layers: list[dict[str, Any]] = []
    for number in count(1):
        names = f"weights_{number}", f"bias_{number}"
        if not found.keys() & {*names}:
            break
        layers.append(
            {
                key: _listed(found, name, 2 - k)
                for k, (key, name) in enumerate(zip(("weights", "bias"), names, strict=True))
            }
        )
    known = {f"{key}_{number + 1}" for number in range(len(layers)) for key in ("weights", "bias")}
    if not layers or (unknown := sorted(found.keys() - known)):
        words = ", ".join(unknown) if layers else ", ".join(sorted(found)) or "nothing"
        raise ValueError(f": found {words}; expected the arrays weights_1, bias_1, weights_2 and so on")
    return layers


def _listed(found: dict[str, Any], name: str, axes: int) -> Any:
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
