"""Causes of touches: one mission for each rule, and touches that no rule may explain."""

from typing import Any

import numpy as np
import pytest

from escort_mj.metrics.causes import CAUSES, causes_of
from escort_mj.mission import fly
from escort_mj.scenario import parse_scenario


def recomputed_touches_unexplained(again: Any) -> float:
    """In test_recomputed.py, robots without motors start on their way into each other; those with do not."""
    return again.contacts() if np.abs(again.force).max() > 1e-9 else 0.0


HEAD = "target: null\n"
AT_A_ROCK = """
robots: {positions: [[0, 0]]}
obstacles: [{name: rock, position: [3, 0]}]
mission: {max_speed: 2, outer: OUTER, behaviors: [BEHAVIORS {behavior: goal, goals: [[6, 0]]}]}
"""
AVOIDING = AT_A_ROCK.replace("OUTER", "set_based").replace(
    "BEHAVIORS", "{behavior: avoid_obstacles, safe_distance: 0.3},"
)
STAYING = """
mission:
  outer: set_based
  max_speed: 1
  behaviors: [{behavior: avoid_obstacles, safe_distance: 0.3}, {behavior: goal, goals: GOALS}]
"""
CART = "obstacles: [{name: cart, shape: box, size: [0.5, 0.9], motion: {position: ['-5 + SPEED*t', 0]}}]\n"
CORRIDOR = "walls: [{points: [[-6, 0], [1, 0]], corridor: 2}, {points: [[1, -1.5], [1, 1.5]]}]\n"
ALONE = "robots: {positions: [[0, 0]]}\n" + STAYING.replace("GOALS", "[[0, 0]]")
LEAPING = ALONE + CART.replace("0.9", "0.2").replace("-5 + SPEED*t", "-0.95 + 6*max(t - 1.5, 0)")
PAIR = "robots: {positions: [[0, 0], [0.9, 0]]}\n" + STAYING.replace("GOALS", "[[0, 0], [0.9, 0]]")


def causes(text: str) -> list[str]:
    flight = fly(parse_scenario(HEAD + ("" if "duration" in text else "duration: 3\n") + text))
    assert flight.outcome.good
    found = causes_of(flight.recording)
    assert flight.measures["touches_unexplained"].value == sum(each.cause == "unexplained" for each in found)
    return [each.cause for each in found]


@pytest.mark.parametrize(
    ("text", "first"),
    [
        (AVOIDING + "uncertainty: {disturbance: [12, 0]}\n", "disturbed"),
        (AVOIDING + "sensing: {position: {bias: [-0.6, 0]}}\n", "misled"),
        (AVOIDING.replace("[[0, 0]]", "[[2, 0]], velocities: [[6, 0]]"), "started"),
        (ALONE + CART.replace("SPEED", "4").replace("0.9", "2"), "outrun"),
        (LEAPING, "outrun"),
        (ALONE + CART.replace("SPEED", "0.9") + "duration: 7\n" + CORRIDOR, "boxed in"),
    ],
)
def test_rules_find_causes(text: str, first: str) -> None:
    assert causes(text)[0] == first


def test_who_is_pushed_into_another_is_pushed() -> None:
    found = causes(PAIR + CART.replace("SPEED", "4").replace("0.9", "2"))
    assert found[0] == "outrun"
    assert "pushed" in found
    assert "unexplained" not in found


@pytest.mark.parametrize(
    "text",
    [
        AT_A_ROCK.replace("OUTER", "nsb").replace("BEHAVIORS", ""),
        ALONE.replace("set_based", "nsb").replace("{behavior: avoid_obstacles, safe_distance: 0.3}, ", "")
        + CART.replace("SPEED", "0.9")
        + "duration: 6\n",
        AVOIDING.replace("0.3}", "0.3, gain: printed}").replace(
            "set_based", "{loop: set_based, braking: 500}"
        )
        + "controller: {law: pd, derivative_gain: 1}\n",
    ],
    ids=["no avoidance", "it could have fled", "it brakes too late"],
)
def test_defects_of_avoidance_stay_unexplained(text: str) -> None:
    """Whatever lets robots run into things that they could have kept clear of is no cause."""
    assert causes(text)[0] == "unexplained"


def test_without_touches_there_is_nothing_to_explain() -> None:
    assert causes(AVOIDING) == []


def test_every_cause_says_its_rule() -> None:
    assert list(CAUSES) == ["pushed", "started", "disturbed", "misled", "outrun", "boxed in"]
