"""What a shell offers when Tab is pressed: names of shipped files, and files and folders from here."""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

from escort_mj.recognize import SUFFIXES, scenario_names, scenarios_folder, study_names

RUN, STUDY = "outcome.json", "results.sqlite"  # by which a folder of results is known
DEPTH = 3  # folders down
NESTED = 4  # keys of a path


def scenarios(incomplete: str) -> list[str]:
    """Names of shipped scenarios, then files from here."""
    return [*_named(scenario_names(scenarios_folder()), incomplete), *_files(incomplete)]


def studies(incomplete: str) -> list[str]:
    """Names of shipped studies, then files from here."""
    return [*_named(study_names(scenarios_folder()), incomplete), *_files(incomplete)]


def scenarios_or_studies(incomplete: str) -> list[str]:
    """Names of shipped scenarios and studies, then files from here."""
    return [*_named(study_names(scenarios_folder()), incomplete), *scenarios(incomplete)]


def overrides(incomplete: str) -> list[str]:
    """Key paths of a scenario with `=`; behind one, the words that its value may be."""
    key, equals, _ = incomplete.partition("=")
    if equals:
        return _named([f"{key}={word}" for word in _words(key)], incomplete)
    return _named([f"{path}=" for path in _key_paths()], incomplete)


def laws(incomplete: str) -> list[str]:
    """Names of laws, behind those that are typed already."""
    return _behind_commas(_words("controller"), incomplete)


def outer_loops(incomplete: str) -> list[str]:
    """Names of outer loops, behind those that are typed already."""
    return _behind_commas(_words("mission.outer"), incomplete)


def _behind_commas(names: list[str], incomplete: str) -> list[str]:
    before, comma, start = incomplete.rpartition(",")
    typed = before.split(",")
    return [f"{before}{comma}{name}" for name in names if name.startswith(start) and name not in typed]


@cache
def _schema() -> dict[str, Any]:
    """The JSON Schema that ships: it is there without anything being imported."""
    schema: dict[str, Any] = json.loads((scenarios_folder() / "schema.json").read_text(encoding="utf-8"))
    return schema


def _alternatives(node: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """A node of the schema, or each of those that it may be, with references followed."""
    if "$ref" in node:
        node = _schema()["$defs"][node["$ref"].rpartition("/")[2]]
    yield node
    for one in (*node.get("anyOf", ()), *node.get("oneOf", ())):
        yield from _alternatives(one)


def _key_paths() -> list[str]:
    """Every key path of a scenario, lists left out."""
    paths: dict[str, None] = {}

    def add(node: dict[str, Any], prefix: str, depth: int) -> None:
        for table in _alternatives(node) if depth else ():
            for key, value in table.get("properties", {}).items():
                paths.setdefault(f"{prefix}{key}")
                add(value, f"{prefix}{key}.", depth - 1)

    add(_schema(), "", NESTED)
    return [*paths]


def _words(path: str) -> list[str]:
    """The words that the value of a key may be."""
    nodes = [_schema()]
    for key in path.split("."):
        nodes = [
            table["properties"][key]
            for node in nodes
            for table in _alternatives(node)
            if key in table.get("properties", {})
        ]
    words: dict[str, None] = {}
    for node in nodes:
        for one in _alternatives(node):
            if one.get("type") == "boolean":
                words |= {"true": None, "false": None}
            for word in (*one.get("enum", ()), *([one["const"]] if "const" in one else ())):
                words[str(word).lower() if isinstance(word, bool) else str(word)] = None
    return [*words]


def runs(incomplete: str) -> list[str]:
    """Run folders."""
    return _holding((RUN,), incomplete)


def results(incomplete: str) -> list[str]:
    """Run folders and those of studies."""
    return _holding((RUN, STUDY), incomplete)


def runs_or_scenarios(incomplete: str) -> list[str]:
    """Run folders, and what may be run."""
    return [*runs(incomplete), *scenarios(incomplete)]


def _named(names: list[str], incomplete: str) -> list[str]:
    return [name for name in names if name.startswith(incomplete)]


def _files(incomplete: str) -> list[str]:
    """YAML files and folders that begin like this."""
    folder, _, start = incomplete.rpartition("/")
    within = Path(f"{folder}/") if folder or incomplete.startswith("/") else Path()
    shown = f"{folder}/" if "/" in incomplete else ""
    return [
        f"{shown}{path.name}{'/' * path.is_dir()}"
        for path in _inside(within)
        if path.name.startswith(start) and (path.is_dir() or path.suffix in SUFFIXES)
    ]


def _holding(files: tuple[str, ...], incomplete: str) -> list[str]:
    """Folders that hold one of these files, at most so deep below what has been typed."""
    folder, _, start = incomplete.rpartition("/")
    within = Path(f"{folder}/") if folder or incomplete.startswith("/") else Path()
    begun = (path for path in _inside(within) if path.is_dir() and path.name.startswith(start))
    return [path.as_posix() for top in begun for path in _down(top, files, DEPTH)]


def _down(folder: Path, files: tuple[str, ...], depth: int) -> Iterator[Path]:
    if any((folder / file).exists() for file in files):
        yield folder
    for path in _inside(folder) if depth else ():
        if path.is_dir():
            yield from _down(path, files, depth - 1)


def _inside(folder: Path) -> list[Path]:
    """What is in a folder, hidden ones left out; nothing where it cannot be read."""
    try:
        return sorted(path for path in folder.iterdir() if not path.name.startswith("."))
    except OSError:
        return []
