"""A plugin through all its checks: one row for each."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from escort_mj import stopping
from escort_mj.behaviors.behavior import Behavior
from escort_mj.conformance.behaviors import check_behavior
from escort_mj.conformance.disturbances import check_disturbance
from escort_mj.conformance.estimators import check_estimator
from escort_mj.conformance.kinds import check_kind
from escort_mj.conformance.laws import check_law
from escort_mj.conformance.missions import check_missions
from escort_mj.conformance.outer_loops import check_outer_loop
from escort_mj.conformance.parameters import check_parameters
from escort_mj.conformance.policies import check_policy
from escort_mj.conformance.radios import check_radio
from escort_mj.conformance.records import check_expectation, try_metric
from escort_mj.conformance.repeats import check_calls
from escort_mj.conformance.sensors import check_sensor
from escort_mj.conformance.stand import BrokenError, CheckResult
from escort_mj.control.outer_loops import OuterLoop
from escort_mj.disturbances import Disturbance
from escort_mj.errors import EscortError
from escort_mj.estimators import Estimator
from escort_mj.expectations.expectation import Expectation
from escort_mj.laws.law import Law
from escort_mj.metrics.metric import Metric
from escort_mj.plugin_calls import place_of
from escort_mj.policies import Policy
from escort_mj.radios import Radio
from escort_mj.robots import RobotKind
from escort_mj.scenario.kinds import kind_of
from escort_mj.scenario.reader.catalog import assemble, scenario_type
from escort_mj.scenario.reader.plugins import Plugin, load_plugin, source_of
from escort_mj.sensors import Sensor

Checks = Callable[[Any, type[Any]], Iterator[CheckResult]]
CHECKS: dict[type[Any], tuple[Checks, ...]] = {
    Law: (check_parameters, check_law, check_missions),
    Behavior: (check_parameters, check_behavior, check_missions),
    Policy: (check_parameters, check_policy, check_missions),
    Estimator: (check_parameters, check_estimator, check_missions),
    OuterLoop: (check_parameters, check_outer_loop, check_missions),
    Radio: (check_parameters, check_radio, check_missions),
    Disturbance: (check_parameters, check_disturbance, check_missions),
    Sensor: (check_parameters, check_sensor, check_missions),
    RobotKind: (check_parameters, check_kind, check_missions),
    Metric: (try_metric,),
    Expectation: (check_parameters, check_expectation),
}
"""What members of a kind are asked; called with the member and the type of scenarios that knows it."""
CALLED = check_parameters, check_calls, check_missions
"""What members of the other kinds are asked."""


def checks_of(member: Any) -> tuple[Checks, ...]:
    """Return what a member is asked."""
    return CHECKS.get(Metric if isinstance(member, Metric) else kind_of(member), CALLED)


class Check(NamedTuple):
    """What one check found.

    Attributes:
        member: The class that was checked.
        name: What was asked.
        held: Whether it is so.
        words: What was found.
    """

    member: str
    name: str
    held: bool
    words: str


def check_plugin(written: str) -> Iterator[Check]:
    """Check all that a plugin brings.

    Args:
        written: A Python file, or the name of an installed plugin.

    Yields:
        One row for each check, as it is made; a check that cannot go on ends those of its member.

    Raises:
        PluginError: If the plugin cannot be loaded.
    """
    plugin = load_plugin(source_of(written, Path()))
    kind = scenario_type(assemble([plugin]))
    for member in plugin.members:
        name = member.name if isinstance(member, Metric) else member.__name__
        yield Check(name, "loads", True, _told(plugin, member))
        for checks in checks_of(member):
            try:
                for row in checks(member, kind):
                    yield Check(name, *row)
            except BrokenError as broken:
                yield Check(name, broken.name, False, str(broken))
                break
            except EscortError as error:
                yield Check(name, "runs", False, str(error))
                break
            except BaseException as error:  # of the plugin's own code, called outside a mission
                if isinstance(error, KeyboardInterrupt | GeneratorExit) and stopping.is_users():
                    raise
                own = [each for each in vars(member).values() if hasattr(each, "__code__")]
                yield Check(name, "runs", False, place_of(error, [*own, check_plugin][0]))
                break


def _told(plugin: Plugin, member: Any) -> str:
    """What a scenario calls a member."""
    if isinstance(member, Metric):
        return f"metric: {member.name} [{member.unit}], {member.meaning}"
    if issubclass(member, Expectation):
        return f"expectation: {member.kind}"
    return f"{member.named_by}: {member.own_name()}, {plugin.identity[:19]}"
