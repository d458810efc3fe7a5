"""What a shell offers when Tab is pressed: names of shipped files, and files and folders from here."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from escort_mj.recognize import SUFFIXES, scenario_names, scenarios_folder, study_names

RUN, STUDY = "outcome.json", "results.sqlite"  # by which a folder of results is known
DEPTH = 3  # folders down


def scenarios(incomplete: str) -> list[str]:
    """Names of shipped scenarios, then files from here."""
    return [*_named(scenario_names(scenarios_folder()), incomplete), *_files(incomplete)]


def studies(incomplete: str) -> list[str]:
    """Names of shipped studies, then files from here."""
    return [*_named(study_names(scenarios_folder()), incomplete), *_files(incomplete)]


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
