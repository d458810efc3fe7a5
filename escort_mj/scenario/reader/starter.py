"""A first scenario to change: short, complete, and with the schema's own words beside every key."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator
from typing import Any

from escort_mj.scenario.findings import Path
from escort_mj.scenario.reader.dump import flow
from escort_mj.scenario.reader.files.paths import locate

WIDTH = 100  # columns of a comment
SCHEMA = "# yaml-language-server: $schema=schema.json"


def starter(name: str, robots: int = 6, axes: int = 2, law: str = "apd_smc") -> str:
    """A commented scenario in which robots gather around a moving target, past an obstacle.

    Args:
        name: Of the scenario.
        robots: How many.
        axes: 2 for the plane, 3 for space.
        law: Of the inner loop.

    Returns:
        YAML that `parse_scenario` takes as it is.
    """
    rest = [0.0] * (axes - 2)
    radius = max(3.0, 0.5 * robots if axes == 2 else robots**0.5)  # room for a safe distance between robots
    scenario: dict[str, Any] = {
        "name": name,
        "seed": 1,
        "duration": 40.0,
        "axes": axes,
        "target": {"position": ["0.4*t", "sin(0.2*t)", *rest]},
        "robots": {
            "count": robots,
            "mass": 1.0,
            "radius": 0.2,
            "force_limit": 10.0,
            "placement": {"within": 2.0 * radius, "least_gap": 1.0},
        },
        "obstacles": [{"position": [5.0 + radius, radius, *rest], "radius": 0.6}],
        "mission": {
            "radius": radius,
            "behaviors": [{"behavior": "avoid_obstacles", "safe_distance": 0.8}, "vertices", "surface"],
            "max_speed": 2.0,
        },
        "controller": law,
        "expect": [
            {"metric": "contacts", "at_most": 0},
            {"metric": "radius_error_mean", "at_most": 0.05, "after": 35.0},
        ],
    }
    return "\n".join([SCHEMA, *_commented(scenario, ())]) + "\n"


def _commented(table: dict[str, Any], path: Path) -> Iterator[str]:
    """Lines of a table, each key after what the schema says of it."""
    indent = "  " * len(path)
    for key, value in table.items():
        for line in textwrap.wrap(locate((*path, key)).meaning, WIDTH - len(indent)):
            yield f"{indent}# {line}"
        if isinstance(value, dict) and key != "placement":
            yield f"{indent}{key}:"
            yield from _commented(value, (*path, key))
        elif isinstance(value, list) and any(isinstance(item, dict) for item in value):
            yield f"{indent}{key}:"
            yield from (f"{indent}  - {_inline(item)}" for item in value)
        else:
            yield f"{indent}{key}: {_inline(value)}"


def _inline(value: Any) -> str:
    """A value in one line, keys without the quotes that they do not need."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_inline(inner)}" for key, inner in value.items()) + "}"
    return flow(value)
