"""Overrides: `key.path=value` as text, or key paths with Python's values, laid over a document unchecked."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path as FilePath
from typing import Any

from escort_mj.errors import Fault, ScenarioError
from escort_mj.scenario.arguments import Overrides, argument_error, kind_of
from escort_mj.scenario.findings import Path, key_path, parse_key_path, shortened
from escort_mj.scenario.reader.document import MAX_DEPTH, Document, Place, read_document
from escort_mj.scenario.reader.files.paths import locate, models, tag_of
from escort_mj.scenario.reader.plain import document_of
from escort_mj.scenario.reader.plugins import placed_in

_OVERRIDES = kind_of(Overrides)


def apply(document: Document, overrides: Overrides) -> list[Fault]:
    """Sets values in a document, in the order given; returns what could not be set.

    Args:
        document: Changed in place; its data is a table.
        overrides: Texts `key.path=value` with values as YAML, a mapping from key paths to values, or both.

    Raises:
        UsageError: If they are anything else.
    """
    if not _OVERRIDES.accepts(overrides):
        raise argument_error("overrides", overrides, _OVERRIDES.words)
    faults: list[Fault] = []
    for place, path, value in read_overrides(overrides, faults):
        if path == ("plugins",):
            value = placed_in(FilePath(), value)
        try:
            _set(document, path, value, place)
        except ScenarioError as error:
            faults.extend(error.faults)
    return faults


def read_overrides(overrides: Overrides, faults: list[Fault]) -> Iterator[tuple[Place, Path, Any]]:
    """What to call each override, its key path and its value; what is wrong with one goes to the faults."""
    if isinstance(overrides, Mapping):
        for key, value in overrides.items():
            place = Place(shortened(key, 80))
            path = parse_key_path(key)
            if path is None:
                faults.append(
                    Fault("is no key path of a scenario, such as robots.count", source=place.source)
                )
            elif not (deep := _too_deep(path, place)):
                try:
                    yield place, path, document_of({"": value}).data[""]
                except ScenarioError as error:
                    faults += [
                        Fault(fault.message, key_path(path), source=place.source) for fault in error.faults
                    ]
            else:
                faults.append(deep)
        return
    for override in [overrides] if isinstance(overrides, str) else overrides:
        if isinstance(override, Mapping):
            yield from read_overrides(override, faults)
            continue
        key, equals, text = override.partition("=")
        place = Place("--set " + (override if len(override) <= 80 else override[:77] + "..."))
        path = parse_key_path(key.strip())
        if path is None or not equals:
            faults.append(Fault("expected key.path=value, such as robots.count=7", source=place.source))
        elif deep := _too_deep(path, place):
            faults.append(deep)
        else:
            try:
                yield place, path, read_document(text, place.source).data
            except ScenarioError as error:
                faults += [
                    Fault(fault.message, key_path(path), source=place.source) for fault in error.faults
                ]


def _too_deep(path: Path, place: Place) -> Fault | None:
    """What is wrong with a path of too many levels."""
    if len(path) <= MAX_DEPTH:
        return None
    message = f"found a key path of {len(path)} levels; expected at most {MAX_DEPTH}"
    return Fault(message, source=place.source)


def _set(document: Document, path: Path, value: Any, place: Place) -> None:
    holder = document.data
    for depth in range(1, len(path)):
        here = path[:depth]
        inner = _opened(_get(holder, here, place), here, wants_list=isinstance(path[depth], int))
        if inner is None:
            raise _fault(place, path, f"{key_path(here)} is a single value and holds no keys")
        if here not in document.values:
            document.values[here] = document.keys[here] = place
            document.overridden.add(here)
        _put(holder, here, inner, place)
        holder = inner
    _put(holder, path, value, place)
    for places in (document.values, document.keys):
        for stale in [known for known in places if known[: len(path)] == path]:
            del places[stale]
        places[path] = place
    document.overridden.add(path)


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
