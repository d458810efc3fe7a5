"""The bodies of a mission in one order, and their groups: what contacts and clearances are named after."""

from __future__ import annotations

import re
from typing import Literal, NamedTuple

from escort_mj.monitor.signals import FLOOR, GROUPS, ROBOTS, TARGET
from escort_mj.scenario.geometry.obstacles import obstacles_of
from escort_mj.scenario.geometry.placement import robot_count
from escort_mj.scenario.schema.scenario import Scenario

BodyMotion = Literal["free", "driven", "led", "still"]
"""Free by its own forces, driven along a motion by a force, led (put where it is to be), or still."""


class Bodies(NamedTuple):
    """Every body that can touch another: robots, target, obstacles and walls, floor, in this order.

    Target and floor have their places in every mission, those without a target or in space, too.

    Attributes:
        names: Name of each body, shape (bodies,).
        groups: Group of each body, shape (bodies,).
        watched: Groups whose clearances are watched: `GROUPS`, then single bodies by name.
        motions: How each body moves, shape (bodies,).
    """

    names: tuple[str, ...]
    groups: tuple[str, ...]
    watched: tuple[str, ...]
    motions: tuple[BodyMotion, ...]

    @property
    def columns(self) -> list[tuple[int, int]]:
        """Place in `watched` of each body's group, and of the body itself; -1 for none."""
        places = {name: place for place, name in enumerate(self.watched)}
        single = {name: place for name, place in places.items() if name not in GROUPS}
        return [
            (places.get(group, -1), single.get(name, -1))
            for name, group in zip(self.names, self.groups, strict=True)
        ]


def bodies_of(scenario: Scenario) -> Bodies:
    """The bodies of a scenario."""
    robots, obstacles = robot_count(scenario), obstacles_of(scenario)
    motions: list[BodyMotion] = ["free"] * robots
    motions.append("driven" if scenario.target is not None and scenario.target.drive is not None else "led")
    motions += ["still" if body.drive is None else "driven" for body in obstacles]
    return Bodies(
        (*(f"robot_{i}" for i in range(1, robots + 1)), TARGET, *(body.name for body in obstacles), FLOOR),
        (*[ROBOTS] * robots, TARGET, *(body.group for body in obstacles), FLOOR),
        (*GROUPS, *_expected(scenario)),
        (*motions, "still"),
    )


def _expected(scenario: Scenario) -> list[str]:
    """Single bodies that clearances have to be watched to, for the expectations to be judged.

    Those of a robot or of the target to a group are watched anyway.
    """
    pairs = [sides for one in scenario.expect if (sides := one.watched_sides) is not None]
    by_name = [pair for pair in pairs if not any(_moves(a) and b in GROUPS for a, b in (pair, pair[::-1]))]
    return list(dict.fromkeys(other if _moves(one) else one for one, other in by_name))


def _moves(side: str) -> bool:
    """Whether clearances are watched from a side: from robots and the target."""
    return side in (ROBOTS, TARGET) or re.fullmatch(r"robot_\d+", side) is not None
