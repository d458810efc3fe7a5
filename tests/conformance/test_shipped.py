"""What ships is held to what is asked of a plugin."""

import pytest

from escort_mj.conformance import records
from escort_mj.metrics import METRICS
from escort_mj.metrics.metric import Metric
from escort_mj.scenario.reader.plugin_shape import check_metric
from escort_mj.scenario.schema.scenario import Scenario


@pytest.mark.parametrize("metric", METRICS, ids=lambda metric: metric.name)
def test_every_metric_is_what_a_plugins_has_to_be(compiled: None, metric: Metric) -> None:
    check_metric(metric, "it")
    assert not [row for row in records.check_metric(metric, Scenario) if not row.held]
