"""What a metric finds: a value, when, and of which bodies."""

from __future__ import annotations

from typing import NamedTuple

Bodies = tuple[str, ...]


class Measure(NamedTuple):
    """The value of a metric.

    Attributes:
        value: In the metric's unit; None where the metric says nothing of this run, infinite for "never".
        time: Moment of the worst value [s]; None where there is none.
        bodies: Names of the bodies that had it; empty where no body in particular.
        reason: Why there is no value.
        broken: Whether that is an error of the metric's function.
        unlogged: Whether that is because a log of real robots does not contain what it needs.
        manner: What a verdict adds to the value, in a few words: how it was found, or where bodies are.
    """

    value: float | None
    time: float | None = None
    bodies: Bodies = ()
    reason: str = ""
    broken: bool = False
    unlogged: bool = False
    manner: str = ""

    @property
    def who(self) -> str:
        """The bodies in words."""
        return in_words(self.bodies)


def in_words(bodies: Bodies) -> str:
    """Names of bodies in a sentence: `robots 1 and 2`, `robot 1 and gate`."""
    bodies = tuple(dict.fromkeys(bodies))  # the same one in two parts: once
    numbers = [name.removeprefix("robot_") for name in bodies]
    if len(bodies) > 1 and all(number.isdigit() for number in numbers):
        return f"robots {' and '.join(numbers)}"
    return " and ".join(name.replace("robot_", "robot ") for name in bodies)
