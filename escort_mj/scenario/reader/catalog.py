"""All that a scenario may name: what comes with the package, and what plugins bring.

A set of plugins makes a type of scenario of its own, derived from `Scenario`: the same tables, in which more
laws and behaviors may stand. Everything else follows from the type: checks, messages, schema, handbook.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BaseModel, Field, create_model

from escort_mj.behaviors import BEHAVIORS
from escort_mj.behaviors.behavior import Behavior
from escort_mj.behaviors.task import MAX_LEVELS
from escort_mj.control.outer_loops import OUTER_LOOPS
from escort_mj.disturbances import DISTURBANCES, Disturbance
from escort_mj.errors import PluginError
from escort_mj.estimators import ESTIMATORS, Estimator
from escort_mj.expectations import EXPECTATIONS
from escort_mj.expectations.expectation import Expectation
from escort_mj.expectations.metric import MetricExpectation
from escort_mj.failures import FAILURES, Failure
from escort_mj.laws import LAWS
from escort_mj.laws.law import Law
from escort_mj.metrics import METRICS
from escort_mj.metrics.metric import Metric
from escort_mj.policies import POLICIES, Policy
from escort_mj.radios import RADIOS, Radio
from escort_mj.robots import KINDS, RobotKind
from escort_mj.rules import RULES, Rule
from escort_mj.scenario.findings import Finding
from escort_mj.scenario.reader.plugins import Plugin, load_all, load_plugin, source_of
from escort_mj.scenario.schema.expectations import expectation_of
from escort_mj.scenario.schema.fields import one_of_kinds
from escort_mj.scenario.schema.knowledge import Knowledge
from escort_mj.scenario.schema.opponents import Opponents
from escort_mj.scenario.schema.plugin_source import PluginSource
from escort_mj.scenario.schema.robots import RobotOverride, Robots
from escort_mj.scenario.schema.scenario import (
    MOST_DISTURBANCES,
    Mission,
    Phase,
    Scenario,
    Target,
    Uncertainty,
)
from escort_mj.scenario.schema.sensing import Sensing, sensor_of
from escort_mj.scenario.schema.teams import MOST_TARGETS, MOST_TEAMS, Team, TeamTarget
from escort_mj.sensors import QUANTITIES, SENSORS, Sensor

Members = tuple[type[Any], ...]


@dataclass(frozen=True)
class Catalog:
    """What scenarios of a type may name.

    Attributes:
        plugins: What is loaded beside what comes with the package.
        laws: Of the inner loop.
        behaviors: Of the outer loop.
        policies: Of targets and opponents.
        estimators: Of what robots know.
        radios: Of messages between them.
        disturbances: Of robots.
        sensors: Of what robots measure.
        failures: Of motors.
        rules: Of the supervisor.
        kinds: Of robots.
        demands: Kinds of expectations.
        metrics: What sums up a run.
        outer_loops: What composes behaviors; plugins bring none.
    """

    plugins: tuple[Plugin, ...] = ()
    laws: Members = LAWS
    behaviors: Members = BEHAVIORS
    policies: Members = POLICIES
    estimators: Members = ESTIMATORS
    radios: Members = RADIOS
    disturbances: Members = DISTURBANCES
    sensors: Members = SENSORS
    failures: Members = FAILURES
    rules: Members = RULES
    kinds: Members = KINDS
    demands: Members = EXPECTATIONS
    metrics: tuple[Metric, ...] = METRICS
    outer_loops: Members = OUTER_LOOPS


BUILT_IN = Catalog()


class Extended(Scenario):
    """A scenario that may name what plugins bring."""

    catalog: ClassVar[Catalog]

    def __reduce__(self) -> Any:
        """Pickled as data: another process loads the plugins and makes the type again."""
        return revived, (self.model_dump(),)


def catalog_of(scenario: Any) -> Catalog:
    """What a scenario, or a type of scenarios, may name."""
    found: Catalog = getattr(scenario, "catalog", BUILT_IN)
    return found


def assemble(plugins: Sequence[Plugin]) -> Catalog:
    """What the package and plugins have together.

    Raises:
        PluginError: If two have the same name.
    """

    def merged(
        what: str, base: type[Any], own: Sequence[Any], name_of: Callable[[Any], str]
    ) -> tuple[Any, ...]:
        owners = {name_of(member): "escort_mj itself" for member in own}
        members = [*own]
        for plugin in plugins:
            for member in plugin.of(base):
                if (name := name_of(member)) in owners:
                    raise PluginError(
                        f"{plugin.name}: the {what} {name} is there already, in {owners[name]}; "
                        "choose another name"
                    )
                owners[name] = plugin.name
                members.append(member)
        return tuple(members)

    return Catalog(
        tuple(plugins),
        merged("law", Law, LAWS, _default_of("law")),
        merged("behavior", Behavior, BEHAVIORS, _default_of("behavior")),
        merged("policy", Policy, POLICIES, _default_of("policy")),
        merged("estimator", Estimator, ESTIMATORS, _default_of("estimator")),
        merged("radio", Radio, RADIOS, _default_of("radio")),
        merged("disturbance", Disturbance, DISTURBANCES, _default_of("disturbance")),
        merged("sensor", Sensor, SENSORS, _default_of("sensor")),
        merged("failure", Failure, FAILURES, _default_of("kind")),
        merged("rule", Rule, RULES, _default_of("quantity")),
        merged("kind", RobotKind, KINDS, _default_of("kind")),
        merged("expectation", Expectation, EXPECTATIONS, lambda model: str(model.kind)),
        merged("metric", Metric, METRICS, lambda metric: str(metric.name)),
    )


def _default_of(key: str) -> Callable[[Any], str]:
    """A function that gives a table's name, which a key of it has as its default."""
    return lambda model: str(model.model_fields[key].default)


