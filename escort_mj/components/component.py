"""What every law and behavior is made of, of the package or of a plugin: parameters, forms of its method."""

from collections.abc import Callable, Sequence
from functools import cache
from types import NoneType
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, get_args, get_origin, overload

from pydantic import ConfigDict

from escort_mj.components.parameters import UNLIMITED, Member, Vector
from escort_mj.components.setup import MissionSetup
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import DOUBLE, data_address, inlined, reachable
from escort_mj.native.memory import Layout, viewer
from escort_mj.plan import Plan

OUTSIDE = -1  # in place of a component's number: what it would compute is written from outside, between steps


class ComponentParameters(Fields):
    """The parameters of the law, then of the behaviors, a block each: see `shipped_layout`."""

    parameters: Annotated[Array, "parameters", Value("1", "blocks one behind the other")]


def number_of(member: "Component", known: "Sequence[type[Component]]") -> int:
    """Return the place of a component's class among those that ship; one past them for a plugin's."""
    return known.index(type(member)) if type(member) in known else len(known)


class _ByNumba(type):
    """Tells what @njit makes of a function, without numba."""

    def __instancecheck__(cls, value: Any) -> bool:
        return hasattr(value, "py_func")


class Compiled(metaclass=_ByNumba):
    """What @njit makes of a function."""


class Derived:
    """A property that is a float, worked out from keys that kernels do not read: they read it as a parameter.

    Args:
        function: Works it out.
    """

    def __init__(self, function: Callable[[Any], float]) -> None:
        self._function = function
        self.__doc__ = function.__doc__

    @overload
    def __get__(self, own: None, kind: type) -> "Derived": ...
    @overload
    def __get__(self, own: object, kind: type) -> float: ...
    def __get__(self, own: object | None, kind: type) -> "Derived | float":
        return self if own is None else self._function(own)


class OfMission(Derived):
    """A float that is worked out for a mission, which nobody but equations reads.

    Args:
        function: Works it out, of the component and a `MissionSetup`.
    """

    def __init__(self, function: Callable[[Any, Any], float]) -> None:
        super().__init__(lambda own: float("nan"))
        self.of = function
        self.__doc__ = function.__doc__


def derived_of(model: type) -> list[str]:
    """Return the names of what kernels read beside the parameters of a component, its first base's first."""
    found = (
        name
        for owner in reversed(model.__mro__)
        for name, value in vars(owner).items()
        if isinstance(value, Derived)
    )
    return list(dict.fromkeys(found))


