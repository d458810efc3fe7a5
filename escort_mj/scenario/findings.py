"""What is wrong with a scenario, before it is known where in the file that stands; and words for it."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

Path = tuple[str | int, ...]


class Finding(NamedTuple):
    """One thing wrong with a scenario.

    Attributes:
        path: Keys and list indices that lead to it.
        message: What was found and what is allowed.
        at_key: Whether the key itself is wrong, not its value.
        related: Other paths to point at where the file does not hold `path`.
        late: What begins or ends only after the end of the run, such as "its window begins at 5 s"; empty
            where the finding is another.
    """

    path: Path
    message: str
    at_key: bool = False
    related: tuple[Path, ...] = ()
    late: str = ""


def key_path(path: Path) -> str:
    """Writes a path as `robots.overrides[1].mass`."""
    text = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in path)
    return text.removeprefix(".")


def parse_key_path(text: str) -> Path | None:
    """Reads `obstacles[0].position` or `obstacles.0.position`; None if it is neither."""
    parts = text.replace("[", ".[").split(".")
    matches = [re.fullmatch(r"\[?([0-9]{1,9})\]?|([A-Za-z_][A-Za-z0-9_]*)", part) for part in parts]
    if any(
        match is None or (part[0] == "[") != (part[-1] == "]")
        for part, match in zip(parts, matches, strict=True)
    ):
        return None
    return tuple(int(match[1]) if match[1] else match[2] for match in matches if match)


def did_you_mean(word: str, names: Iterable[str], cutoff: float = 0.55) -> str:
    """`; did you mean "x"?` with the allowed name most like the word, or nothing if none is like it."""
    near = nearest(word, names, cutoff)
    return f'; did you mean "{near}"?' if near else ""


def instead(wanted: str, names: Iterable[str]) -> str:
    """`; found "x"` with the name most like one that is missing, or nothing if none is like it."""
    near = nearest(wanted, names)
    return f'; found "{near}"' if near else ""


def nearest(word: str, names: Iterable[str], cutoff: float = 0.55) -> str:
    """Return the name most like a word; empty if none is like it."""
    by_lower = {name.lower(): name for name in names if name != word}
    asked = word.lower()[:80]

    def likeness(name: str) -> float:  # which of two texts comes first makes a difference to difflib
        return max(difflib.SequenceMatcher(None, *pair).ratio() for pair in ((name, asked), (asked, name)))

    best = max(by_lower, key=likeness, default="")
    return by_lower[best] if best and likeness(best) >= cutoff else ""


def listed(names: Sequence[str]) -> str:
    """`a, b or c`; `none` of nothing."""
    return " or ".join(filter(None, (", ".join(names[:-1]), *names[-1:]))) or "none"


def shortened(text: object, most: int = 200) -> str:
    """Return text as it is, or its first part where it is longer than a message should be."""
    words = str(text)
    return words if len(words) <= most else f"{words[:most]}... ({len(words)} characters)"


def shown(value: Any) -> str:
    """A value as the reader wrote it, shortened."""
    if value is None:
        return "nothing (null)"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        return "a table of keys"
    if isinstance(value, list | tuple):
        return "an empty list" if not value else f"a list of {len(value)}"
    if isinstance(value, float) and value != value:
        return "NaN (not a number)"
    if isinstance(value, float) and value in (float("inf"), float("-inf")):
        return "infinity" if value > 0.0 else "-infinity"
    if isinstance(value, str):
        text = "".join(char if char.isprintable() else "?" for char in value[:60])
        quote = "'" if '"' in text else '"'
        return quote + text + quote + (" ..." if len(value) > 60 else "")
    if isinstance(value, int) and abs(value) >= 10**20:
        return "a whole number of more than 20 digits"
    return written(value)


def written(value: Any) -> str:
    """A value as Python writes it, or what it is where it has no text of its own."""
    try:
        return repr(value)
    except Exception:  # of a class whose `__repr__` raises
        return f"a {type(value).__name__} without a text"
