"""Pydantic's errors in this program's own words, with key paths as they stand in the file."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from escort_mj.expectations import Expectation
from escort_mj.laws.gains import LAWS_WITH_A_RULE
from escort_mj.scenario.findings import Finding, Path, did_you_mean, instead, listed, shown
from escort_mj.scenario.kinds import TABLES
from escort_mj.scenario.reader.catalog import catalog_of
from escort_mj.scenario.reader.files.paths import Location, locate, member_name
from escort_mj.scenario.schema.fields import PATTERNS
from escort_mj.scenario.schema.robots import RobotOverride
from escort_mj.scenario.schema.scenario import Scenario

OF_ONE_ROBOT = {(key,) for key in RobotOverride.model_fields}
VERSION = ("version",)
MOST_EXPLAINED = 100  # faults of a table; of the others it is said how many there are


def findings_of(
    error: ValidationError, data: Any, root: type[BaseModel] = Scenario, known: bool = True
) -> list[Finding]:
    """What pydantic found wrong with plain data that was to become a scenario, or another kind of table.

    Args:
        error: What pydantic raised.
        data: The plain data.
        root: The type that it was to have.
        known: Whether all components are known; else none is called unknown.
    """
    every = [details for details in error.errors(include_url=False) if not _is_echo(details)]
    if version := [details for details in every if details["loc"] == VERSION]:
        every = version  # another version has other keys: nothing else can be said
    elif not known:
        every = [details for details in every if not _is_of_plugins(details)]
    found = [_finding(details, data, root) for details in every[:MOST_EXPLAINED]]
    rest = Counter(details["loc"][:1] for details in every[MOST_EXPLAINED:])
    return found + [
        Finding(key, f"holds {count} more faults", at_key=True) for key, count in rest.items() if key
    ]


def _is_echo(details: ErrorDetails) -> bool:
    """Whether a list is called too short only because its items are wrong, which is reported by itself."""
    return details["type"] == "too_short" and len(details["input"]) >= details["ctx"]["min_length"]


def _finding(details: ErrorDetails, data: Any, root: type[BaseModel]) -> Finding:
    location = locate(details["loc"], root)
    path = location.path[:-1] if location.path[-1:] == ("[key]",) else location.path
    kind, found, context = details["type"], details["input"], details.get("ctx", {})
    if kind == "extra_forbidden":
        return _unknown_key(location)
    if kind == "missing":
        return Finding(path, f"is missing{_meaning(location)}")
    if kind == "kind":
        return Finding(path, _no_kind(found, [each.kind for each in catalog_of(root).of(Expectation)]))
    if kind.startswith("union_tag"):
        return _wrong_tag(path, context, data)
    if kind == "literal_error":
        return Finding(path, _wrong_choice(path, found, context["expected"]))
    if isinstance(found, list | tuple) and (bound := context.get("ge", context.get("le"))) is not None:
        place = next(k for k, x in enumerate(found) if isinstance(x, float) and abs(x) > abs(bound))
        path, found = (*path, place), found[place]
    message = _wrong_value(kind, found, context, details["msg"])
    if path[:1] == ("robots",) and path[1:] in OF_ONE_ROBOT and isinstance(found, list | tuple):
        message += "; overrides give single robots values of their own"
    if found is None and location.field and not location.field.is_required():
        message += "; leave the key out for its default"
    return Finding(path, message)


def _is_of_plugins(details: ErrorDetails) -> bool:
    """Whether a component, an expectation or a metric is called unknown, which a plugin may bring."""
    is_metric = details["type"] == "literal_error" and details["loc"][-1] == "metric"
    return is_metric or details["type"] in ("union_tag_invalid", "kind")


def _value_at(data: Any, path: Path) -> Any:
    for key in path:
        try:
            data = data[key]
        except (KeyError, IndexError, TypeError):
            return None
    return data


def _unknown_key(location: Location) -> Finding:
    names, owner = [], ""
    if location.holder:
        names = list(location.holder.model_fields)
        name = member_name(location.holder)
        owner = f" of {name}" if name else ""
        if name in LAWS_WITH_A_RULE:
            names.append("gains")  # read before pydantic reads the others
    message = f"is not a key{owner}; allowed are {listed(names)}" + did_you_mean(
        str(location.path[-1]), names
    )
    return Finding(location.path, message, at_key=True)


def _meaning(location: Location) -> str:
    text = location.meaning
    return f": {text[0].lower()}{text[1:].rstrip('.')}" if text else ""


def _wrong_tag(path: Path, context: dict[str, Any], data: Any) -> Finding:
    """A behavior or law that does not exist, or a table that does not say which one it is."""
    tag = str(context["discriminator"]).strip("'")
    held = _value_at(data, path)
    if "tag" not in context:
        return Finding((*path, tag), f"is missing: which {tag} this is{instead(tag, held or ())}")
    names = [name.strip(" '") for name in context["expected_tags"].split(",")]
    where = (*path, tag) if isinstance(held, dict) else path
    found = str(context["tag"])
    hint = did_you_mean(found, names)
    if not did_you_mean(found, names, 0.6) and any(
        kind.named_by == tag and kind.of_plugins for kind in TABLES
    ):
        hint += "; plugins bring others (plugins: [FILE.py], or --plugin FILE.py)"
    return Finding(where, f"found {shown(found)}; allowed are {listed(names)}{hint}")


def _no_kind(found: Any, names: list[str]) -> str:
    """What to say of an expectation that names nothing to be expected."""
    if not isinstance(found, dict):
        return f"found {shown(found)}; expected a table with one of {listed(names)}"
    close = filter(None, (did_you_mean(key, names) for key in found))
    return f"does not say what is expected; give one of {listed(names)}{next(close, '')}"


def _wrong_choice(path: Path, found: Any, expected: str) -> str:
    names = [name.strip(" '") for name in expected.replace(" or ", ", ").split(",")]
    names = [{"True": "true", "False": "false"}.get(name, name) for name in names]  # as YAML writes them
    if path == VERSION:
        return f"found {shown(found)}; this program reads version {names[0]}"
    message = f"found {shown(found)}; allowed are {listed(names)}"
    if path == ("physics", "integrator") and str(found).upper() == "RK4":
        return message + "; RK4 would evaluate the adaptive law four times a step"
    return message + did_you_mean(str(found), names)


_WANTED: dict[str, Callable[[dict[str, Any]], str]] = {
    "finite_number": lambda _: "a finite number",
    "float_type": lambda _: "a number",
    "component_type": lambda _: "a number or an expression in t",
    "bias_type": lambda _: "a radius from 0 to 1e6, or a list with one number per axis",
    "int_type": lambda _: "a whole number",
    "int_from_float": lambda _: "a whole number",
    "bool_type": lambda _: "true or false",
    "string_type": lambda _: "text",
    "string_unicode": lambda _: "text that can be written as UTF-8",
    "choice": lambda c: str(c["wanted"]),
    "tuple_type": lambda _: "a list",
    "model_type": lambda _: "a table of keys",
    "model_attributes_type": lambda _: "a name or a table of keys",
    "greater_than": lambda c: f"more than {_bound(c['gt'])}",
    "greater_than_equal": lambda c: f"at least {_bound(c['ge'])}",
    "less_than": lambda c: f"less than {_bound(c['lt'])}",
    "less_than_equal": lambda c: f"at most {_bound(c['le'])}",
    "multiple_of": lambda c: f"a multiple of {c['multiple_of']}",
    "too_short": lambda c: f"at least {c['min_length']} items",
    "too_long": lambda c: f"at most {c['max_length']} items",
    "string_too_short": lambda c: "some text",
    "string_too_long": lambda c: f"at most {c['max_length']} characters",
    "string_pattern_mismatch": lambda c: PATTERNS.get(c["pattern"], f"text such as {c['pattern']}"),
}


def _bound(number: float) -> str:
    return f"{number:g}" if float(f"{number:g}") == number else str(number)


def _wrong_value(kind: str, found: Any, context: dict[str, Any], message: str) -> str:
    if kind == "expression":
        return str(context["reason"])
    if kind == "int_parsing_size":
        kind = "int_type"
    wanted = _WANTED[kind](context) if kind in _WANTED else message[:1].lower() + message[1:]
    return f"found {shown(found)}; expected {wanted}"
