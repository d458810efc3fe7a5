"""Networks of learned policies, from a file of NumPy arrays."""

from __future__ import annotations

from itertools import count
from pathlib import Path
from typing import Any

from escort_mj.scenario.reader.files.arrays import listed, read_arrays


def read_network(file: Path) -> list[dict[str, Any]]:
    """Return the layers of a network: the arrays weights_1, bias_1, weights_2 and so on.

    Raises:
        ValueError: If the file cannot be read, or an array is wrong; the words follow the name of the file.
    """
    found = read_arrays(file, "a network is a list of layers")
    layers: list[dict[str, Any]] = []
    for number in count(1):
        names = f"weights_{number}", f"bias_{number}"
        if not found.keys() & {*names}:
            break
        layers.append(
            {
                key: listed(found, name, 2 - k)
                for k, (key, name) in enumerate(zip(("weights", "bias"), names, strict=True))
            }
        )
    known = {f"{key}_{number + 1}" for number in range(len(layers)) for key in ("weights", "bias")}
    if not layers or (unknown := sorted(found.keys() - known)):
        words = ", ".join(unknown) if layers else ", ".join(sorted(found)) or "nothing"
        raise ValueError(f": found {words}; expected the arrays weights_1, bias_1, weights_2 and so on")
    return layers
