"""Components whose methods are equations between values, and numbers of their own that go with these."""

import re
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from typing import Any, ClassVar, NamedTuple

import numpy as np

from escort_mj.components.component import Component
from escort_mj.components.facts import Facts, Misfit
from escort_mj.components.parameters import Member
from escort_mj.native.values import Names
from escort_mj.native.vectors import Vec

Call = Callable[..., Any]
Answer = tuple[tuple[type, ...], str]
"""What an equation is to return: types, and in words."""
NUMBER: Answer = (int, float, np.integer, np.floating, np.bool_), "a number"
VECTOR: Answer = (Vec,), "a vector, such as r.q"


class Memory(NamedTuple):
    """A number of a component's own, at first 0; its class says how it moves on.

    Attributes:
        unit: SI unit.
        meaning: In a few words.
        truth: The recorded signal that it estimates, beside which figures draw it; empty for none.
        vector: Whether it is a vector, where its component has vectors and numbers.
    """

    unit: str
    meaning: str
    truth: str = ""
    vector: bool = False


class Equations(Component):
    """What is written as equations: methods that are handed values by name and return one.

    What a component keeps of its own, it declares, as in `d_hat: ClassVar[Memory] = Memory("N", "estimate")`,
    with a method of its name and `moves` that says how it moves on; the value is `r.d_hat`.
    """

    _in_place_of_setting: ClassVar[str] = "what components keep is a ClassVar[Memory]"
    asks: ClassVar[tuple[str, ...]]
    """Names of its methods."""
    moves: ClassVar[str] = "_next"
    """Ends the name of the method that moves a number of its own on."""
    reads: ClassVar[tuple[tuple[str, str], ...]]
    """Names of the values that methods can read, and the fields of its view that have them."""
    keeps: ClassVar[str]
    """Field of its view that has the numbers of its own."""
    keeps_vectors: ClassVar[bool] = False
    """Whether these may be vectors; else they have one shape."""
    first: ClassVar[str] = ""
    """Field of its view that says in which row of these its own begin; empty where all are its own."""

    @classmethod
    def memories(cls) -> dict[str, Memory]:
        """Return what it keeps of its own, by name."""
        return _memories_of(cls)

    @classmethod
    def names(cls) -> Names:
        """Return by what names it reads values."""
        rows = tuple((name, cls.keeps, row) for row, name in enumerate(cls.memories()))
        return Names(cls.reads, rows, cls.first)

    @classmethod
    def evaluation(cls, made: Call, equations: Mapping[str, Call]) -> Call:
        """Return what evaluates the equations, as the loop calls it: of parameters, its view, and a number.

        Args:
            made: Makes a function callable in kernels.
            equations: What `equations()` returns, made so.
        """
        raise NotImplementedError

    def misfits_of_kind(self, mission: Facts) -> Iterator[Misfit]:
        """Yield what does not fit of the keys that all components of its kind have; by default nothing."""
        yield from ()

    def misfits(self, mission: Facts) -> Iterator[Misfit]:
        """Yield what of it does not fit a mission; by default nothing."""
        yield from ()

    def over_arrays(self, view: Any) -> Callable[[], None] | None:
        """Return what evaluates the equations in Python for all robots at once; None where nothing does."""
        return None

    @classmethod
    def answer_of(cls, name: str) -> Answer:
        """Return what an equation is to return."""
        return NUMBER

    @classmethod
    def equations(cls) -> dict[str, Callable[..., Any]]:
        """Return its methods of values by name, those that move its own numbers on last."""
        return {name: getattr(cls, name) for name in (*cls.asks, *(m + cls.moves for m in cls.memories()))}


@cache
def _memories_of(kind: type[Equations]) -> dict[str, Memory]:
    own = reversed(kind.__mro__[: kind.__mro__.index(Equations)])
    return {name: each for base in own for name, each in vars(base).items() if isinstance(each, Memory)}


def kind_word(component: type[Any]) -> str:
    """Return what kind of component a class is, in words: the name of the base class of its kind."""
    kinds = [each for each in component.__mro__ if each not in (Member, Component, Equations)]
    base = next((each for each in reversed(kinds) if issubclass(each, Member) and each.plural), component)
    return " ".join(re.findall("[A-Z][a-z]*", base.__name__)).lower()
