"""A mission worked out from its scenario: what checks, world, controller and figures are given."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

from escort_mj.components.setup import FunctionOfTime, Outside
from escort_mj.control.setup import Setup
from escort_mj.expectations.expectation import watches_of
from escort_mj.memory.sampling import Sampling, signal_dimensions
from escort_mj.metrics.watching import Watch
from escort_mj.robots.kind import RobotKind
from escort_mj.scenario.findings import Path
from escort_mj.scenario.geometry.bodies import Bodies, bodies_of
from escort_mj.scenario.geometry.obstacles import Body, obstacles_of
from escort_mj.scenario.geometry.placement import Placement, kinds_of, robot_count, team
from escort_mj.scenario.geometry.steps import Schedule, schedule_of
from escort_mj.scenario.geometry.trajectory import target_trajectory
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.scenario.setup import controller_setup, with_formation
from escort_mj.sensing.sensors import Sensors
from escort_mj.signals import record_size, record_sizes

Array = NDArray[np.float64]

PLAYED = frozenset(
    {"q", "target_position", "lost", "kept_radius", "obstacle_distance", "robot_distance_min"}
    | {"clearance", "target_clearance"}
)
"""Signals that are found of motion that is known instead of simulated."""
NEARBY, ROOM = 1.0, 1.1  # m, and times each bound: from here on clearances of robots of geoms are exact


class Seen(NamedTuple):
    """What was seen of real robots, whose motion is known instead of simulated.

    Attributes:
        position: Where they start, shape (n, p) [m].
        target: Where the target was; None for where the scenario has it.
        edges: Physics steps beside which the motion is unknown; there are samples in them.
    """

    position: Array
    target: FunctionOfTime | None = None
    edges: tuple[int, ...] = ()


def _parts_of(value: Any, path: Path) -> Iterator[tuple[Path, Any]]:
    yield path, value
    within = dict(value) if isinstance(value, BaseModel) else dict(enumerate(value))
    for name, each in within.items():
        if isinstance(each, BaseModel | tuple | list):
            yield from _parts_of(each, (*path, name))


@dataclass(frozen=True, eq=False)
class Mission:
    """A scenario worked out; each part once, when it is first asked for.

    Attributes:
        scenario: A checked scenario.
        start: Where robots start, shape (n, p) [m]; None for where the scenario has them.
        outside: What is written from outside instead of computed, see `Setup`.
        opponents_outside: Whether what opponents want is written from outside, too.
        seen: What was seen of real robots; None for a simulation.
        judged: Whether expectations are judged; if not, nothing is watched between samples.
    """

    scenario: Scenario
    start: Array | None = None
    outside: Outside | None = None
    opponents_outside: bool = False
    seen: Seen | None = None
    judged: bool = True

    @cached_property
    def parts(self) -> tuple[tuple[Path, Any], ...]:
        """Every table and every sequence of the scenario, and where each stands."""
        return tuple(_parts_of(self.scenario, ()))

    @property
    def count(self) -> int:
        """Number of robots."""
        return robot_count(self.scenario)

    @cached_property
    def kinds(self) -> tuple[RobotKind, ...]:
        """What each robot is."""
        return kinds_of(self.scenario)

    @cached_property
    def team(self) -> Placement:
        """The robots as they start.

        Raises:
            ScenarioError: If there is no room for positions that are drawn.
        """
        drawn, start = team(self.scenario), self.start if self.seen is None else self.seen.position
        return drawn if start is None else drawn._replace(position=start)

    @cached_property
    def obstacles(self) -> tuple[Body, ...]:
        """What stands in the way.

        Raises:
            ScenarioError: If there is no room for clutter.
        """
        return obstacles_of(self.scenario)

    @cached_property
    def bodies(self) -> Bodies:
        """What can touch."""
        return bodies_of(self.scenario)

    @cached_property
    def target(self) -> FunctionOfTime:
        """Where the target is; the origin without one."""
        seen = self.seen and self.seen.target
        return target_trajectory(self.scenario) if seen is None else seen

    @cached_property
    def setup(self) -> Setup:
        """What the controller is given."""
        return with_formation(self.loose_setup, self.scenario, self.team)

    @cached_property
    def loose_setup(self) -> Setup:
        """The same but for the formation, whose points may take seconds to find."""
        setup = controller_setup(self.scenario, self.team, self.obstacles, self.target)
        setup = setup.commanded(self.outside, self.opponents_outside)
        if self.seen is None:
            return setup
        # what was logged has been measured, and pushed, by reality
        return replace(setup, sensing=Sensors(), trigger=None, sight=None, radio=None).undisturbed()

    @cached_property
    def watches(self) -> tuple[Watch, ...]:
        """What expectations ask about every physics step; of a log, what its motion alone tells."""
        asked = watches_of(self.scenario.expect) if self.judged else ()
        if self.seen is None:
            return asked
        return tuple(watch for watch in asked if PLAYED.issuperset(watch.course.signals))

    @cached_property
    def schedule(self) -> Schedule:
        """When samples are taken."""
        return schedule_of(self.scenario, self.seen.edges if self.seen is not None else ())

    def sampling(self, several: Sequence[bool]) -> Sampling:
        """Return when samples are taken, and of what.

        Args:
            several: Which robots are more than their hulls, shape (n,).
        """
        truth, exact = self.scenario.recording.truth, any(several)
        return Sampling(
            stride=self.schedule.stride,
            extra=self.schedule.extra,
            kept=not truth,  # truth needs Python at every sample
            coordinates=self.team.coordinates + len(self.loose_setup.movers) * self.scenario.axes,
            truth=truth,
            groups=len(self.bodies.watched),
            columns=self.bodies.columns,
            several=several if exact else (),
            exact_within=self.exact_within if exact else 0.0,
            watches=len(self.watches),
        )

    @property
    def exact_within(self) -> float:
        """Below what clearance the sphere around a robot does not do for its geoms [m]."""
        asked = [bound for one in self.scenario.expect for bound in one.robot_distances()]
        return max([NEARBY, *(ROOM * bound for bound in asked)])

    def record_sizes(self, sampling: Sampling) -> dict[str, int]:
        """Return the sizes of the dimensions of its record."""
        return record_sizes(signal_dimensions(self.loose_setup, sampling))

    @property
    def trace_size(self) -> float:
        """How large the trace of a run will be, before it is compressed [byte]."""
        several = [kind.modeled for kind in self.kinds]
        return 8.0 * record_size(self.record_sizes(self.sampling(several))) * self.schedule.count


@lru_cache(maxsize=16)  # who checks a scenario often builds its world
def mission_of(scenario: Scenario) -> Mission:
    """Return the mission of a scenario as it stands."""
    return Mission(scenario)
