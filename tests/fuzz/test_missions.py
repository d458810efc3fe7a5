"""Whatever a valid scenario asks: the run completes, or ends with an outcome that is stated."""

from __future__ import annotations

import random

import pytest

from escort_mj.api import fly
from escort_mj.errors import ScenarioError
from escort_mj.record.outcome import Outcome
from escort_mj.scenario.reader.load import parse_scenario
from tests.fuzz.missions import mission

STATED = {Outcome.COMPLETED, Outcome.DIVERGED, Outcome.UNSTABLE}


def flown(first: int, count: int) -> list[str]:
    """Flies drawn missions; says of each that was flown how it ended."""
    outcomes = []
    for seed in range(first, first + count):
        try:
            scenario = parse_scenario(mission(random.Random(seed)), f"{seed}.yaml")
        except ScenarioError:
            continue
        run = fly(scenario)
        assert run.outcome in STATED and run.message, seed
        assert run.verdicts[0].passed == (run.outcome is Outcome.COMPLETED), seed
        assert len(run.trace["time"]) > 0, seed
        outcomes.append(run.outcome.value)
    return outcomes


@pytest.mark.parametrize(("count", "least"), [(20, 7), pytest.param(40, 15, marks=pytest.mark.slow)])
def test_some_drawn_missions(count: int, least: int) -> None:
    assert len(flown(0, count)) > least


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("block", range(10))
def test_a_thousand_drawn_missions(block: int) -> None:
    outcomes = flown(1000 + 100 * block, 100)
    assert len(outcomes) > 40
    assert len(set(outcomes)) > 1  # some of what is drawn cannot go well
