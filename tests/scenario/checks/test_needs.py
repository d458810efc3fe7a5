"""What metrics and expectations need of a mission: those that ship and a plugin's say it themselves."""

from pathlib import Path

import pytest

from escort_mj import load_scenario
from escort_mj.errors import ScenarioError, UsageError
from escort_mj.metrics import METRICS
from escort_mj.metrics.metric import NEEDS, metric
from escort_mj.scenario.checks.expectations import LACKS

PLUGIN = '''
from escort_mj.plugins import Measure, metric


@metric(unit="m", needs=("goals",))
def left(trace):
    """Mean distance to goals."""
    return Measure(0.0)
'''


def test_each_lack_has_its_words_and_some_metric() -> None:
    assert {*LACKS} == {*NEEDS}
    assert {need for one in METRICS for need in one.needs} == {*NEEDS} - {"target"}


def test_a_plugins_metric_is_refused_where_it_would_have_no_value(tmp_path: Path) -> None:
    (tmp_path / "left.py").write_text(PLUGIN)
    scenario = tmp_path / "mission.yaml"
    scenario.write_text("plugins: [left.py]\nexpect:\n  - {metric: left, at_most: 1}\n")
    with pytest.raises(ScenarioError, match=r"3:14: .*found left, but robots have no goals: it would have"):
        load_scenario(scenario)
    goal = {"mission.behaviors": ["avoid_obstacles", {"behavior": "goal", "goals": "opposite"}]}
    assert load_scenario(scenario, goal).expect[0].needs == ("goals",)


@pytest.mark.parametrize("needs", ["goals", ["goals"], ("gaols",), ("goals", 3), ({},)])
def test_what_there_is_not(needs: object) -> None:
    with pytest.raises(UsageError, match="expected a tuple of some of beliefs, goals"):
        metric(unit="m", needs=needs)  # type: ignore[arg-type]
