"""Base of disturbances: forces on robots of which no law is told."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from typing import Annotated, Any, ClassVar, NamedTuple

from escort_mj.components.dispatch import in_turn
from escort_mj.components.equations import VECTOR, Answer, Call, Equations
from escort_mj.components.memory import RATE, keep_rate, memory_at
from escort_mj.knowledge.teammates import Mate
from escort_mj.native.fields import Array
from escort_mj.native.lanes import WIDTH, Lanes, everywhere, lane_numbers, load
from escort_mj.native.values import Computed, maker_of, names_of, with_own
from escort_mj.native.vectors import Vec, one_row, rows_at, set_rows


class DisturbanceView(NamedTuple):
    """What a disturbance sees of all robots, all of it true, and what it writes; n robots, p axes."""

    timestep: float  # [s]
    time: Annotated[Array, 1]  # [s]
    q: Annotated[Array, "n", "p"]  # position [m]
    v: Annotated[Array, "n", "p"]  # velocity [m/s]
    robot_radius: Annotated[Array, "n"]  # [m]
    grid_coordinates: Annotated[Array, "grid_coordinates"]  # see `grids_of` [1, s, m]
    grid_velocity: Annotated[Array, "grid_points", "p"]  # [m/s]
    noise: Annotated[Array, "blown", "p"]  # normal random numbers of this step; for those that draw
    common_noise: Annotated[Array, "p"]  # likewise, the same for all robots
    second_noise: Annotated[Array, "blown_twice", "p"]  # likewise others, for those that draw two
    second_common_noise: Annotated[Array, "p"]
    component_memory: Annotated[Array, "memories", "n", "p"]  # integrals of the rates below, at first 0
    memory_row: Annotated[Array, 1]  # where its own begin
    disturbance_force: Annotated[Array, "pushed", "p"]  # written [N]
    component_rate: Annotated[Array, "memories", "n", "p"]  # written: 0 unless said
    rate_found: Annotated[Array, "remembering", "p"]  # scratch


class Robots(Computed):
    """Eight robots as they are in truth; SI units, world frame. What they keep of its own, they have by name.

    Positions, velocities, noise and memory are vectors (`Vec`), radii a number for each robot.
    """

    i: int
    seen: DisturbanceView

    @property
    def q(self) -> Vec:
        """Position [m]."""
        return rows_at(self.seen, self.seen.q, self.i)

    @property
    def v(self) -> Vec:
        """Velocity [m/s]."""
        return rows_at(self.seen, self.seen.v, self.i)

    @property
    def radius(self) -> Lanes:
        """Radius of each robot [m]."""
        return load(self.seen.robot_radius, self.i)

    @property
    def time(self) -> float:
        """Time of the mission [s]."""
        return self.seen.time[0]

    @property
    def timestep(self) -> float:
        """Physics step [s]."""
        return self.seen.timestep

    @property
    def noise(self) -> Vec:
        """Normal random numbers for each robot and axis, of variance 1, drawn at each step [1]."""
        return rows_at(self.seen, self.seen.noise, self.i)

    @property
    def common_noise(self) -> Vec:
        """Likewise, the same for all robots [1]."""
        return one_row(self.seen, self.seen.common_noise)

    @property
    def second_noise(self) -> Vec:
        """Other random numbers for each robot and axis [1]."""
        return rows_at(self.seen, self.seen.second_noise, self.i)

    @property
    def second_common_noise(self) -> Vec:
        """Likewise, the same for all robots [1]."""
        return one_row(self.seen, self.seen.second_common_noise)

    @property
    def places(self) -> int:
        """How many others each robot has at most, see `mate`."""
        return self.seen.q.shape[0]

    def mate(self, place: int) -> Mate:
        """Return another robot for each robot, at a place from 0 to `places` - 1: where it is in truth."""
        known = abs(lane_numbers() + float(self.i - place)) > 0.5
        radius = everywhere(self.seen.robot_radius[place])
        return Mate(known, one_row(self.seen, self.seen.q[place]), radius, known)


OTHERS = "places", "mate"
NOISES = ("noise", "common_noise"), ("second_noise", "second_common_noise")


class Disturbance(Equations):
    """A force on every robot that the controller does not know.

    A subclass has a key `disturbance` with its name, parameters, and the equation `force(self, r)`, which
    returns a vector [N]. What it integrates of its own, it declares, as in
    `gust: ClassVar[Memory] = Memory("m/s", "gust")`, with the rate as `gust_rate(self, r)`; the value is
    `r.gust`. It may have random numbers (`r.noise`) if it says `draws: ClassVar[bool] = True`; with
    `draws: ClassVar[int] = 2`, `r.second_noise` has as many more. With `sees_others: ClassVar[bool] = True`,
    `r.mate(place)` is another robot for each, as behaviors have it.
    """

    plural: ClassVar[str] = "disturbances"
    named_by: ClassVar[str] = "disturbance"
    method: ClassVar[str] = "force"
    view: ClassVar[type] = DisturbanceView
    outputs: ClassVar[tuple[str, ...]] = ("disturbance_force", "component_rate")
    scratch: ClassVar[tuple[str, ...]] = ("rate_found",)
    asks: ClassVar[tuple[str, ...]] = ("force",)
    moves: ClassVar[str] = RATE
    reads: ClassVar[tuple[tuple[str, str], ...]] = tuple((name, name) for name in names_of(Robots))
    keeps: ClassVar[str] = "component_memory"
    first: ClassVar[str] = "memory_row"
    draws: ClassVar[int] = 0
    """How many random numbers it is given, for each robot and axis; true for one."""
    of_time_key: ClassVar[tuple[str, ...]] = ()
    """Path of the key with the functions that `of_time` returns; empty where no key has them."""
    sees_others: ClassVar[bool] = False
    """Whether the force on a robot may depend on where others are, see `Robots.mate`."""

    disturbance: str

    def force(self, r: Robots) -> Vec:
        """Return the force [N].

        Args:
            r: Robots: `q`, `v`, `time` and more.
        """
        raise NotImplementedError

    @property
    def of_time(self) -> tuple[float | str, ...]:
        """Return the force as functions of time alone, one per axis, in place of an equation [N]."""
        return ()

    @classmethod
    def misstated(cls) -> Iterator[tuple[str, str]]:
        """Yield a number of random numbers that is not to be had."""
        if cls.draws not in range(len(NOISES) + 1):
            yield "draws", "True, False or 2"

    @classmethod
    def robots(cls) -> type[Robots]:
        """Return what its equations are handed: robots that have its own memory by name."""
        own = {name: _remembered(row) for row, name in enumerate(cls.memories())}
        withheld = [name for names in NOISES[int(cls.draws) :] for name in names]
        return with_own(Robots, cls, own, [*withheld, *(() if cls.sees_others else OTHERS)])

    @classmethod
    def evaluation(cls, made: Call, equations: Mapping[str, Call]) -> Call:
        """Return what writes the forces on all robots and the rates of its memory: `(parameters, view)`."""
        robots_at, force = robots_of(cls), equations["force"]

        def push(parameters: Any, view: Any) -> None:
            for i in range(0, view.q.shape[0], WIDTH):
                set_rows(view.disturbance_force, i, force(parameters, robots_at(i, view)))

        def writer(row: int, rate: Call) -> Call:
            def write(parameters: Any, view: Any) -> None:
                for i in range(0, view.q.shape[0], WIDTH):
                    set_rows(view.rate_found, i, rate(parameters, robots_at(i, view)))
                keep_rate(view, row, 0, view.q.shape[0])

            return made(write)

        rates = (writer(row, equations[name + RATE]) for row, name in enumerate(cls.memories()))
        write = in_turn(made, [made(push), *rates])

        def run(parameters: Any, view: Any) -> None:
            write(parameters, view)

        return run

    @classmethod
    def answer_of(cls, name: str) -> Answer:
        """Return what an equation is to return."""
        return VECTOR


def _remembered(row: int) -> property:
    """Return a property that reads a row of the memory of the component at hand."""

    def read(robots: Any) -> Vec:
        return memory_at(robots.seen, row, robots.i)

    return property(read)


@cache
def robots_of(disturbance: type[Disturbance]) -> Any:
    """Return a function that makes what a disturbance is handed: of the first robot's number and the view."""
    return maker_of(disturbance.robots())
