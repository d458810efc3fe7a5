"""Scenarios that mean nothing: each key is well formed, and the whole is wrong whatever else it says."""

import copy
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

PLAIN, FAULTS = YAML(typ="safe").load_all(Path(__file__).with_suffix(".yaml"))
"""A scenario that is right; by what is wrong, a few ways to make it so."""


def with_all(*faults: dict[str, Any]) -> dict[str, Any]:
    """Return the plain scenario with these faults."""
    scenario = copy.deepcopy(PLAIN)
    for fault in faults:
        for path, value in fault.items():
            put(scenario, path, copy.deepcopy(value))
    return scenario


def put(data: Any, path: str, value: Any) -> None:
    """Set a value; tables on the way are made, and what is not there to be set is left."""
    *way, last = (int(key) if key.isdigit() else key for key in path.split("."))
    for key in way:
        if isinstance(data, list):
            if key >= len(data):
                return
        else:
            data.setdefault(key, {})
        if not isinstance(data[key], dict | list):
            data[key] = {}
        data = data[key]
    if isinstance(data, dict):
        data[last] = value
    elif isinstance(last, str):
        data.append(value)
    elif last < len(data):
        data[last] = value
