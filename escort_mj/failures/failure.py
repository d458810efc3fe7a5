"""Base of failures: what the motors of a robot still do when they fail."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar, Literal, NamedTuple

from pydantic import NonNegativeFloat, PositiveInt

from escort_mj.components.equations import Call, Equations
from escort_mj.native.fields import Array
from escort_mj.native.lanes import WIDTH, everywhere, lane_numbers, store, where
from escort_mj.native.values import Values, reader_of

MOTORS = ("obey", "off", "hold")
OBEY, OFF, HOLD = 0.0, 1.0, 2.0
"""What motors do that are not one for each axis, see `Failure.motors`, and its place there."""


class FailureView(NamedTuple):
    """What a failure sees of all robots, and what it writes for one of them."""

    timestep: float  # [s]
    time: Annotated[Array, 1]  # [s]
    failure_age: Annotated[Array, 1]  # time since the motors failed [s]
    q: Annotated[Array, "n", "p"]  # true position [m]
    v: Annotated[Array, "n", "p"]  # true velocity [m/s]
    tau: Annotated[Array, "n", "p"]  # force that the law demands [N]
    force_before: Annotated[Array, "n", "p"]  # force one step ago [N]
    force_limits: Annotated[Array, "n", "p"]  # of the motors [N]; 1e300 for none
    failure_draw: Annotated[Array, "failing", "p"]  # random numbers, uniform in (-1, 1)
    failure_command: Annotated[Array, "failing", "p"]  # written: command of the motors [N]


NAMES = (
    *(("timestep", "timestep"), ("time", "time"), ("age", "failure_age"), ("q", "q"), ("v", "v")),
    *(("tau", "tau"), ("force_before", "force_before"), ("force_limit", "force_limits")),
    ("draw", "failure_draw"),
)
"""What a failure can read, and the fields of `FailureView` that have it."""


class Failure(Equations):
    """A failure of a robot's motors.

    Once the team knows about it, the robot counts as an obstacle, and the others close ranks. A subclass has
    a key `kind` with its name, parameters, and the equation `command(self, r)`: the force that the motors are
    to give from then on. Each value is that of one axis.
    """

    plural: ClassVar[str] = "failures"
    named_by: ClassVar[str] = "kind"
    default_name: ClassVar[str | None] = "dead"
    method: ClassVar[str] = "command"
    view: ClassVar[type] = FailureView
    outputs: ClassVar[tuple[str, ...]] = ("failure_command",)
    answers: ClassVar[str | None] = ""
    gives: ClassVar[str] = "robot {} a force"
    asks: ClassVar[tuple[str, ...]] = ("command",)
    reads: ClassVar[tuple[tuple[str, str], ...]] = NAMES
    keeps: ClassVar[str] = ""
    motors: ClassVar[Literal["obey", "off", "hold"]] = "obey"
    """What motors do that are not one for each axis, such as rotors: `obey` the force, go `off`, or `hold`
    their last control."""
    renews: ClassVar[float] = 0.0
    """Time after which random numbers are drawn anew [s]; 0: at every step."""

    kind: str
    robot: PositiveInt
    """Number of the robot, from 1."""
    at: NonNegativeFloat
    """Time of the failure [s]."""
    notice: NonNegativeFloat = 0.5
    """Delay until the team knows about the failure [s]; until then, the robot counts as intact."""

    @classmethod
    def misstated(cls) -> Iterator[tuple[str, str]]:
        """Yield what motors do, if that is unknown."""
        if cls.motors not in MOTORS:
            yield "motors", f"one of {', '.join(MOTORS)}"

    def command(self, r: Values) -> Any:
        """Return the force of the motors [N].

        Args:
            r: Values: `tau`, `force_before`, `draw`, `age` and more, see `NAMES`.
        """
        raise NotImplementedError

    @classmethod
    def evaluation(cls, made: Call, equations: Mapping[str, Call]) -> Call:
        """Return what writes the command of the motors of one robot: `(parameters, view, robot)`."""
        values_at, command = reader_of(cls.names()), equations["command"]

        def fail(parameters: Any, view: Any, robot: int) -> None:
            p = view.q.shape[1]
            for at in range(robot * p // WIDTH * WIDTH, robot * p + p, WIDTH):
                axis = lane_numbers() + float(at - robot * p)
                mine = (axis > -0.5) & (axis < p - 0.5)  # beside it are those of other robots
                found = everywhere(command(parameters, values_at(view, at)))
                store(view.failure_command, at, where(mine, found, 0.0))

        return fail
