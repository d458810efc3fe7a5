"""What ships is held to what is asked of a plugin."""

import json
from collections.abc import Iterable
from typing import Any, NamedTuple

import pytest

from escort_mj.behaviors import BEHAVIORS, Chords, Formation, Goal, Intercept, Repulsion
from escort_mj.behaviors.behavior import Behavior
from escort_mj.behaviors.connect import Connect
from escort_mj.behaviors.guard import Guard
from escort_mj.behaviors.orbit import Orbit
from escort_mj.conformance import behaviors, records, repeats, stand
from escort_mj.conformance.behaviors import check_behavior
from escort_mj.conformance.checking import Checks, checks_of
from escort_mj.conformance.missions import check_missions
from escort_mj.conformance.parameters import check_parameters
from escort_mj.conformance.repeats import check_calls
from escort_mj.conformance.stand import CheckResult
from escort_mj.control.outer_loops import OUTER_LOOPS
from escort_mj.disturbances import DISTURBANCES, Disturbance, Expressions
from escort_mj.estimators import ESTIMATORS, Estimator, Predict
from escort_mj.expectations import EXPECTATIONS
from escort_mj.failures import FAILURES, Failure
from escort_mj.laws import LAWS, Law
from escort_mj.memory.layout import LAYOUT, Plan, State
from escort_mj.metrics import METRICS
from escort_mj.metrics.metric import Metric
from escort_mj.native.fields import declared
from escort_mj.policies import POLICIES, Policy
from escort_mj.policies.straight import Straight
from escort_mj.radios import RADIOS, Periodic, Radio
from escort_mj.radios.time_slots import TimeSlots
from escort_mj.robots import KINDS
from escort_mj.robots.modeled import ModeledKind
from escort_mj.robots.surface_vessel import SurfaceVessel
from escort_mj.rules import RULES, Rule
from escort_mj.scenario.reader.load import parse_scenario
from escort_mj.scenario.reader.plugin_shape import check_metric
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.sensors import SENSORS, Sensor


@pytest.mark.parametrize("metric", METRICS, ids=lambda metric: metric.name)
def test_every_metric_is_what_a_plugins_has_to_be(compiled: None, metric: Metric) -> None:
    check_metric(metric, "it")
    assert not [row for row in records.try_metric(metric, Scenario) if not row.held]


SHIPPED: tuple[type[Any], ...] = (
    *(*LAWS, *OUTER_LOOPS, *DISTURBANCES, *SENSORS, *RADIOS, *POLICIES, *ESTIMATORS),
    *(*FAILURES, *RULES, *KINDS),
)
NO_EQUATIONS = (Expressions, *(each for each in SENSORS if not each.equated()))  # the loop has these itself
NEED_FILES = tuple(
    kind for kind in KINDS if issubclass(kind, ModeledKind)
)  # tests/robots and tests/world/model hold what comes of these
CHECKED = [each for each in SHIPPED if each not in (*NO_EQUATIONS, *NEED_FILES)]
LONG = (Periodic, TimeSlots, *POLICIES, *ESTIMATORS, SurfaceVessel)  # a second or more each
SHORT = [each for each in CHECKED if each not in LONG or each in (Predict, Straight)]
CALLED = Law | Disturbance | Sensor | Radio | Failure | Rule | Policy | Estimator
EQUATED = [each for each in CHECKED if issubclass(each, CALLED)]


def faults(member: type[Any], checks: Iterable[Checks]) -> list[CheckResult]:
    """What a component that ships does not hold of what a plugin's has to."""
    return [row for check in checks for row in check(member, Scenario) if not row.held]


def name_of(member: type[Any]) -> str:
    return member.__name__


@pytest.mark.parametrize("member", SHORT, ids=name_of)
def test_what_ships_is_what_a_plugins_has_to_be(compiled: None, hurried: None, member: type[Any]) -> None:
    assert not faults(member, (check for check in checks_of(member) if check is not check_missions))


EVERYTHING = NamedTuple("Everything", [(name, Any) for name in declared(Plan) | declared(State)])  # type: ignore[misc]
GIVEN: dict[type[Behavior], dict[str, Any]] = {
    Connect: {"distance": 3.0},
    Goal: {"goals": "opposite"},
    Guard: {"gain": 50.0},  # much, beside what moves with the target
    Intercept: {"speed": 1.0, "quarry": "opponents"},  # by default that of the mission, which has no limit
}
"""Keys that a behavior has to be given, or is tried with."""


@pytest.fixture(scope="module")
def everything() -> type[Any]:
    """A view of all fields, in place of the one that plugins' behaviors are handed."""
    LAYOUT.part(EVERYTHING)
    return EVERYTHING


@pytest.mark.slow_cases(
    "Attract", "Avoid", "Chords", "Goal", "Guard", "Intercept", "Orbit", "Repulsion", "Spacing"
)
@pytest.mark.parametrize("draws", [6, pytest.param(20, marks=pytest.mark.slow)])
@pytest.mark.parametrize("behavior", [each for each in BEHAVIORS if each is not Formation], ids=name_of)
def test_behaviors_that_ship_are_what_a_plugins_has_to_be(
    compiled: None, behavior: Any, draws: int, everything: type[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in (behaviors, repeats):
        monkeypatch.setattr(module, "DRAWS", draws)
    own = GIVEN.get(behavior, {})
    kinds = {name: behavior.model_fields[name].annotation for name in own}
    text = {"__module__": behavior.__module__, "__annotations__": kinds, "view": everything}
    member = type(behavior.__name__, (behavior,), {**text, **own})
    if behavior is Chords:  # it has no arrangement of other teams
        monkeypatch.setattr(stand, "SIZES", ((5, 2), (3, 2)))
    found = faults(member, (check_parameters, check_behavior))
    alone = behavior not in (Orbit, Repulsion)  # their errors may rise while the figure and the others stand
    assert not [row for row in found if alone or row.name != "works"]


@pytest.mark.slow
@pytest.mark.parametrize("member", CHECKED, ids=name_of)
def test_what_ships_is_so_in_missions_too(member: type[Any]) -> None:
    assert not faults(member, checks_of(member))


@pytest.mark.slow
@pytest.mark.parametrize("member", EQUATED, ids=name_of)
def test_compiled_as_a_plugin_is_it_agrees_with_itself(member: type[Any]) -> None:
    made = type(member.__name__, (member,), {"compiled": True, "__module__": member.__module__})
    rows = list(check_calls(made, Scenario))
    assert "forms agree" in {row.name for row in rows} and not [row for row in rows if not row.held]


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
