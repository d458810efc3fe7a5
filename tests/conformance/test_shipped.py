"""What ships is held to what is asked of a plugin."""

import json
from typing import Any

import pytest

from escort_mj.conformance import records
from escort_mj.conformance.estimators import check_estimator
from escort_mj.estimators import CovarianceIntersection, Estimator, Predict
from escort_mj.expectations import EXPECTATIONS
from escort_mj.metrics import METRICS
from escort_mj.metrics.metric import Metric
from escort_mj.scenario.reader.load import parse_scenario
from escort_mj.scenario.reader.plugin_shape import check_metric
from escort_mj.scenario.schema.scenario import Scenario


@pytest.mark.parametrize("metric", METRICS, ids=lambda metric: metric.name)
def test_every_metric_is_what_a_plugins_has_to_be(compiled: None, metric: Metric) -> None:
    check_metric(metric, "it")
    assert not [row for row in records.try_metric(metric, Scenario) if not row.held]


@pytest.mark.parametrize("kind", [CovarianceIntersection, Predict], ids=lambda kind: kind.__name__)
def test_every_estimator_is_what_a_plugins_has_to_be(compiled: None, kind: type[Estimator]) -> None:
    assert not [row for row in check_estimator(kind, Scenario) if not row.held]


EXAMPLES: tuple[dict[str, Any], ...] = (
    {"metric": "radius_error_max", "at_most": 2.0, "at_least": 0.0},
    {"metric": "robot_clearance_min", "at_least": 0.1},
    {"contacts": "none"},
    {"contacts": "any", "at_least": 1},
    {"contacts": ["robots", "robots"], "peak_force": 1.0, "impulse": 1.0, "penetration": 0.1},
    {"clearance": ["robots", "robots"], "at_least": 0.5},
    {"settled": 0.5, "by": 1.0},
    {"reached": 0.5, "by": 1.0},
    {"sanity": "all"},
    {"outcome": "completed"},
    {"outcome": "diverged"},
)


@pytest.mark.parametrize("example", EXAMPLES, ids=str)
def test_every_expectation_is_what_a_plugins_has_to_be(compiled: None, example: dict[str, Any]) -> None:
    mission = {"behaviors": [{"behavior": "goal", "goals": "opposite"}]} if "reached" in example else {}
    (demand,) = parse_scenario(json.dumps({"name": "it", "expect": [example], "mission": mission})).expect
    assert not [row for row in records.check_judgments(demand) if not row.held]
    assert demand.demanded and demand.subject


def test_there_is_an_example_of_each() -> None:
    assert {next(iter(example)) for example in EXAMPLES} == {kind.kind for kind in EXPECTATIONS}
