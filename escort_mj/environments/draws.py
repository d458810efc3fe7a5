"""What differs from mission to mission of an environment: keys of the scenario, drawn or set.

Domain randomization: before each mission, keys get values of their own, in the words of a study's
`sample.over`. They follow from the mission's seed alone.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np

from escort_mj.errors import UsageError
from escort_mj.scenario import Scenario
from escort_mj.scenario.arguments import argument_error
from escort_mj.study.sweeps.definition import draws_of, load_study
from escort_mj.study.sweeps.values import Range, drawn, in_order
from escort_mj.world.model.build import World

STREAM = 20  # tells what is drawn here from all else that a mission's seed is for
SHARES = (0.0, np.nextafter(1.0, 0.0))  # the ends of a range
SET = "set"
SEED = "seed"
Values = dict[str, Any]
"""Scenario keys and values."""


class Sample:
    """Draws values of scenario keys, each mission's from its seed."""

    def __init__(self, scenario: Scenario, over: Mapping[str, Any] | None) -> None:
        """Read what is drawn, and try the ends of each range and each value in a list.

        Args:
            scenario: What the keys are of.
            over: Scenario keys, and the range of each (`low`, `high`, `scale`, `whole`), or a list of values.

        Raises:
            UsageError: If it is no such table.
            ScenarioError: If a value is impossible in the scenario.
        """
        self._over: Mapping[str, Any] = {}
        if not over:
            return
        refuse_seed(over)
        study = {
            "study": "environment",
            "scenario": scenario.name,
            "sample": {"count": 1, "over": dict(over)},
        }
        self._over = draws_of(load_study(study).study)
        for key, draw in self._over.items():
            values = [drawn(draw, share) for share in SHARES] if isinstance(draw, Range) else draw
            for value in values:
                scenario.replace({key: value})

    def values(self, seed: int) -> Values:
        """Return the values of the mission with a seed; none where nothing is drawn."""
        if not self._over:
            return {}
        shares = np.random.default_rng((seed, STREAM)).random(len(self._over))
        return {key: drawn(draw, float(u)) for (key, draw), u in zip(self._over.items(), shares, strict=True)}


def mission_of(scenario: Scenario, seed: int, values: Values) -> Scenario:
    """Return the scenario of a mission.

    Args:
        scenario: That of the environment.
        seed: Of the mission.
        values: What is drawn and set.

    Raises:
        ScenarioError: If it is impossible.
    """
    return scenario.replace(in_order(values) | {SEED: seed})


def check_fits(world: World, first: World, values: Values) -> None:
    """Refuse values that make a mission of another kind than its environment is made for.

    Args:
        world: With the values.
        first: What the environment is made for.
        values: What is drawn and set.

    Raises:
        UsageError: If numbers of robots, opponents, obstacles, behaviors and the like are others, or times of
            samples.
    """
    sizes = {name: size for name, size in world.sizes.items() if size != first.sizes.get(name)}
    words = [f"{name} {first.sizes.get(name, 0)} becomes {size}" for name, size in sizes.items()]
    if world.schedule != first.schedule:
        words.append("samples are taken at other times (duration, physics.timestep, recording.rate, expect)")
    if words:
        keys = ", ".join(values)
        raise UsageError(f"{keys}: an environment is made for missions of one shape; {'; '.join(words[:3])}")


def refuse_seed(values: Mapping[str, Any]) -> None:
    """Refuse the seed among values: it has an argument of its own.

    Raises:
        UsageError: If it is among them.
    """
    if SEED in values:
        raise UsageError("seed: found among values of keys; expected as the argument seed of reset")


def values_in(options: Mapping[str, Any] | None, others: Collection[str] = ()) -> Values:
    """Return the values that options of `reset` set for the next missions.

    Args:
        options: As given.
        others: Further options that are allowed.

    Raises:
        UsageError: If there are other options, or no table of values.
    """
    allowed = [*others, SET]
    if not isinstance(options, Mapping | None):
        raise argument_error("options", options, f"a table with {' and '.join(allowed)}, or None")
    if unknown := [name for name in options or () if name not in allowed]:
        raise argument_error("options", unknown[0], f"{' and '.join(allowed)}, or none")
    values = (options or {}).get(SET) or {}
    if not isinstance(values, Mapping) or not all(isinstance(key, str) for key in values):
        raise argument_error(SET, values, 'a table of scenario keys and values, such as {"robots.mass": 2}')
    refuse_seed(values)
    return dict(values)


def told(values: Values) -> dict[str, Any]:
    """Return what infos of `reset` say of values; nothing where there are none."""
    return {SET: dict(values)} if values else {}
