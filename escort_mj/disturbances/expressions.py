"""A force that depends on time alone."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from escort_mj.components.parameters import OfTime
from escort_mj.disturbances.disturbance import Disturbance


class Expressions(Disturbance):
    """The same force on every robot, as functions of time."""

    python_only: ClassVar[frozenset[str]] = Disturbance.python_only | {"per_axis"}

    disturbance: Literal["expressions"] = "expressions"
    per_axis: Annotated[tuple[OfTime, ...], Field(max_length=9)] = ()
    """Force per axis [N]: numbers, or expressions in t."""

    of_time_key: ClassVar[tuple[str, ...]] = ("per_axis",)

    @property
    def of_time(self) -> tuple[float | str, ...]:
        """Return the functions."""
        return self.per_axis