@lru_cache(maxsize=64)
def scenario_type(catalog: Catalog) -> type[Scenario]:
    """The type of scenarios that may name what a catalog has."""
    if not catalog.plugins:
        return Scenario
    behaviors: Any = Annotated[
        tuple[one_of_kinds(catalog.behaviors, "behavior"), ...],  # type: ignore[misc]
        Field(min_length=1, max_length=MAX_LEVELS),
    ]
    phase = _with(Phase, behaviors=behaviors, when=one_of_kinds(catalog.rules, "quantity") | None)
    phases = Annotated[tuple[phase, ...], Field(max_length=32)]  # type: ignore[valid-type]
    mission = _with(Mission, behaviors=behaviors, supervisor=phases)
    policy = one_of_kinds(catalog.policies, "policy")
    target, quarry = _with(Target, policy=policy | None), _with(TeamTarget, policy=policy | None)
    opponents = _with(Opponents, policy=policy)
    quarries = Annotated[tuple[quarry, ...], Field(min_length=1, max_length=MOST_TARGETS)]  # type: ignore[valid-type]
    law = one_of_kinds(catalog.laws, "law", "apd_smc")
    team = _with(Team, targets=quarries, controller=law | None)
    knowledge = _with(Knowledge, estimator=one_of_kinds(catalog.estimators, "estimator", "predict"))
    radio = one_of_kinds(catalog.radios, "radio", "periodic")
    forces: Any = tuple[one_of_kinds(catalog.disturbances, "disturbance"), ...]  # type: ignore[misc]
    uncertainty = _with(Uncertainty, disturbances=Annotated[forces, Field(max_length=MOST_DISTURBANCES)])
    sensing = _with(Sensing, **{quantity: sensor_of(quantity, catalog.sensors) for quantity in QUANTITIES})
    robot: Any = one_of_kinds(catalog.kinds, "kind")
    override = _with(RobotOverride, kind=robot | None)
    failure: Any = one_of_kinds(catalog.failures, "kind", "dead")
    robots = _with(
        Robots,
        kind=robot,
        overrides=tuple[override, ...],  # type: ignore[valid-type]
        failures=tuple[failure, ...],
    )
    metric = _with(MetricExpectation, metric=Literal[tuple(each.name for each in catalog.metrics)])
    metric.definitions = {each.name: each for each in catalog.metrics}
    demands = [metric if each is MetricExpectation else each for each in catalog.demands]
    expect: Any = tuple[expectation_of(demands), ...]  # type: ignore[misc]
    made = _with(
        Extended,
        expect=expect,
        robots=robots,
        target=target | None,
        opponents=Annotated[tuple[opponents, ...], Field(max_length=20)],  # type: ignore[valid-type]
        teams=Annotated[tuple[team, ...], Field(max_length=MOST_TEAMS)],  # type: ignore[valid-type]
        knowledge=knowledge | None,
        communication=radio | None,
        uncertainty=uncertainty,
        sensing=sensing,
        controller=law,
        mission=mission,
    )
    made.__name__ = made.__qualname__ = Scenario.__name__
    made.catalog = catalog
    return made


def _with(base: type[Any], **types: Any) -> type[Any]:
    """A table whose keys have other types; what they mean and their defaults stay."""
    fields: dict[str, Any] = {}
    for name, kind in types.items():
        field = base.model_fields[name]
        told: dict[str, Any] = {}
        if not field.is_required():
            default = field.default
            is_table = isinstance(default, BaseModel) and isinstance(kind, type)
            told["default"] = kind() if is_table else default
        fields[name] = (kind, Field(**told))
    made: type[Any] = create_model(base.__name__, __base__=base, __module__=base.__module__, **fields)
    made.__doc__ = base.__doc__
    return made


def resolve_plugins(data: dict[str, Any], folder: Path) -> tuple[type[Scenario], list[Finding]]:
    """The type of scenario that plain data names plugins for; the data's `plugins` are resolved in place.

    Args:
        data: As it was read.
        folder: Where paths of plugin files begin.

    Returns:
        The type, and what is wrong with the plugins; then it is the type without them.
    """
    written = data.get("plugins")
    if not isinstance(written, list) or not written:
        return Scenario, []
    plugins, findings = [], []
    for place, each in enumerate(load_all(written, folder)):
        if isinstance(each, PluginError):
            findings.append(Finding(("plugins", place), str(each)))
        else:
            plugins.append(each)
    if findings:
        return Scenario, findings
    plugins = list({(each.name, each.source.sha256): each for each in plugins}.values())
    names = [plugin.name for plugin in plugins]
    if twice := next((name for name in names if names.count(name) > 1), None):
        return Scenario, [Finding(("plugins",), f"found two plugins called {twice}; rename one of them")]
    data["plugins"] = [plugin.source.model_dump() for plugin in plugins]
    try:
        return scenario_type(assemble(plugins)), []
    except PluginError as error:
        return Scenario, [Finding(("plugins",), str(error))]


def scenario_type_with(plugins: Sequence[str]) -> type[Scenario]:
    """The type of scenarios that may name what plugins bring: Python files, or names of installed ones.

    Raises:
        PluginError: If one cannot be loaded, or two have the same name.
    """
    return scenario_type(assemble([load_plugin(source_of(each, Path())) for each in plugins]))


def revived(data: dict[str, Any]) -> Scenario:
    """The scenario that was pickled as data.

    Raises:
        PluginError: If a plugin is not there any more, or has changed.
    """
    plugins = [load_plugin(PluginSource(**each)) for each in data["plugins"]]
    return scenario_type(assemble(plugins)).model_validate(data, strict=True)
