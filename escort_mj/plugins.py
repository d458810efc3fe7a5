"""What plugins are made of (docs/plugins.md): base classes, and what their methods see and return."""

from escort_mj.control.behaviors.behavior import Behavior
from escort_mj.control.laws.law import Law
from escort_mj.control.own.views import ACROSS, ALONG, NOTHING, BehaviorView, LawView
from escort_mj.record.measures import Measure
from escort_mj.scenario.expectations import Judgment
from escort_mj.scenario.expectations import OwnExpectation as Expectation
from escort_mj.scenario.kinds import RobotKind
from escort_mj.scenario.own_metrics import metric

__all__ = [
    "ACROSS",
    "ALONG",
    "NOTHING",
    "Behavior",
    "BehaviorView",
    "Expectation",
    "Judgment",
    "Law",
    "LawView",
    "Measure",
    "RobotKind",
    "metric",
]
