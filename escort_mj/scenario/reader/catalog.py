"""All that a scenario may name: what comes with the package, and what plugins bring.

A set of plugins makes a type of scenario of its own, derived from `Scenario`: the same tables, in which more
laws and behaviors may stand. Everything else follows from the type: checks, messages, schema, handbook.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache, reduce
from operator import or_
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, ClassVar, Union, get_args, get_origin

from pydantic import BaseModel, Field, create_model

from escort_mj.components.equations import kind_word
from escort_mj.components.parameters import Members, one_of
from escort_mj.errors import PluginError
from escort_mj.metrics.metric import Metric, by_rank
from escort_mj.scenario.findings import Finding
from escort_mj.scenario.kinds import KINDS, TABLES, name_of
from escort_mj.scenario.reader.plugins import Plugin, load_all, load_plugin, source_of
from escort_mj.scenario.schema.plugin_source import PluginSource
from escort_mj.scenario.schema.scenario import Scenario


@dataclass(frozen=True)
class Catalog:
    """What scenarios of a type may name.

    Attributes:
        plugins: What is loaded beside what comes with the package.
        members: Of each kind, in the order of `KINDS`.
    """

    plugins: tuple[Plugin, ...] = ()
    members: tuple[tuple[Any, ...], ...] = tuple(KINDS.values())

    def of(self, base: type[Any]) -> tuple[Any, ...]:
        """Return the members of a kind."""
        return self.members[[*KINDS].index(base)]


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
    members = []
    for base, own in KINDS.items():
        found, owners = [*own], {name_of(member): "escort_mj itself" for member in own}
        for plugin in plugins:
            for member in plugin.of(base):
                if (name := name_of(member)) in owners:
                    raise PluginError(
                        f"{plugin.name}: the {kind_word(base)} {name} is there already, in {owners[name]}; "
                        "choose another name"
                    )
                owners[name] = plugin.name
                found.append(member)
        members.append(by_rank(found) if base is Metric else tuple(found))
    return Catalog(tuple(plugins), tuple(members))


@lru_cache(maxsize=64)
def scenario_type(catalog: Catalog) -> type[Scenario]:
    """The type of scenarios that may name what a catalog has."""
    if not catalog.plugins:
        return Scenario
    made: Any = _extended_table(Extended, catalog)
    made.__name__ = made.__qualname__ = Scenario.__name__
    made.catalog = catalog
    return made


def _extended(kind: Any, catalog: Catalog) -> Any:
    """The type of a value, in which the members that a catalog has may stand; the same if it has no more."""
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        return _extended_table(kind, catalog)
    parts, origin = get_args(kind), get_origin(kind)
    mark = next((each for each in parts if isinstance(each, Members)), None)
    if mark is not None:
        members = catalog.of(mark.base)
        if mark.base in TABLES:
            members = tuple(_extended_table(member, catalog) for member in members)
        return kind if members == mark.known else one_of(mark.base, mark.make, members)
    made = tuple(_extended(part, catalog) for part in parts)
    if made == parts:
        return kind
    return reduce(or_, made) if origin in (Union, UnionType) else origin[made]


def _extended_table(table: type[Any], catalog: Catalog) -> type[Any]:
    """A table whose keys have other types; what they mean and their defaults stay."""
    fields: dict[str, Any] = {}
    for name, field in table.model_fields.items():
        kind = Annotated[(field.annotation, *field.metadata)] if field.metadata else field.annotation
        if (extended := _extended(kind, catalog)) is kind:
            continue
        told: dict[str, Any] = {"description": field.description} if field.description else {}
        if not field.is_required():
            default = field.default
            is_table = isinstance(default, BaseModel) and isinstance(extended, type)
            told["default"] = extended() if is_table else default
        fields[name] = (extended, Field(**told))
    if not fields:
        return table
    made: type[Any] = create_model(table.__name__, __base__=table, __module__=table.__module__, **fields)
    made.__doc__ = table.__doc__
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
