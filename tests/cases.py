"""Which cases of a test are fast enough for every change: a few in which every value appears.

A test marked `crossed` has cases that differ by several parameters. Cases without a new value are slow, and
those that a test marked `slow_cases` names by a part of their ids.
"""

from collections import Counter
from collections.abc import Iterable
from typing import Any

import pytest


def mark_slow(items: Iterable[pytest.Item]) -> None:
    """Marks what is left out of the fast set."""
    tests: dict[str, list[pytest.Function]] = {}
    for item in items:
        if isinstance(item, pytest.Function) and item.get_closest_marker("crossed"):
            if not item.get_closest_marker("slow"):
                tests.setdefault(item.nodeid.partition("[")[0], []).append(item)
    for cases in tests.values():
        values = [{(name, id(value)) for name, value in case.callspec.params.items()} for case in cases]
        chosen = covering(values)
        for index, case in enumerate(cases):
            if index not in chosen:
                case.add_marker("slow")
    for item in items:
        parts = [part for mark in item.iter_markers("slow_cases") for part in mark.args]
        if parts and any(part in item.callspec.id for part in parts):
            item.add_marker("slow")


def covering(cases: list[set[Any]]) -> set[int]:
    """Return the indices of a few cases in which every value appears.

    Chosen is each time the case with the most new values; of several, the one whose values appear least
    so far, then the first.
    """
    left, seen, chosen = set[Any]().union(*cases), Counter[Any](), set[int]()
    while left:
        best = max(range(len(cases)), key=lambda k: (len(cases[k] & left), -sum(seen[v] for v in cases[k])))
        chosen.add(best)
        seen.update(cases[best])
        left -= cases[best]
    return chosen
