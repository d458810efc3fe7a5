"""Base classes of the laws and behaviors that plugins bring, and the two forms in which they are written."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar, Literal, NamedTuple, get_args, get_origin

from pydantic import ConfigDict

from escort_mj.control.laws.tracking import Gains, TrackingLaw
from escort_mj.control.own.views import BEHAVIOR_OUTPUTS, LAW_OUTPUTS, BehaviorView, LawView
from escort_mj.control.parameters import Parameters

COMPILED = "_kernel"  # ends the name of the compiled form


class _ByNumba(type):
    """Tells what @njit makes of a function, without numba."""

    def __instancecheck__(cls, value: Any) -> bool:
        return hasattr(value, "py_func")


class Compiled(metaclass=_ByNumba):
    """What @njit makes of a function."""


class Forms(NamedTuple):
    """The two ways to write one method; at least one is there.

    Attributes:
        python: In plain Python and NumPy, called at every step through the interpreter.
        kernel: To be compiled into the native loop.
    """

    python: Callable[..., Any] | None
    kernel: Callable[..., Any] | None


class Own(Parameters):
    """What laws and behaviors of plugins share; parameters are numbers, true or false, or choices."""

    model_config = ConfigDict(ignored_types=(Compiled,))

    method: ClassVar[str]
    """Name of the method that a plugin writes; with `_kernel` behind it, of its compiled form."""
    view: ClassVar[type]
    """What the method is handed."""
    outputs: ClassVar[tuple[str, ...]]
    """What it writes there."""
    prefer_kernel: ClassVar[bool] = True
    """Whether the compiled form runs, where there is one."""
    digest: ClassVar[str] = ""
    """Tells the plugin's content; set by whoever loads it."""

    @classmethod
    def forms(cls) -> Forms:
        """Its forms, as written: `force` with @njit counts as compiled."""
        written = getattr(cls, cls.method, None)
        fast = getattr(cls, cls.method + COMPILED, None)
        if isinstance(written, Compiled):
            written, fast = None, fast or written
        return Forms(written, getattr(fast, "py_func", fast))

    @classmethod
    def numbers(cls) -> dict[str, type]:
        """Its parameters as kernels see them: name and type, of a choice the place of what is chosen.

        Raises:
            TypeError: If a parameter is something else.
        """
        found: dict[str, type] = {}
        for name, field in cls.model_fields.items():
            if name in ("law", "behavior"):
                continue
            kind: Any = field.annotation
            if get_origin(kind) is Literal:
                kind = int
            if kind not in (float, int, bool):
                raise TypeError(
                    f"{name}: found {field.annotation}; a parameter of a law or behavior is a float, an int, "
                    "a bool or a Literal of names"
                )
            found[name] = kind
        return found

    def packed(self) -> dict[str, float]:
        """Its parameters as numbers."""
        values: dict[str, float] = {}
        for name in self.numbers():
            value = getattr(self, name)
            choices = choices_of(type(self), name)
            values[name] = float(choices.index(value) if choices else value)
        return values

    @classmethod
    def unpacked(cls, values: dict[str, Any]) -> Any:
        """Its parameters from numbers."""
        named = dict(values)
        for name, value in values.items():
            if choices := choices_of(cls, name):
                named[name] = choices[int(value)]
        return cls.model_construct(**named)


def choices_of(model: type[Own], name: str) -> tuple[Any, ...]:
    """What a parameter may be chosen from; nothing for a number."""
    kind = model.model_fields[name].annotation
    return get_args(kind) if get_origin(kind) is Literal else ()


class Law(TrackingLaw, Own):
    """Base of a plugin's law: what force each robot is to have, so that it follows its reference.

    A subclass has a key `law` with its name, parameters, and `force` or `force_kernel` or both, called with
    itself (in the compiled form: with its parameters' numbers) and a `LawView`.
    """

    method: ClassVar[str] = "force"
    view: ClassVar[type] = LawView
    outputs: ClassVar[tuple[str, ...]] = LAW_OUTPUTS
    memories: ClassVar[int] = 0
    """How many numbers of its own are integrated for every robot and axis: `law_memory`."""

    law: str

    def gains(self) -> Gains:
        """What the loop integrates begins at `initial_estimate`, where the law has such a parameter."""
        return Gains(0.0, 0.0, 0.0, 0.0, float(getattr(self, "initial_estimate", 0.0)))


class Behavior(Own):
    """Base of a plugin's behavior: what velocity one robot is to have, and which directions that takes.

    A subclass has a key `behavior` with its name, parameters, and `wish` or `wish_kernel` or both, called
    with itself (in the compiled form: with its parameters' numbers), a `BehaviorView`, and which robot it is,
    from 0. It returns `ALONG`, `ACROSS` or `NOTHING`.
    """

    method: ClassVar[str] = "wish"
    view: ClassVar[type] = BehaviorView
    outputs: ClassVar[tuple[str, ...]] = BEHAVIOR_OUTPUTS

    behavior: str
