"""Scenarios by any source: a file, the name of a shipped one, or keys."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from escort_mj.errors import UsageError
from escort_mj.recognize import SUFFIXES, is_scenario_name, scenario_names, scenarios_folder, study_names
from escort_mj.scenario.arguments import Overrides, Source, checked
from escort_mj.scenario.findings import did_you_mean, shortened, written
from escort_mj.scenario.reader.load import load_file, scenario_of
from escort_mj.scenario.schema.scenario import Scenario


def shipped_scenarios() -> list[str]:
    """Names of the scenarios that come with the package."""
    return scenario_names(scenarios_folder())


@checked
def load_scenario(
    source: Scenario | Source, overrides: Overrides = (), plugins: Sequence[str] = (), **keys: Any
) -> Scenario:
    """Load and validate a scenario.

    If an override shortens the run, expectations whose windows it does not reach are not judged.

    Args:
        source: A YAML file, the name of a shipped scenario such as `main` or `paper/case1_2d`, or a mapping
            with keys and values as in a file; or a scenario, to be changed.
        overrides: A mapping of key paths to values, or texts `key.path=value`, to set there.
        plugins: Additional plugins: Python files or names of installed plugins.
        keys: Further keys with their values, such as `duration=10, seed=3`.

    Raises:
        ScenarioError: With all faults of the file.
        UsageError: If `source` is of another kind, or there is no such file or shipped scenario.
    """
    if keys:
        overrides = (*([overrides] if isinstance(overrides, str | Mapping) else overrides), keys)
    if isinstance(source, Scenario):
        if not overrides and not plugins:
            return source
        return scenario_of(source, overrides, plugins, None if plugins else type(source))
    if isinstance(source, Mapping):
        return scenario_of(source, overrides, plugins)
    return load_file(scenario_path(source), overrides, plugins)


def scenario_path(path: str | os.PathLike[str]) -> str | os.PathLike[str]:
    """The file of a scenario: as given, or the shipped one of that name.

    Raises:
        UsageError: If there is no such file or shipped scenario.
    """
    name, folder = _named(path, "scenario"), scenarios_folder()
    if is_scenario_name(name, folder) and (os.path.isdir(name) or not os.path.exists(name)):
        return folder / f"{name}.yaml"
    return _shipped(path, "scenario", shipped_scenarios)


def study_path(path: str | os.PathLike[str]) -> Path:
    """The file of a study: as given, or the shipped one of that name, such as `studies/minute`.

    Raises:
        UsageError: If there is neither such a file nor such a shipped study.
    """
    return Path(_shipped(path, "study", lambda: study_names(scenarios_folder())))


def _shipped(
    path: str | os.PathLike[str], what: str, shipped: Callable[[], list[str]]
) -> str | os.PathLike[str]:
    """A file as it was given, or the shipped one of that name."""
    name = _named(path, what)
    folder = os.path.isdir(name)
    if name.endswith(SUFFIXES) or (os.path.exists(name) and not folder):
        return path
    if name not in (names := shipped()):
        if folder:
            return path  # who reads it says that it is one
        names_all = {"scenario": "scenarios", "study": "studies"}[what]
        hint = did_you_mean(name, names, cutoff=0.6) or f"; `escort-mj list {names_all}` names these"
        raise UsageError(f"{shortened(name)}: there is no such file or shipped {what}{hint}")
    return scenarios_folder() / f"{name}.yaml"


def _named(path: str | os.PathLike[str], what: str) -> str:
    """What was given as a path or name.

    Raises:
        UsageError: If it is something else.
    """
    name = os.fspath(path) if isinstance(path, str | os.PathLike) else None
    if not isinstance(name, str):
        found = shortened(written(path), 80)
        raise UsageError(
            f"{what}: found {found}; expected a file, the name of a shipped {what}, or a mapping"
        )
    return name
