"""The kinds of what a mission is made of, told in one list: the base class of each, and what ships of it.

What scenarios, plugins, pages and checks do with a kind, its base class says: see `Member`.
"""

from __future__ import annotations

from typing import Any

from escort_mj.behaviors import BEHAVIORS
from escort_mj.behaviors.behavior import Behavior
from escort_mj.components.equations import Equations
from escort_mj.components.parameters import Member
from escort_mj.control.outer_loops import OUTER_LOOPS, OuterLoop
from escort_mj.disturbances import DISTURBANCES, Disturbance
from escort_mj.estimators import ESTIMATORS, Estimator
from escort_mj.expectations import EXPECTATIONS, Expectation
from escort_mj.failures import FAILURES, Failure
from escort_mj.laws import LAWS
from escort_mj.laws.law import Law
from escort_mj.metrics import METRICS
from escort_mj.metrics.metric import Metric
from escort_mj.policies import POLICIES, Policy
from escort_mj.radios import RADIOS, Radio
from escort_mj.robots import KINDS as ROBOT_KINDS
from escort_mj.robots import RobotKind
from escort_mj.rules import RULES, Rule
from escort_mj.sensors import SENSORS, Sensor

KINDS: dict[type[Any], tuple[Any, ...]] = {
    Law: LAWS,
    Behavior: BEHAVIORS,
    OuterLoop: OUTER_LOOPS,
    Policy: POLICIES,
    Estimator: ESTIMATORS,
    Radio: RADIOS,
    Disturbance: DISTURBANCES,
    Sensor: SENSORS,
    Failure: FAILURES,
    Rule: RULES,
    RobotKind: ROBOT_KINDS,
    Expectation: EXPECTATIONS,
    Metric: METRICS,
}
"""What ships of each kind."""
TABLES: tuple[type[Member], ...] = tuple(base for base in KINDS if issubclass(base, Member))
"""Kinds whose members are tables of parameters."""
EQUATIONS: tuple[type[Equations], ...] = tuple(base for base in TABLES if issubclass(base, Equations))
"""Kinds whose members are equations between values."""
NAME_KEYS = tuple(dict.fromkeys(base.named_by for base in TABLES if base.named_by))
"""Keys with the name of which of several tables one is."""


def kind_of(member: type[Any]) -> type[Any]:
    """Return the base class of a member's kind."""
    return next(base for base in KINDS if issubclass(member, base))


def name_of(member: Any) -> str:
    """Return the name by which a scenario asks for a member of a kind."""
    return member.name if isinstance(member, Metric) else str(member.own_name())
