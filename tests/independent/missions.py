"""What variations are made of: missions, and what is asked of them.

A mission asks questions: expectations without a bound. Bounds come from the watcher's own values, a hair to
either side, so that any wrong value turns a verdict.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

Keys = dict[str, Any]
NO_FORCE = 1e-9  # a force limit that leaves robots to physics alone [N]


@dataclass(frozen=True)
class Variation:
    """A mission and what is asked of it.

    Attributes:
        name: What it is about.
        keys: The scenario, without expectations.
        questions: Expectations without bounds.
    """

    name: str
    keys: Keys
    questions: Sequence[Keys]


def mission(duration: float, axes: int = 2, rate: float = 50.0, timestep: float = 0.002, **keys: Any) -> Keys:
    """Return a scenario; a target that is not given is far away, robots that are not given as well."""
    far = [0.0] * (axes - 2)
    given: Keys = {
        "duration": duration,
        "axes": axes,
        "physics": {"timestep": timestep},
        "recording": {"rate": rate},
        "target": {"position": [0, 50, *far]},
        "robots": drifting([[60, 50, *far], [-60, 50, *far]]),
        "mission": {"radius": 60, "behaviors": ["surface"]},
    }
    return given | keys


def drifting(positions: Sequence[Sequence[float]], velocities: Any = None, **keys: Any) -> Keys:
    """Return robots that nothing but touches moves."""
    at_rest = [[0.0] * len(each) for each in positions]
    base = {"positions": positions, "velocities": velocities or at_rest, "mass": 1000}
    return {**base, "force_limit": NO_FORCE, **keys}


NONE: Keys = {"contacts": "none"}
COUNT: Keys = {"metric": "contacts"}
ROBOTS: Keys = {"metric": "robot_clearance_min"}
OBSTACLES: Keys = {"metric": "obstacle_clearance_min"}
TUNNELING: list[Keys] = [{"metric": "tunneling"}, {"sanity": ["tunneling"]}]


def apart(one: str, other: str) -> Keys:
    """Ask for the clearance of two sides."""
    return {"clearance": [one, other]}


def touching(one: str, other: str, *bounds: str) -> list[Keys]:
    """Ask for the number of touches of two sides, and for what else bounds them."""
    return [{"contacts": [one, other], "of": bound} for bound in ("count", *bounds)]
