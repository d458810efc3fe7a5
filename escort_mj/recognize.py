"""Which files are scenarios, and which of those the program wrote; loads nothing that takes time."""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Iterator
from functools import cache
from pathlib import Path

SUFFIXES = (".yaml", ".yml")
OUTCOME, SCENARIO, RESOLVED = "outcome.json", "scenario.yaml", "resolved.yaml"  # in a run folder
RESULTS, BEST = "results.sqlite", "best.yaml"  # of a study
WORST, COUNTEREXAMPLES = "worst", "counterexamples"
TITLE = '"title": "escort_mj scenario'  # in the JSON Schema that a scenario's first lines name
HEAD = 4096  # bytes in which a file says what it is
TELLING = {"robots", "target", "obstacles", "mission", "controller", "uncertainty", "expect"}

_MODELINE = re.compile(r"^#\s*yaml-language-server:\s*\$schema=(\S+)", re.MULTILINE)
_TOP_KEY = re.compile(r"^([A-Za-z_]+)\s*:", re.MULTILINE)


def scenarios_folder() -> Path:
    """Folder of the shipped scenarios: inside an installed package, or beside the package in a checkout."""
    package = Path(__file__).parent
    return package / "scenarios" if (package / "scenarios").is_dir() else package.parent / "scenarios"


def irregular(path: Path) -> str:
    """Return what a path is that is no file or folder, such as a FIFO; empty for these, and for nothing.

    A FIFO without a writer, or a terminal, would be waited for until the program is stopped.
    """
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError):
        return ""
    kinds = {"a FIFO": stat.S_ISFIFO, "a socket": stat.S_ISSOCK}
    kinds |= {"a device": lambda one: stat.S_ISCHR(one) or stat.S_ISBLK(one)}
    return next((kind for kind, is_one in kinds.items() if is_one(mode)), "")


def is_scenario(path: Path, asked: bool = False) -> bool:
    """Whether a YAML file is a scenario, by its first lines.

    It is one where its first lines name the JSON Schema of scenarios (`# yaml-language-server: $schema=...`).
    A file without such a line, or whose line names a file that is not there (a copied scenario), is one
    only if scenarios were asked for, and it has a key of theirs.

    Args:
        path: A file.
        asked: Whether scenarios were asked for.
    """
    if path.suffix not in SUFFIXES:
        return False
    if irregular(path):
        return False
    try:
        with path.open("rb") as file:
            head = file.read(HEAD).decode("utf-8", "replace")
    except (OSError, ValueError):
        return False
    if match := _MODELINE.search(head):
        schema = (path.parent / match[1]).resolve()
        if _is_our_schema(schema) or re.search("escort[-_]mj", match[1]):
            return True
        if "://" in match[1] or schema.exists():
            return False
    keys = set(_TOP_KEY.findall(head))
    return asked and "study" not in keys and not TELLING.isdisjoint(keys)


def is_output(path: Path) -> bool:
    """Whether a YAML file is part of what a run or a study left, wherever that lies.

    Whatever else lies in such a folder is none: somebody put it there.

    Args:
        path: A file.
    """
    folder = path.parent
    if path.name in (SCENARIO, RESOLVED):
        return (folder / OUTCOME).is_file()
    if folder.name in (WORST, COUNTEREXAMPLES):
        return (folder.parent / RESULTS).is_file()
    return path.name == BEST and (folder / RESULTS).is_file()


@cache
def _is_our_schema(path: Path) -> bool:
    """Whether a file is the JSON Schema of scenarios."""
    try:
        return path.is_file() and TITLE in path.read_text(encoding="utf-8")
    except (OSError, ValueError):
        return False


def scenario_names(folder: Path) -> list[str]:
    """Names of the scenarios of a folder, such as `paper/case1_2d`; studies are none."""
    return sorted(path.relative_to(folder).with_suffix("").as_posix() for path in scenarios_in(folder))


def is_scenario_name(name: str, folder: Path) -> bool:
    """Whether a scenario of a folder has this name; reads its file only, while `scenario_names` reads all."""
    inside = not any(part == "" or part.startswith(".") for part in name.split("/"))
    return inside and is_scenario(folder / f"{name}.yaml", asked=True)


def study_names(folder: Path) -> list[str]:
    """Names of the studies of a folder, such as `studies/minute`."""
    return sorted(
        path.relative_to(folder).with_suffix("").as_posix()
        for path in folder.rglob("*.yaml")
        if re.search(r"^study\s*:", path.read_text(encoding="utf-8"), re.MULTILINE)
    )


def scenarios_in(folder: Path) -> Iterator[Path]:
    """Every scenario in a folder and the folders in it, in order.

    Hidden folders are left out, and what runs and studies left.
    """
    found: list[Path] = []
    for parent, folders, files in os.walk(folder):  # what goes meanwhile, or may not be read, is passed over
        folders[:] = [name for name in folders if not name.startswith(".")]
        found += [Path(parent, name) for name in files if not name.startswith(".")]
    for path in sorted(found):
        if os.path.isfile(path) and is_scenario(path, asked=True) and not is_output(path):
            yield path
