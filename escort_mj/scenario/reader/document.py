"""YAML text read into plain data that remembers the place of every key and value.

Only what JSON also has is read: tables, lists, text, numbers, true, false and null, written as YAML 1.2
writes them. Aliases, tags, duplicate keys and keys that are no text are refused, so that nothing in a
file can run code, grow without bound, or be silently overwritten.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, NamedTuple

from ruamel.yaml import YAML
from ruamel.yaml import events as yaml_events
from ruamel.yaml.error import MarkedYAMLError

from escort_mj.errors import Fault, ScenarioError
from escort_mj.scenario.findings import Path, key_path, shown

MAX_DEPTH = 12

_NULL = re.compile(r"(?:~|null|Null|NULL|)\Z")
_TRUE = re.compile(r"(?:true|True|TRUE)\Z")
_FALSE = re.compile(r"(?:false|False|FALSE)\Z")
_INTEGER = re.compile(r"[-+]?[0-9]+\Z")
_BASED = re.compile(r"0o[0-7]+\Z|0x[0-9a-fA-F]+\Z")
_FLOAT = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?\Z")
_INFINITY = re.compile(r"[-+]?\.(?:inf|Inf|INF)\Z")
_NAN = re.compile(r"\.(?:nan|NaN|NAN)\Z")
_LONGEST_INTEGER = 300
_SURROGATES = re.compile("[\ud800-\udfff]")
SMALLEST = 1e-37  # MuJoCo reads corners of meshes as 32-bit floats and takes no number that has fewer digits


class Place(NamedTuple):
    """Where something is written: source, line and column from 1 (0 where there is none)."""

    source: str
    line: int = 0
    column: int = 0


@dataclass
class Document:
    """Plain data and the place of each of its parts.

    Attributes:
        data: Dicts, lists, text, numbers, booleans and None.
        values: Place of the value at each path.
        keys: Place of the key at each path that ends in a key.
        overridden: Paths whose values were set beside the text.
    """

    data: Any = None
    values: dict[Path, Place] = field(default_factory=dict)
    keys: dict[Path, Place] = field(default_factory=dict)
    overridden: set[Path] = field(default_factory=set)

    def copy(self) -> Document:
        """Return a document that can be changed without changing this one."""
        return Document(_copied(self.data), self.values.copy(), self.keys.copy(), self.overridden.copy())

    def place(self, path: Path, at_key: bool = False) -> Place:
        """Place of what stands at a path, or of the nearest thing around it."""
        if at_key and path in self.keys:
            return self.keys[path]
        while path and path not in self.values:
            path = path[:-1]
        return self.values.get(path, Place(""))

    def is_overridden(self, path: Path) -> bool:
        """Whether what stands at a path, or the nearest thing around it, was set beside the text."""
        while path and path not in self.values:
            path = path[:-1]
        return path in self.overridden


def _copied(data: Any) -> Any:
    """Plain data with dicts and lists of its own."""
    if isinstance(data, dict):
        return {key: _copied(value) for key, value in data.items()}
    return [_copied(value) for value in data] if isinstance(data, list) else data


def plain_scalar(text: str) -> Any:
    """What an unquoted word means in YAML 1.2's core schema."""
    if _NULL.match(text):
        return None
    if _TRUE.match(text) or _FALSE.match(text):
        return bool(_TRUE.match(text))
    if _BASED.match(text) or _INTEGER.match(text):
        return (int(text, 0) if _BASED.match(text) else int(text)) if len(text) <= _LONGEST_INTEGER else text
    if _FLOAT.match(text):
        return float(text)
    if _INFINITY.match(text):
        return float(text.replace(".", "", 1))
    if _NAN.match(text):
        return float("nan")
    return text


def whole_characters(text: str) -> str:
    """Return text with each pair of surrogates as the one character that JSON means by it."""
    if not _SURROGATES.search(text):
        return text
    return text.encode("utf-16-le", "surrogatepass").decode("utf-16-le", "surrogatepass")


def read_document(text: str, source: str) -> Document:
    """Reads YAML text.

    Args:
        text: The whole text.
        source: What to call it in messages.

    Raises:
        ScenarioError: If it is not YAML, or uses what is refused; carries every fault found.
    """
    return _read(text, source).copy()


@lru_cache(maxsize=16)  # who runs or checks one scenario often reads it once
def _read(text: str, source: str) -> Document:
    reader = _Reader(source)
    try:
        document = reader.whole(iter(YAML(typ="safe", pure=True).parse(text)))
    except ScenarioError:
        raise
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        what = error.problem or error.context or "it cannot be read"
        context = f" {error.context}" if error.problem and error.context else ""
        line, column = (mark.line + 1, mark.column + 1) if mark else (0, 0)
        raise ScenarioError([Fault(f"this is not YAML:{context} {what}", "", line, column, source)]) from None
    except Exception as error:  # whatever else the YAML parser stumbles over, it is the text's fault
        position = getattr(error, "position", None)
        line, column = line_and_column(text, position) if isinstance(position, int) else (0, 0)
        reason = str(error).partition("\n")[0][:200]
        raise ScenarioError([Fault(f"this is not YAML: {reason}", "", line, column, source)]) from None
    if reader.faults:
        raise ScenarioError(reader.faults)
    return document


