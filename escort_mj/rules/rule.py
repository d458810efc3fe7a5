"""Base of the supervisor's rules: a quantity of each robot, and where a phase begins and ends."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Literal

from escort_mj.behaviors.equations import TeamEquations
from escort_mj.behaviors.robots import Robots
from escort_mj.components.component import Derived
from escort_mj.components.equations import NUMBER, VECTOR, Answer, Call
from escort_mj.native.lanes import everywhere, store

TEAM = 1
"""Place among the choices of `scope`."""


class Rule(TeamEquations):
    """Condition for a phase, evaluated with the robots' measurements (`sensing`).

    A subclass has a key `quantity` with its name, parameters, and the equation `value(self, r)`, which
    returns a number for each robot. Kernels evaluate it for eight robots at once. What it integrates of its
    own, it declares as behaviors do.
    """

    plural: ClassVar[str] = "rules"
    named_by: ClassVar[str] = "quantity"
    method: ClassVar[str] = "value"
    asks: ClassVar[tuple[str, ...]] = ("value",)
    outputs: ClassVar[tuple[str, ...]] = ("compared", "component_rate")
    gives: ClassVar[str] = "robot {} a value"
    looks_at: ClassVar[tuple[str, ...]] = ()
    """What a mission has to have: `obstacles`, `robots` (two or more), `target`."""

    quantity: str
    below: float | None = None
    """The phase begins when the quantity falls below this value. Set `below` or `above`."""
    above: float | None = None
    """The phase begins when the quantity rises above this value."""
    release: float | None = None
    """The phase ends when the quantity passes this value on its way back; null: the threshold itself, without
    hysteresis."""
    scope: Literal["robot", "team"] = "robot"
    """Which robots change phase: the `robot` that meets the condition, or the whole `team` as soon as one
    robot does."""

    def value(self, r: Robots) -> Any:
        """Return what is compared.

        Args:
            r: The robots, and what they know: `q`, `target`, `radius` and more.
        """
        raise NotImplementedError

    @Derived
    def threshold(self) -> float:
        """Where the phase begins."""
        return self.below if self.below is not None else float(self.above or 0.0)

    @Derived
    def end(self) -> float:
        """Where the phase ends."""
        return self.threshold if self.release is None else self.release

    @classmethod
    def evaluation(cls, made: Call, equations: Mapping[str, Call]) -> Call:
        """Return what writes the values of robots i to i + 7 to a view: `(parameters, view, i)`."""
        value, robots, move_on = equations["value"], cls.robots(), cls.moving_on(made, equations)

        def compare(parameters: Any, view: Any, i: int) -> None:
            store(view.compared, i, everywhere(value(parameters, robots(i, view, view))))
            move_on(parameters, view, i)

        return compare

    @classmethod
    def answer_of(cls, name: str) -> Answer:
        """Return what an equation is to return."""
        return NUMBER if name == cls.method else VECTOR
