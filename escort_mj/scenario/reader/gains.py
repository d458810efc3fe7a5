"""`gains: auto` in the table of a law: gains that fit its robots, written into it once it is checked."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from escort_mj.laws.gains import LAWS_WITH_A_RULE
from escort_mj.scenario.findings import Finding, Path, listed, shown
from escort_mj.scenario.geometry.team_gains import law_of, proposal
from escort_mj.scenario.schema.scenario import Scenario

KEY, AUTO = "gains", "auto"


def without_gains(data: dict[str, Any]) -> tuple[dict[str, Any], list[Path], list[Finding]]:
    """Return plain data without `gains`, the tables of laws where it was `auto`, and what is wrong with it.

    Args:
        data: What a scenario says; it is not changed.
    """
    auto: list[Path] = []
    wrong = []
    for path, table in _laws(data):
        if KEY not in table:
            continue
        data = _put(data, path, {key: value for key, value in table.items() if key != KEY})
        if table[KEY] == AUTO:
            auto.append(path)
        else:
            words = f"found {shown(table[KEY])}; allowed is auto, or no such key"
            wrong.append(Finding((*path, KEY), words))
    return data, auto, wrong


def with_gains(
    data: dict[str, Any], scenario: Scenario, auto: Sequence[Path]
) -> tuple[dict[str, Any], list[Finding]]:
    """Return plain data with the gains that fit; those that it names itself stay.

    Args:
        data: Plain data without `gains`; it is not changed.
        scenario: What it describes.
        auto: Tables of laws that get gains.
    """
    wrong = []
    for path, table in _laws(data):
        if path not in auto:
            continue
        found, law = proposal(scenario, path[:-1]), str(law_of(scenario, path[:-1]).law)
        if found is not None:
            data = _put(data, path, {**found.gains, "law": found.law, **table})
            continue
        words = f"found auto with the law {law}; there is a rule for {listed(list(LAWS_WITH_A_RULE))}"
        if law in LAWS_WITH_A_RULE:
            words = "found auto, but the servos of the robots move them: the law's gains have no effect"
        wrong.append(Finding((*path, KEY), words))
    return data, wrong


def _laws(data: dict[str, Any]) -> Iterator[tuple[Path, dict[str, Any]]]:
    """Yield the tables of laws in plain data: of the mission, of teams, and of single robots."""
    robots = data.get("robots")
    lists: list[tuple[Path, Any]] = [(("teams",), data.get("teams"))]
    if isinstance(robots, dict):
        lists.append((("robots", "overrides"), robots.get("overrides")))
    owners: list[tuple[Path, Any]] = [((), data)]
    for path, tables in lists:
        owners += [((*path, k), table) for k, table in enumerate(tables if isinstance(tables, list) else [])]
    for path, owner in owners:
        if isinstance(owner, dict) and isinstance(owner.get("controller"), dict):
            yield (*path, "controller"), owner["controller"]


def _put(data: Any, path: Path, value: Any) -> Any:
    """Return plain data with another value at a path; the data is not changed."""
    if not path:
        return value
    again: Any = dict(data) if isinstance(data, dict) else list(data)
    again[path[0]] = _put(data[path[0]], path[1:], value)
    return again
