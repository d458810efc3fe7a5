"""Scenarios given as Python's own data: mappings, sequences, NumPy's arrays and scalars, tables."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

import numpy as np
from pydantic import BaseModel

from escort_mj.errors import Fault, ScenarioError
from escort_mj.scenario.findings import Path, key_path, shown
from escort_mj.scenario.reader.document import MAX_DEPTH, Document, Place, too_small, unprintable


def plain(value: Any, depth: int = 0) -> Any:
    """The same as YAML would have it: dicts, lists, text, numbers, booleans and None; the rest as it is.

    What is nested more deeply than a file may be, such as a list that holds itself, is left as it is there.
    """
    if depth > MAX_DEPTH + 1:
        return value
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist(), depth)
    if isinstance(value, BaseModel):
        return plain(value.model_dump(), depth)
    if isinstance(value, Mapping):
        return {key: plain(inner, depth + 1) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [plain(inner, depth + 1) for inner in value]
    return os.fspath(value) if isinstance(value, os.PathLike) else value


def tuples(data: Any) -> Any:
    """Plain data, lists as tuples: strict types, for which `true` is no number, take no list for a tuple."""
    if isinstance(data, dict):
        return {key: tuples(value) for key, value in data.items()}
    return tuple(map(tuples, data)) if isinstance(data, list) else data


def document_of(data: Mapping[str, Any], source: str = "") -> Document:
    """A document of Python's own data, with what a file could not hold refused as it is there.

    Args:
        data: Keys and values of a scenario.
        source: What to call it in messages.

    Raises:
        ScenarioError: With every key, character and number that no file can have.
    """
    document = Document(plain(data))
    faults: list[Fault] = []
    for path, message in _wrong(document.data, ()):
        faults.append(Fault(message, key_path(path), source=source))
    if faults:
        raise ScenarioError(faults)
    _place(document, document.data, (), Place(source))
    return document


def _wrong(value: Any, path: Path) -> list[tuple[Path, str]]:
    """What a file could not hold, and where it stands."""
    if len(path) > MAX_DEPTH:
        return [(path, f"found more than {MAX_DEPTH} levels of nesting")]
    if isinstance(value, dict):
        found = []
        for key, inner in value.items():
            if not isinstance(key, str):
                found.append((path, f"found the key {shown(key)}; expected text"))
            elif message := unprintable(key):
                found.append((path, message))
            else:
                found += _wrong(inner, (*path, key))
        return found
    if isinstance(value, list):
        return [wrong for place, inner in enumerate(value) for wrong in _wrong(inner, (*path, place))]
    message = unprintable(value) if isinstance(value, str) else too_small(value)
    return [(path, message)] if message else []


def _place(document: Document, value: Any, path: Path, place: Place) -> None:
    """Notes that a value, and all in it, was given."""
    document.values[path] = place
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        if isinstance(value, dict):
            document.keys[(*path, key)] = place
        _place(document, inner, (*path, key), place)
