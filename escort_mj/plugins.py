"""What plugins are made of (docs/plugins.md): base classes, and what their methods see and return."""

from typing import Any

from escort_mj.behaviors.behavior import Avoidance, Behavior, Plane
from escort_mj.behaviors.robots import Robots
from escort_mj.behaviors.task import Inequality, Task, across, at_least, both, keep, keep_distance, move, only
from escort_mj.components.equations import Memory
from escort_mj.components.facts import Facts, Misfit
from escort_mj.components.parameters import Speed, Vector
from escort_mj.disturbances import Disturbance
from escort_mj.disturbances.disturbance import Robots as TrueRobots
from escort_mj.disturbances.wind import Wind, drag, toward
from escort_mj.estimators import Belief, Estimator, Witness
from escort_mj.expectations.expectation import Judgment
from escort_mj.expectations.expectation import Windowed as Expectation
from escort_mj.failures import Failure
from escort_mj.laws.law import Law
from escort_mj.metrics.measure import Measure
from escort_mj.metrics.metric import metric
from escort_mj.native.values import Values
from escort_mj.native.vectors import Vec, dot, norm, of_numbers, quarter_turn, unit_axis, where
from escort_mj.policies import Body, Policy
from escort_mj.radios import Radio
from escort_mj.robots import RobotKind
from escort_mj.rules import Rule
from escort_mj.sensors import Sensor

_GONE = dict.fromkeys(("BEARING", "POSITION", "RANGE", "VELOCITY"), "r.bearing_variance and the like")
_GONE |= {"PolicyView": "Body", "EstimatorView": "Witness"} | dict.fromkeys(
    ("ACTS", "RESTS"), "acts(self, r)"
)
"""What old plugins import, and what stands in its place."""

__all__ = [
    "Belief",
    "Body",
    "Avoidance",
    "Behavior",
    "Disturbance",
    "Estimator",
    "Expectation",
    "Facts",
    "Failure",
    "Judgment",
    "Law",
    "Memory",
    "Measure",
    "Misfit",
    "Plane",
    "Policy",
    "Radio",
    "RobotKind",
    "Inequality",
    "Robots",
    "Rule",
    "Task",
    "TrueRobots",
    "across",
    "at_least",
    "both",
    "keep",
    "keep_distance",
    "move",
    "only",
    "Sensor",
    "Speed",
    "Values",
    "Vec",
    "Vector",
    "Wind",
    "Witness",
    "dot",
    "drag",
    "metric",
    "norm",
    "of_numbers",
    "quarter_turn",
    "toward",
    "unit_axis",
    "where",
]


def __getattr__(name: str) -> Any:
    words = f"{name} is gone; {_GONE[name]} does it (docs/plugins.md)" if name in _GONE else ""
    raise ImportError(words) if words else AttributeError(f"{__name__} has no attribute {name!r}")
