"""The sensor that quantities have if nothing else is said: `sensing.measure` has its kernel."""

import math
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, NonNegativeFloat, PlainValidator, WithJsonSchema
from pydantic_core import PydanticCustomError

from escort_mj.components.parameters import Vector
from escort_mj.sensors.sensor import Sensor

LARGEST = 1e6  # bias [m or m/s]
_NUMBER = {"maximum": LARGEST, "minimum": -LARGEST, "type": "number"}


def _bias(value: Any) -> float | tuple[float, ...]:
    """A radius, or one number per axis."""
    items = value if isinstance(value, list | tuple) else [value]
    least = -LARGEST if items is value else 0.0
    for item in items:
        if isinstance(item, bool) or not isinstance(item, int | float) or not least <= item <= LARGEST:
            raise PydanticCustomError("bias_type", "a radius or a list of numbers")
    numbers = tuple(float(item) for item in items)
    return numbers if items is value else numbers[0]


Bias = Annotated[
    float | Vector,
    PlainValidator(_bias),
    WithJsonSchema({"anyOf": [{"type": "number", "minimum": 0}, {"items": _NUMBER, "type": "array"}]}),
]
"""A constant error: the radius of a ball to draw it from, or the error itself."""


class Plain(Sensor):
    """Errors in the measurement of one quantity; without any, the measurement is the truth."""

    measures: ClassVar[tuple[str, ...]] = ("position", "velocity", "target_position", "target_velocity")
    python_only: ClassVar[frozenset[str]] = Sensor.python_only | {"bias"}
    sensor: Literal["plain"] = "plain"
    noise: NonNegativeFloat = 0.0
    """Radius of the ball from which an error is drawn uniformly at every step [m or m/s]."""
    bias: Bias = 0.0
    """Constant error [m or m/s]: one number per axis, the same for all robots, or the radius of the ball from
    which an error is drawn uniformly for each robot."""
    delay: NonNegativeFloat = 0.0
    """Delay of the measurement [s], a whole number of physics steps."""
    dropout: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.0
    """Probability per step that the measurement is lost and the previous value is kept [1]."""
    resolution: Annotated[float, Field(ge=1e-9, le=1e6)] | None = None
    """Resolution to which values are rounded [m or m/s]; null: no rounding."""

    @property
    def late(self) -> float:
        """Return how late measurements are [s]."""
        return self.delay

    def deviation(self, axes: int) -> float:
        """Return the standard deviation of noise per axis: of a ball's radius."""
        return self.noise * (1.0 / math.sqrt(axes + 2.0))

    @property
    def is_perfect(self) -> bool:
        """Whether it shows the truth."""
        return not any((self.noise, self.bias, self.delay, self.dropout, self.resolution))

    def variance(self, axes: int) -> float:
        """Return the variance of noise and rounding, per axis [m^2 or m^2/s^2]."""
        step = self.resolution or 0.0
        return self.noise * self.noise / (axes + 2.0) + step * step / 12.0