class Component(Member):
    """Base of laws and behaviors; kernels read parameters that are numbers, true or false, or choices."""

    model_config = ConfigDict(ignored_types=(Compiled, Derived))

    view: ClassVar[type]
    """What the method is handed."""
    outputs: ClassVar[tuple[str, ...]]
    """What it writes there."""
    scratch: ClassVar[tuple[str, ...]] = ()
    """What it may write there too, and nobody reads."""
    answers: ClassVar[str | None] = None
    """What the method returns for one robot or body, its last argument: in words, empty for nothing; None
    where it is called for the whole team at once."""
    gives: ClassVar[str] = "robot {} a force"
    """What it writes, in words, for the robot or body of a number."""
    compiled: ClassVar[bool] = False
    """Whether a plugin's method is compiled into the loop; else Python is called in every step."""
    digest: ClassVar[str] = ""
    """Identifies the plugin's content; set by what loads it."""
    python_only: ClassVar[frozenset[str]] = frozenset()
    """Keys that kernels do not read, beside its name."""

    @classmethod
    def wrong(cls, view: Any, number: int) -> str:
        """Say what it wrote that cannot be used, in words that follow "gave".

        Args:
            view: What the method was handed, and has written to.
            number: Of the robot or body, from 1.
        """
        return f"{cls.gives.format(number)} that is not a finite number"

    @classmethod
    def numbers(cls) -> dict[str, type]:
        """Return its parameters as kernels see them: name and type, of a choice the place of what is chosen.

        Raises:
            TypeError: If a parameter is something else.
        """
        found: dict[str, type] = dict.fromkeys(derived_of(cls), float)
        for name, field in cls.model_fields.items():
            if name in (cls.named_by, *cls.python_only):
                continue
            kind: Any = Annotated[Array, "p"] if name in cls.vectors() else _kind_of(field.annotation)
            if kind not in (float, int, bool, Annotated[Array, "p"]):
                raise TypeError(
                    f"{name}: found {field.annotation}; a parameter of a law or behavior is a float, an int, "
                    "a bool, a Vector, a Literal of names, or a float or None for no limit"
                )
            found[name] = kind
        return found

    @classmethod
    def vectors(cls) -> list[str]:
        """Return its parameters that are vectors, a number for each axis."""
        return [name for name, field in cls.model_fields.items() if field.annotation == Vector]

    def packed(self, setup: MissionSetup | None = None) -> dict[str, Any]:
        """Return its parameters as numbers.

        Args:
            setup: The mission, for parameters that depend on it.
        """
        values: dict[str, Any] = {name: getattr(self, name) for name in self.vectors()}
        for name in [each for each in self.numbers() if each not in values]:
            kept = getattr(type(self), name, None)
            value = kept.of(self, setup) if isinstance(kept, OfMission) else getattr(self, name)
            choices = choices_of(type(self), name)
            values[name] = float(choices.index(value) if choices else UNLIMITED if value is None else value)
        return values

    @classmethod
    def unpacked(cls, values: dict[str, Any]) -> Any:
        """Return its parameters from numbers; it has no others."""
        found = cls.model_construct()
        for name in cls.python_only:
            del found.__dict__[name]
        for name, value in values.items():
            choices = choices_of(cls, name)
            found.__dict__[name] = Choice(int(value), choices) if choices else value
        return found


class Choice(int):
    """What was chosen of several: equal to its place among them, as in kernels, and to its name."""

    name: Any

    def __new__(cls, place: int, choices: "Sequence[Any]") -> "Choice":
        """Create the choice of a place."""
        found = super().__new__(cls, place)
        found.name = choices[place]
        return found

    def __eq__(self, other: object) -> bool:
        return self.name == other if isinstance(other, type(self.name)) else int(self) == other

    def __hash__(self) -> int:
        return hash(self.name)


def choices_of(model: type[Component], name: str) -> tuple[Any, ...]:
    """Return what a parameter may be chosen from; nothing for a number."""
    kind = model.model_fields[name].annotation if name in model.model_fields else None
    return get_args(kind) if get_origin(kind) is Literal else ()


def _kind_of(annotation: Any) -> Any:
    """Return what a parameter is in kernels: of a choice its place, of a float or None a float."""
    if get_origin(annotation) is Literal:
        return int
    kinds = [kind for kind in get_args(annotation) if kind is not NoneType]
    if len(kinds) == 1 and NoneType in get_args(annotation):
        bare = get_args(kinds[0])[0] if get_origin(kinds[0]) is Annotated else kinds[0]
        return bare if bare is float else annotation
    return annotation


def layout_of(model: type[Component], number: int) -> Layout:
    """Return how a component's parameters lie in memory.

    Args:
        model: The component.
        number: Begins the block, and says which component it belongs to.
    """
    numbers = NamedTuple(f"{model.__name__}Numbers", [*model.numbers().items()])  # type: ignore[misc]
    return Layout(float(number), numbers)


@cache
def reader(model: type[Component]) -> Callable[[int, int], Any]:
    """Return a function that reads a shipped component's parameters at an address, in kernels and in Python.

    Its second argument says nothing; views of all kinds are made with one.
    """

    def read(address: int, axes: int) -> Any:
        layout = shipped_layout(model)
        return layout.read(layout.plan, address, address)

    viewer(
        lambda: (shipped_layout(model), shipped_layout(model).plan),
        reachable(read, f"parameters_of_{model.__name__}"),
    )
    return read


@cache
def shipped_layout(model: type[Component]) -> Layout:
    """Return how the parameters of a component that ships lie in memory."""
    return layout_of(model, 0)


@inlined
def block_at(place: int, plan: Plan) -> int:
    """Return the address of the block of a component's parameters that begins at a place."""
    return data_address(plan.parameters) + DOUBLE * place
