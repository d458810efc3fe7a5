"""In which keys two scenarios differ."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

from escort_mj.scenario.findings import Path, key_path, shortened, shown
from escort_mj.scenario.schema.scenario import Scenario


class Change(NamedTuple):
    """A key that has one value in a scenario and another one in a second scenario.

    Attributes:
        key: Its path, such as `robots.mass`.
        before: Its value in the first, in words.
        after: In the second.
    """

    key: str
    before: str
    after: str

    def __str__(self) -> str:
        return f"{self.key}: {self.before} | {self.after}"


ABSENT = object()


def changes_between(first: Scenario, second: Scenario) -> list[Change]:
    """Return the keys in which two scenarios differ, defaults included."""
    return [
        Change(key_path(path), *map(_words, pair))
        for path, *pair in _apart(first.model_dump(), second.model_dump())
    ]


def _apart(a: Any, b: Any, path: Path = ()) -> Iterator[tuple[Path, Any, Any]]:
    """Where two nested tables and lists differ, and by what."""
    if isinstance(a, dict) and isinstance(b, dict):
        for key in dict.fromkeys((*a, *b)):
            yield from _apart(a.get(key, ABSENT), b.get(key, ABSENT), (*path, key))
    elif _is_nested(a) and _is_nested(b) and len(a) == len(b):
        for place, (one, other) in enumerate(zip(a, b, strict=True)):
            yield from _apart(one, other, (*path, place))
    elif a is ABSENT or b is ABSENT or a != b:
        yield path, a, b


def _is_nested(value: Any) -> bool:
    """Whether a value is a list of tables or of lists."""
    return isinstance(value, tuple) and any(isinstance(one, dict | tuple) for one in value)


def _words(value: Any) -> str:
    if value is ABSENT:
        return "absent"
    if isinstance(value, tuple) and not _is_nested(value):
        return shortened(f"[{', '.join(map(shown, value))}]", 60)
    if isinstance(value, dict):
        return shortened(", ".join(f"{key}: {_words(one)}" for key, one in value.items()), 60)
    return shown(value)
