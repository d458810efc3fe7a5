"""Base of sensors: what is measured of a quantity, from its true value."""

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar, NamedTuple

from escort_mj.components.dispatch import in_turn
from escort_mj.components.equations import Call, Equations
from escort_mj.native.fields import Array
from escort_mj.native.lanes import WIDTH, copy_numbers, everywhere, store
from escort_mj.native.values import Values, reader_of

QUANTITIES = {
    "position": "m",
    "velocity": "m/s",
    "target_position": "m",
    "target_velocity": "m/s",
    "heading": "rad",
}
"""What sensors measure, and its unit: of robots, of the target for the whole team, of robots again."""
SHOWS, MOVES = 0, 1
"""What a sensor is asked: what it shows, before which its own numbers move on where time has."""


class SensorView(NamedTuple):
    """What a sensor sees of one quantity of all robots, along one axis, and what it writes."""

    timestep: float  # [s]
    time: Annotated[Array, 1]  # [s]
    sensor_truth: Annotated[Array, "measuring"]  # true value
    sensor_normals: Annotated[Array, 2, "measuring"]  # random numbers of mean 0 and variance 1
    sensor_draw: Annotated[Array, "measuring"]  # likewise, uniform in [0, 1)
    sensor_memory: Annotated[Array, "sensor_memories", "measuring"]  # the sensor's own numbers, at first 0
    sensor_memory_next: Annotated[Array, "sensor_memories", "measuring"]  # written: what becomes of these
    sensor_shown: Annotated[Array, "measuring"]  # written: measured value


NAMES = (
    ("timestep", "timestep"),
    ("time", "time"),
    ("truth", "sensor_truth"),
    ("draw", "sensor_draw"),
)
"""What a sensor can read, and the fields of `SensorView` that have it."""
NORMALS = ("normal", "second_normal")


class Sensor(Equations):
    """What robots measure of a quantity.

    A subclass has a key `sensor` with its name, parameters, and the method `shows`: an equation between
    values, each of one axis of one robot. What a sensor keeps of its own, it keeps for each of them, and
    moves on with every physics step; runs record it.
    """

    plural: ClassVar[str] = "sensors"
    named_by: ClassVar[str] = "sensor"
    method: ClassVar[str] = "shows"
    view: ClassVar[type] = SensorView
    outputs: ClassVar[tuple[str, ...]] = ("sensor_shown", "sensor_memory_next")
    scratch: ClassVar[tuple[str, ...]] = ("sensor_memory",)
    answers: ClassVar[str | None] = ""
    gives: ClassVar[str] = "robot {} a measurement"
    asks: ClassVar[tuple[str, ...]] = ("shows",)
    reads: ClassVar[tuple[tuple[str, str], ...]] = NAMES
    keeps: ClassVar[str] = "sensor_memory"
    measures: ClassVar[tuple[str, ...]] = tuple(QUANTITIES)
    """Quantities that it can measure."""

    sensor: str

    @classmethod
    def misstated(cls) -> Iterator[tuple[str, str]]:
        """Yield what it measures, if that is unknown."""
        found: Any = cls.measures
        if not isinstance(found, tuple) or not found or not {*found} <= {*QUANTITIES}:
            yield "measures", f'some of {", ".join(QUANTITIES)}, as in ("heading",)'

    def shows(self, r: Values) -> Any:
        """Return the measured value.

        Args:
            r: Values: `truth`, `normal`, `timestep` and more, see `NAMES`.
        """
        raise NotImplementedError

    @property
    def late(self) -> float:
        """Return how late measurements are [s], for automatic gains; by default 0."""
        return 0.0

    @property
    def is_perfect(self) -> bool:
        """Whether it shows the truth."""
        return False

    def variance(self, axes: int) -> float:
        """Return the variance of errors, per axis, that estimators expect."""
        return self.deviation(axes) ** 2

    def deviation(self, axes: int) -> float:
        """Return the standard deviation of noise per axis, for gains and estimators; by default 0.

        Args:
            axes: Dimension of the space.
        """
        return 0.0

    @classmethod
    def equated(cls) -> bool:
        """Return whether it is written as equations, as all are but the plain one."""
        return cls.shows is not Sensor.shows

    @classmethod
    def names(cls) -> Any:
        """Return by what names it reads values."""
        found = super().names()
        drawn = tuple((name, "sensor_normals", row) for row, name in enumerate(NORMALS))
        return found._replace(rows=(*found.rows, *drawn))

    @classmethod
    def evaluation(cls, made: Call, equations: Mapping[str, Call]) -> Call:
        """Return what writes the measured values of all robots: `(parameters, view, question)`."""
        values_at, shows = reader_of(cls.names()), equations["shows"]

        def writer(row: int, following: Call) -> Call:
            def write(parameters: Any, view: Any) -> None:
                count = view.sensor_truth.shape[0]
                for at in range(0, count, WIDTH):  # what it writes past the end, the next row writes again
                    found = following(parameters, values_at(view, at))
                    store(view.sensor_memory_next, row * count + at, everywhere(found))

            return made(write)

        follow = (writer(row, equations[name + cls.moves]) for row, name in enumerate(cls.memories()))
        move = in_turn(made, follow)

        def show(parameters: Any, view: Any, question: int) -> None:
            if question == MOVES:
                move(parameters, view)
                count = view.sensor_memory.shape[0] * view.sensor_memory.shape[1]
                copy_numbers(view.sensor_memory_next, view.sensor_memory, count)
            for at in range(0, view.sensor_truth.shape[0], WIDTH):
                store(view.sensor_shown, at, everywhere(shows(parameters, values_at(view, at))))

        return show
