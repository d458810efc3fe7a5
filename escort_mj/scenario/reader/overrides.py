"""Command-line overrides: `key.path=value`, laid over a document before it is checked."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from escort_mj.errors import Fault, ScenarioError
from escort_mj.scenario.findings import Path, key_path, parse_key_path
from escort_mj.scenario.reader.document import MAX_DEPTH, Document, Place, read_document
from escort_mj.scenario.reader.dump import flow
from escort_mj.scenario.reader.paths import locate, models, tag_of

Overrides = Sequence[str] | Mapping[str, Any]


def apply(document: Document, overrides: Overrides) -> list[Fault]:
    """Sets values in a document, in the order given; returns what could not be set.

    Args:
        document: Changed in place; its data is a table.
        overrides: Texts `key.path=value` with values as YAML, or a mapping from key paths to values.
    """
    faults: list[Fault] = []
    for override in _texts(overrides):
        key, equals, text = override.partition("=")
        place = Place("--set " + (override if len(override) <= 80 else override[:77] + "..."))
        path = parse_key_path(key.strip())
        if path is None or not equals:
            faults.append(Fault("expected key.path=value, such as robots.count=7", source=place.source))
            continue
        if len(path) > MAX_DEPTH:
            message = f"found a key path of {len(path)} levels; expected at most {MAX_DEPTH}"
            faults.append(Fault(message, source=place.source))
            continue
        try:
            value = read_document(text, place.source).data
        except ScenarioError as error:
            faults.extend(Fault(fault.message, key_path(path), source=place.source) for fault in error.faults)
            continue
        try:
            _set(document, path, value, place)
        except ScenarioError as error:
            faults.extend(error.faults)
    return faults


def _texts(overrides: Overrides) -> Iterator[str]:
    if isinstance(overrides, Mapping):
        yield from (f"{key}={flow(value)}" for key, value in overrides.items())
    elif isinstance(overrides, str):
        yield overrides
    else:
        yield from overrides


def _set(document: Document, path: Path, value: Any, place: Place) -> None:
    holder = document.data
    for depth in range(1, len(path)):
        here = path[:depth]
        inner = _opened(_get(holder, here, place), here, wants_list=isinstance(path[depth], int))
        if inner is None:
            raise _fault(place, path, f"{key_path(here)} is a single value and holds no keys")
        if here not in document.values:
            document.values[here] = document.keys[here] = place
        _put(holder, here, inner, place)
        holder = inner
    _put(holder, path, value, place)
    for places in (document.values, document.keys):
        for stale in [known for known in places if known[: len(path)] == path]:
            del places[stale]
        places[path] = place


def _opened(value: Any, path: Path, wants_list: bool) -> dict[str, Any] | list[Any] | None:
    """A table or list that keys can be set in, for what stands at a path: nothing, a short form, or it."""
    if isinstance(value, dict | list):
        return value
    location = locate(path)
    tag = next((tag for model in models(location.annotation) if (tag := tag_of(model))), None)
    if isinstance(value, str) and tag:
        return {tag[0]: value}
    if value is not None:
        return None
    default = location.field.get_default() if location.field else None
    if isinstance(default, tuple):
        tags = [tag_of(type(item)) for item in default]
        return [{tag[0]: tag[1]} if tag else {} for tag in tags]
    return [] if wants_list else {}


def _get(holder: Any, path: Path, place: Place) -> Any:
    key = path[-1]
    if isinstance(holder, dict):
        return holder.get(key)
    if isinstance(key, int):
        return holder[key] if key < len(holder) else None
    return None


def _put(holder: Any, path: Path, value: Any, place: Place) -> None:
    key, owner = path[-1], key_path(path[:-1]) or "the scenario"
    if isinstance(holder, dict):
        if isinstance(key, int):
            raise _fault(place, path, f"{owner} has keys, not numbered items")
        holder[key] = value
    elif not isinstance(key, int):
        raise _fault(place, path, f"{owner} is a list; number its items from 0, such as {owner}[0]")
    elif key < len(holder):
        holder[key] = value
    elif key == len(holder):
        holder.append(value)
    else:
        raise _fault(place, path, f"{owner} has {len(holder)} items; the next one is {owner}[{len(holder)}]")


def _fault(place: Place, path: Path, message: str) -> ScenarioError:
    return ScenarioError([Fault(message, key_path(path), source=place.source)])
