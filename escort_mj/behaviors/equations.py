"""Base of behaviors and rules: what is asked of robots, eight at once."""

from collections.abc import Mapping
from functools import cache
from typing import Any, ClassVar

from escort_mj.behaviors.robots import Robots, robots_at
from escort_mj.components.dispatch import in_turn
from escort_mj.components.equations import Call, Equations
from escort_mj.components.memory import RATE, keep_rate, memory_at
from escort_mj.components.views import BehaviorView
from escort_mj.native.lanes import WIDTH
from escort_mj.native.values import maker_of, names_of, with_own
from escort_mj.native.vectors import Vec, set_rows


class TeamEquations(Equations):
    """What is asked of robots by `Robots`, and may integrate vectors of its own for each of them."""

    reads: ClassVar[tuple[tuple[str, str], ...]] = tuple((name, name) for name in names_of(Robots))
    view: ClassVar[type] = BehaviorView
    scratch: ClassVar[tuple[str, ...]] = ("rate_found",)
    answers: ClassVar[str | None] = ""
    moves: ClassVar[str] = RATE
    keeps: ClassVar[str] = "component_memory"
    first: ClassVar[str] = "memory_row"

    @classmethod
    def robots(cls) -> Call:
        """Return what makes the robots that its equations are handed; they have its own memory by name."""
        return _robots_of(cls) if cls.memories() else robots_at

    @classmethod
    def moving_on(cls, made: Call, equations: Mapping[str, Call]) -> Call:
        """Return what writes the rates of its memory, of robots i to i + 7: `(parameters, view, i)`."""
        robots = cls.robots()

        def writer(row: int, rate: Call) -> Call:
            def write(parameters: Any, view: Any, i: int) -> None:
                set_rows(view.rate_found, i, rate(parameters, robots(i, view, view)))
                keep_rate(view, row, i, WIDTH)

            return made(write)

        rates = (writer(row, equations[name + RATE]) for row, name in enumerate(cls.memories()))
        return in_turn(made, rates)


@cache
def _robots_of(asking: type[TeamEquations]) -> Call:
    own = {name: _remembered(row) for row, name in enumerate(asking.memories())}
    return maker_of(with_own(Robots, asking, own))


def _remembered(row: int) -> property:
    """Return a property that reads a row of the memory of the component at hand."""

    def read(robots: Any) -> Vec:
        return memory_at(robots.state, row, robots.i)

    return property(read)