def is_control(letter: str) -> bool:
    """Whether a character is none that text can have: a control character, half of a pair, or none at all.

    Line breaks and tabs are allowed; XML and NetCDF cannot hold what is refused.
    """
    return (unicodedata.category(letter) in ("Cc", "Cs") and letter not in "\n\t") or letter in "\ufffe\uffff"


def unprintable(text: str) -> str:
    """What is wrong with the first character that no text can have; empty without one."""
    found = next((letter for letter in text if is_control(letter)), None)
    if found is None:
        return ""
    return f"found the character U+{ord(found):04X}; allowed are line breaks, tabs and letters"


def too_small(value: Any) -> str:
    """What is wrong with a number that is neither 0 nor large enough; empty if nothing is."""
    if not isinstance(value, float) or not 0.0 < abs(value) < SMALLEST:
        return ""
    return f"found {value!r}; expected 0 or a number of at least {SMALLEST:g} in size"


def line_and_column(text: str, position: int) -> tuple[int, int]:
    """Line and column, from 1, of a position in a text."""
    before = text[:position]
    return before.count("\n") + 1, position - (before.rfind("\n") + 1) + 1


class _Reader:
    """Builds a document from the parser's events."""

    def __init__(self, source: str) -> None:
        self.source = source
        self.faults: list[Fault] = []
        self.refused: set[str] = set()
        self.document = Document()

    def whole(self, events: Iterator[Any]) -> Document:
        documents = 0
        for event in events:
            if isinstance(event, yaml_events.DocumentStartEvent):
                documents += 1
                if documents > 1:
                    self.fault(event, (), "found a second document (---); a scenario is one")
                    break
                self.document.data = self.value(next(events), events, ())
        return self.document

    def value(self, event: Any, events: Iterator[Any], path: Path) -> Any:
        self.document.values[path] = self.place(event)
        if len(path) > MAX_DEPTH:
            self.fault(event, path, f"found more than {MAX_DEPTH} levels of nesting")
            raise ScenarioError(self.faults)
        self.refuse(event, path)
        if isinstance(event, yaml_events.MappingStartEvent):
            return self.mapping(events, path)
        if isinstance(event, yaml_events.SequenceStartEvent):
            items: list[Any] = []
            while not isinstance(event := next(events), yaml_events.SequenceEndEvent):
                items.append(self.value(event, events, (*path, len(items))))
            return items
        if isinstance(event, yaml_events.ScalarEvent):
            return self.scalar(event, path)
        return None

    def scalar(self, event: Any, path: Path) -> Any:
        text = whole_characters(event.value)
        self.refuse_control(text, event, path)
        if not event.implicit[0]:
            return text
        value = plain_scalar(event.value)
        if wrong := too_small(value):
            self.fault(event, path, wrong)
        return value

    def mapping(self, events: Iterator[Any], path: Path) -> dict[str, Any]:
        table: dict[str, Any] = {}
        while not isinstance(event := next(events), yaml_events.MappingEndEvent):
            if not isinstance(event, yaml_events.ScalarEvent) or not isinstance(event.value, str):
                self.fault(event, path, "found a key that is not a plain word")
                raise ScenarioError(self.faults)
            key = whole_characters(event.value)
            here = (*path, key)
            self.refuse(event, here)
            self.refuse_control(key, event, path)
            if key in table:
                first = self.document.keys[here].line
                self.fault(
                    event, here, f"found the key {shown(key)} twice; it stands in line {first} already"
                )
                self.value(next(events), events, here)
                continue
            self.document.keys[here] = self.place(event)
            value = next(events)
            table[key] = self.value(value, events, here)
            if table[key] is None and value.start_mark.index == value.end_mark.index:
                self.document.values[here] = self.document.keys[here]  # nothing was written after the key
        return table

    def refuse(self, event: Any, path: Path) -> None:
        """Note what is not read at all; the first of each kind, for a bomb has many."""
        if isinstance(event, yaml_events.AliasEvent):
            self.fault_once("anchor", event, path, f"found the alias *{event.anchor}; write the value out")
        elif event.anchor is not None:
            self.fault_once("anchor", event, path, f"found the anchor &{event.anchor}; write each value out")
        if getattr(event, "tag", None) is not None:
            tag = str(event.tag).replace("tag:yaml.org,2002:", "!!")
            self.fault_once(
                "tag", event, path, f"found the tag {shown(tag)}; tags are not allowed, leave it out"
            )

    def refuse_control(self, text: str, event: Any, path: Path) -> None:
        """Note a character that files, pictures and terminals cannot hold or show."""
        if wrong := unprintable(text):
            self.fault(event, path, wrong)

    def fault_once(self, kind: str, event: Any, path: Path, message: str) -> None:
        if kind not in self.refused:
            self.refused.add(kind)
            self.fault(event, path, message)

    def fault(self, event: Any, path: Path, message: str) -> None:
        place = self.place(event)
        self.faults.append(Fault(message, key_path(path), place.line, place.column, place.source))

    def place(self, event: Any) -> Place:
        return Place(self.source, event.start_mark.line + 1, event.start_mark.column + 1)
