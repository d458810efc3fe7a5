"""What a plugin's components must look like, before anything runs: each fault in one sentence."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Hashable
from inspect import isfunction
from typing import Any, Literal, get_args, get_origin

from pydantic import ValidationError

from escort_mj.behaviors.behavior import Behavior
from escort_mj.components.component import Compiled, Component
from escort_mj.components.equations import Equations, Memory, kind_word
from escort_mj.components.memory import RATE
from escort_mj.components.parameters import Member, Parameters
from escort_mj.errors import PluginError
from escort_mj.estimators import Estimator
from escort_mj.expectations.expectation import Expectation
from escort_mj.metrics.metric import Metric
from escort_mj.plugin_calls import is_plugins
from escort_mj.policies import Policy
from escort_mj.robots import RobotKind
from escort_mj.scenario.findings import did_you_mean, instead, listed
from escort_mj.scenario.kinds import kind_of
from escort_mj.signals import SIGNALS

NAME = re.compile(r"[a-z][a-z0-9_]{0,39}\Z")
GENERAL = (Component, Equations, Member, Parameters)
"""Bases of components of all kinds."""
OLD: dict[type[Equations], tuple[str, str]] = {
    Behavior: ("wish", "which returns keep(...), across(...), move(...) or at_least(...)"),
    Policy: ("velocity", "which returns a vector; acts(self, r) says whether it acts"),
    Estimator: ("update", "and hears(self, r), which return beliefs"),
}
"""Names of methods as they once were, and what is written in their place."""


def check_shape(model: type[Any], source: str) -> None:
    """Check a class of a plugin.

    Args:
        model: Derives from one of the base classes.
        source: The plugin, for messages.

    Raises:
        PluginError: If it lacks something, or something is not as it must be.
    """
    place = f"{source}: {model.__name__}"
    fields = getattr(model, "model_fields", {})
    if hidden := [key for key, field in fields.items() if hasattr(type(field.default), "__get__")]:
        raise PluginError(f"{place}: {hidden[0]} is a key that it inherits; choose another name")
    _check_settings(model, place)
    written = getattr(model, "__pydantic_decorators__", None)
    for own in (
        (written.field_serializers, written.model_serializers, written.computed_fields) if written else ()
    ):
        if own:
            words = "parameters are stored as they are, without serializers and computed fields"
            raise PluginError(f"{place}: found {next(iter(own))}; {words}")
    if issubclass(model, Equations):
        check_name(model, place)
        _check_old(model, place)
        _check_equations(model, place)
        try:
            model.numbers()
        except TypeError as error:
            raise PluginError(f"{place}: {error}") from None
    if issubclass(model, RobotKind):
        check_name(model, place)
    if issubclass(model, Expectation):
        _check_expectation(model, place)
    else:
        check_defaults(model, place)
    for name, expected in model.misstated():
        value = getattr(model, name)
        found = (
            f"{name}{_line(value)}" if isfunction(value) else f"{name} = {value!r:.80}{_line_of(model, name)}"
        )
        raise PluginError(f"{place}: found {found}; expected {expected}")
    _check_names(model, place)


def _check_settings(model: type[Any], place: str) -> None:
    """What it says of itself in place of a base class is a flag, a number or a text where that has one."""
    for name, value in vars(model).items():
        of_base = next((vars(base)[name] for base in model.__mro__[1:] if name in vars(base)), None)
        if isfunction(of_base) and not (callable(value) or hasattr(value, "__get__")):
            found = f"found {name} = {value!r:.80}{_line_of(model, name)}"
            raise PluginError(f"{place}: {found}; expected a method")
        for kind, words in ((bool, "True or False"), (str, "a text"), (float, "a number")):
            good = isinstance(value, (kind, int) if kind is float else kind) and value == value
            if type(of_base) is kind and not good and not name.startswith("_"):
                found = f"found {name} = {value!r:.80}{_line_of(model, name)}"
                raise PluginError(f"{place}: {found}; expected {words}")


def _check_names(model: type[Any], place: str) -> None:
    """It has no public name that is almost one of its base class, which would be left unused.

    What it has in place of methods of the base class is called as these are; Python's own methods are left.
    """
    theirs = _written_in(model)
    ours: list[Any] = [base for base in model.__mro__ if base not in (*theirs, *GENERAL)]
    known = [pair for base in ours for pair in vars(base).items() if pair[0][0] != "_"]
    methods = [name for name, value in known if _is_method(value)] + [*ours[0].model_fields]
    others = ["compiled", *(name for name, value in known if not hasattr(value, "__get__"))]
    for base in theirs:
        for name, value in vars(base).items():
            of_base = getattr(ours[0], name, None)
            if (
                isfunction(value)
                and name.startswith(("__", "model_"))
                and value.__module__ == base.__module__
            ):
                words = "a component has parameters, and methods with names of their own"
                raise PluginError(f"{place}: found {name}{_line(value)}; {words}")
            if isinstance(inspect.getattr_static(ours[0], name, None), classmethod) and name[:2] != "__":
                raise PluginError(f"{place}: found {name}{_line(value)}; it is not to be set")
            if isfunction(value) and isfunction(of_base) and name[0] != "_":
                given = inspect.signature(of_base).parameters.items()
                _check_signature(value, [key for key, one in given if one.default is one.empty], place)
            if name.startswith(("_", "model_")) or hasattr(ours[0], name) or isinstance(value, Memory):
                continue
            if isinstance(getattr(model, name.removesuffix("_rate"), None), Memory):
                continue
            if near := did_you_mean(name, methods if _is_method(value) else others, cutoff=0.8):
                words = f"found {name}{_line(getattr(value, 'fget', value)) or _line_of(base, name)}"
                own = "a name of your own that is so alike begins with _"
                raise PluginError(f"{place}: {words}, of which nothing knows{near} ({own})")


def _written_in(model: type[Any]) -> list[type[Any]]:
    """Return it and those of its bases that are no part of the program, nor of Python."""
    others = ("escort_mj", "pydantic", "builtins")
    return [base for base in model.__mro__ if base.__module__.split(".")[0] not in others]


def _is_method(value: Any) -> bool:
    """Whether it is a method or a property."""
    return callable(value) or isinstance(value, property)


def check_metric(metric: Metric, source: str) -> None:
    """Check a metric of a plugin.

    Raises:
        PluginError: If its name or function is not as it must be.
    """
    place = f"{source}: {metric.name}"
    if not NAME.match(metric.name):
        raise PluginError(f"{place}: a metric's name is lower-case letters, digits and _, at most 40")
    if not metric.meaning:
        raise PluginError(
            f"{place}: has no meaning; its function's text in triple quotes says it in one line"
        )
    _check_signature(metric.function, ["trace"], place)


def _check_expectation(model: type[Expectation], place: str) -> None:
    """It names itself by a key of its own, and judges."""
    kind = getattr(model, "kind", None)
    if not isinstance(kind, str) or not NAME.match(kind):
        raise PluginError(f'{place}: does not say its name; give it the line  kind = "my_name"')
    if kind not in model.model_fields:
        raise PluginError(
            f"{place}: has no key {kind}: a scenario tells it by the key of its name"
            f"{did_you_mean(kind, model.model_fields)}"
        )
    if model.judge is Expectation.judge:
        own = [name for name, value in vars(model).items() if callable(value) and not name.startswith("_")]
        raise PluginError(f"{place}: has no judge(self, trace){instead('judge', own)}")
    _check_signature(model.judge, ["self", "trace"], place)
    for name, value in [pair for base in _written_in(model) for pair in vars(base).items()]:
        if name != "judge" and name[0] != "_" and _is_method(getattr(Expectation, name, None)):
            words = "an expectation has parameters and judge(self, trace)"
            raise PluginError(f"{place}: found {name}{_line(getattr(value, 'fget', value))}; {words}")
    model.model_rebuild(force=True)


def check_name(model: type[Member], place: str) -> None:
    """A class says its name: a key whose only value is its default."""
    key = model.named_by
    field = model.model_fields[key]
    names = get_args(field.annotation) if get_origin(field.annotation) is Literal else ()
    if len(names) != 1 or field.default != names[0]:
        raise PluginError(
            f'{place}: does not say its name; give it the line  {key}: Literal["my_name"] = "my_name"'
        )
    if not isinstance(names[0], str) or not NAME.match(names[0]):
        raise PluginError(
            f"{place}: found the name {names[0]!r}; a name is lower-case letters, digits and _, at most 40"
        )


def required_parameters(model: type[Component]) -> list[str]:
    """Return the numbers and vectors that a scenario has to give a component."""
    numbers = [name for name, field in model.model_fields.items() if field.annotation in (float, int)]
    return [name for name in (*numbers, *model.vectors()) if model.model_fields[name].is_required()]


def check_defaults(model: type[Any], place: str) -> None:
    """Every parameter of its own has a default, but for numbers and vectors of components."""
    needed = required_parameters(model) if issubclass(model, Component) else []
    base: type[Parameters] = kind_of(model) if issubclass(model, Equations) else Parameters
    for name, field in model.model_fields.items():
        if field.is_required() and name not in (*needed, *base.model_fields):
            raise PluginError(f"{place}: the parameter {name} has no default")
        own = name in vars(model).get("__annotations__", {})
        if own and not isinstance(field.get_default(call_default_factory=True), Hashable):
            words = f"found {name}{_line_of(model, name)}, a list or the like; expected a tuple"
            raise PluginError(f"{place}: {words}")
        if own and field.default_factory is None and not field.is_required():
            try:
                model.__pydantic_validator__.validate_assignment(model.model_construct(), name, field.default)
            except ValidationError as error:
                words = error.errors()[0]["msg"]
                words = f"found the default {field.default!r:.80}; {words[:1].lower()}{words[1:]}"
                raise PluginError(f"{place}: {name}{_line_of(model, name)}: {words}") from None
    if not any(field.is_required() for field in model.model_fields.values()):
        try:
            made: Any = model.model_validate({})
            for _ in range(2):  # the defaults, and what validators make of them
                if not isinstance(made, model):
                    raise PluginError(f"{place}: a validator returned {made!r:.80}; expected self")
                made = model.model_validate(vars(made))
        except ValidationError as error:
            words = error.errors()[0]["msg"].removeprefix("Value error, ")
            raise PluginError(f"{place}: {words}") from None


def _check_equations(model: type[Equations], place: str) -> None:
    """Its equations are there, and take what they are called with."""
    own = [name for name, value in vars(model).items() if callable(value) and not name.startswith("_")]
    base = kind_of(model)
    if "memories" in vars(model):
        words = f'd_hat: ClassVar[Memory] = Memory("N", "disturbance"), and d_hat{model.moves}(self, r)'
        raise PluginError(f"{place}: found memories; expected one line for each, such as {words}")
    if getattr(model, model.method) is getattr(base, model.method):
        raise PluginError(f"{place}: has no {model.method}(self, r){instead(model.method, own)}")
    for memory, kind in inspect.get_annotations(model).items():
        if re.search(r"\bMemory\b", str(kind)) and memory not in model.memories():
            words = f'{memory}: ClassVar[Memory] = Memory("unit", "meaning")'
            raise PluginError(f"{place}: {memory}{_line_of(model, memory)} keeps nothing; expected {words}")
    for memory in model.memories():
        unit, meaning, truth, is_vector = getattr(model, memory)
        if not all(isinstance(part, str) and part.strip() for part in (unit, meaning)):
            found = f"{memory} = {getattr(model, memory)!r:.80}{_line_of(model, memory)}"
            words = 'its unit and its meaning in words, as in Memory("N", "disturbance")'
            raise PluginError(f"{place}: found {found}; expected {words}")
        if is_vector and not model.keeps_vectors:
            words = f"what {kind_word(model)}s keep has one shape"
            raise PluginError(f"{place}: found vector = True of {memory}{_line_of(model, memory)}; {words}")
        if truth != "" and truth not in (shown := estimable(unit)):
            words = f"a signal of each robot and axis in {unit}: {listed(shown)}"
            near = did_you_mean(truth, shown) if isinstance(truth, str) else ""
            found = f"{memory}{_line_of(model, memory)} estimates {truth!r}"
            raise PluginError(f"{place}: {found}; expected {words}{near}")
        if not hasattr(model, name := memory + model.moves):
            words = f"{memory}{_line_of(model, memory)} has no {name}(self, r)"
            raise PluginError(f"{place}: {words}{instead(name, own)}")
    moved = [name for name in model.equations() if name.endswith(model.moves)]
    for name in own:
        if name.endswith(model.moves) and name not in moved:
            memory = f'{name.removesuffix(model.moves)}: ClassVar[Memory] = Memory("unit", "meaning")'
            verb = "integrates" if model.moves == RATE else "keeps"
            words = f"nothing {verb} {name}{_line(vars(model)[name])}; expected the line  {memory}"
            raise PluginError(f"{place}: {words}{did_you_mean(name, moved)}")
    if model.memories() and not model.keeps:
        words = f"{kind_word(model)}s keep nothing from step to step"
        raise PluginError(f"{place}: found {next(iter(model.memories()))}; {words}")
    known = {name for name, _ in model.reads}
    if taken := [name for name in model.memories() if name in known]:
        raise PluginError(
            f"{place}: {taken[0]} is a value that {kind_word(model)}s read; choose another name"
        )
    for name, function in model.equations().items():
        _check_signature(function, ["self", "r"], place)
        if model.compiled and (at := _prints(function, set())):
            words = "a component writes nothing to standard output"
            raise PluginError(f"{place}: found print in {name}{_line(at)}; {words}")


def _prints(function: Any, seen: set[Any]) -> Any:
    """Return the function of a plugin, of those that one calls, that prints; None if none does.

    Of what Python evaluates, this is found as it happens; machine code writes past Python.
    """
    function = getattr(function, "py_func", function)
    if not isfunction(function) or function in seen or not is_plugins(function):
        return None
    seen.add(function)
    names = function.__code__.co_names
    if "print" in names and "print" not in function.__globals__:
        return function
    called = (_prints(function.__globals__.get(name), seen) for name in names)
    return next(filter(None, called), None)


def estimable(unit: str) -> list[str]:
    """Return the signals of each robot and axis in a unit: what memory can be an estimate of."""
    return [each.name for each in SIGNALS if each.dims == ("robot", "axis") and each.unit == unit]


def _check_old(model: type[Equations], place: str) -> None:
    """It is not written as components once were, and leaves alone what says how it is called."""
    for name in ("method", "view", "outputs", "scratch", "answers", "gives", "digest"):
        if name in vars(model):
            raise PluginError(f"{place}: found {name} = {vars(model)[name]!r:.80}; it is not to be set")
    wanted = f"{model.method}(self, r)"
    for base, (name, returned) in OLD.items():
        found = vars(model).get(name) if issubclass(model, base) else None
        if found is not None and (name != model.method or "view" in inspect.signature(found).parameters):
            words = f"expected {wanted}, {returned} (docs/plugins.md)"
            raise PluginError(f"{place}: found {name} in its old form{_line(found)}; {words}")
    for name in (f"{model.method}_kernel", f"{model.method}_lanes"):
        if name in vars(model):
            words = f"{wanted} with the line  compiled: ClassVar[bool] = True"
            raise PluginError(f"{place}: found {name}{_line(vars(model)[name])}; expected {words}")
    if isinstance(vars(model).get(model.method), Compiled):
        words = "the line  compiled: ClassVar[bool] = True"
        raise PluginError(f"{place}: found @njit on {model.method}; expected {words}")


def _line(function: Any) -> str:
    """Say where a function stands, if it says so itself."""
    function = getattr(function, "__func__", function)  # of a class method
    code = getattr(getattr(function, "py_func", function), "__code__", None)
    return f" (line {code.co_firstlineno})" if code else ""


def _line_of(model: type[Any], name: str) -> str:
    """Say where a class gives a name a value, if its source can be read."""
    try:
        lines, first = inspect.getsourcelines(model)
    except (OSError, TypeError):
        return ""
    found = (first + k for k, line in enumerate(lines) if re.match(rf"\s+{name}\s*[:=]", line))
    return next((f" (line {line})" for line in found), "")


def _check_signature(function: Callable[..., Any], wanted: list[str], place: str) -> None:
    """A function takes as many arguments as it is called with."""
    try:
        inspect.signature(function).bind(*wanted)
    except TypeError:
        taken = ", ".join(inspect.signature(function).parameters)
        raise PluginError(
            f"{place}.{function.__name__}{_line(function)}: takes ({taken}); it is called with "
            f"({', '.join(wanted)})"
        ) from None
