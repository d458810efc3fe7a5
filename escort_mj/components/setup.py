"""What all components are told of their mission, beside the table of each."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import accumulate, pairwise
from typing import Any, Literal, NamedTuple, Protocol, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from escort_mj.components.parameters import Parameters
from escort_mj.errors import UsageError
from escort_mj.numerics.formation import Arrangement
from escort_mj.numerics.reform import Reforming
from escort_mj.numerics.thomson import Figure, least_energy

Array = NDArray[np.float64]
Outside = Literal["velocity", "residual", "force"]
COMMANDED: dict[Outside, tuple[str, str]] = {
    "velocity": ("v_d", "m/s"), "residual": ("residual", "m/s"), "force": ("tau", "N")
}  # fmt: skip
"""What robots may be commanded from outside: the array of the state that has it, and its unit."""
Remembering = Literal["laws", "disturbances", "behaviors", "rules"]
"""Kinds of components that integrate numbers of their own for every robot and axis."""
B = TypeVar("B", bound=Parameters)

WAY_SAMPLES = 200  # of the way of a formation
EASY = 32  # robots whose even points are solved in a few seconds
MOST_JUDGED = 200  # robots; the energy of more takes long to sum over a trace


class FunctionOfTime(Protocol):
    """A vector that depends on time, as the scenario's expressions and waypoints give it."""

    def position(self, t: float | Array) -> Array:
        """Value at t, shape (p,) or (len(t), p)."""
        ...

    def velocity(self, t: float | Array) -> Array:
        """Exact time derivative at t, same shape."""
        ...

    def programs(self) -> tuple[Array, NDArray[np.int64], Array]:
        """Instructions (ops, 3), first row and count per axis (p, 2), segments (rows, 5)."""
        ...


class Mover(NamedTuple):
    """One body that moves by itself.

    Attributes:
        path: Where it is to be [m].
        mass: [kg].
        force_limit: Largest force that drives it [N]; inf for none.
        gain: How fast it comes back to where it should be [1/s].
        obstacle: Which obstacle it is, from 0; -1 for the target.
        policy: What it wants, a `Policy`, where that is not its path; the path is then where it begins.
    """

    path: FunctionOfTime
    mass: float
    force_limit: float
    gain: float
    obstacle: int
    policy: Any = None


class Shape(NamedTuple):
    """One obstacle as lines meet it.

    Attributes:
        kind: Number in KINDS.
        size: Half-sizes and radii as MuJoCo has them, shape (3,) [m]; 0 where there are fewer.
        turn: From its own axes to the world's, shape (3, 3).
        lift: How far its center is above the plane of a planar mission [m].
        reach: Radius of a ball around its center that contains it [m].
        planes: Faces of a mesh in its own axes: outward normal, and minus the distance of the face from the
            center [m], shape (k, 4).
    """

    kind: int
    size: Array
    turn: Array
    lift: float
    reach: float
    planes: Array


class Frame(NamedTuple):
    """The frame of a formation.

    Attributes:
        offsets: Place of each robot in it, shape (n, p) [m].
        function: Position, cosine and sine of the heading, and scale: p + 3 components.
        along: Whether it heads along its way instead.
        follows: Whether it goes with the target instead.
    """

    offsets: Array
    function: FunctionOfTime
    along: bool
    follows: bool


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class MissionSetup:
    """What components are told of their mission; `control.setup` says of what types the others are.

    Attributes:
        timestep: Physics and control step [s].
        seed: Key of the measurement noise.
        behaviors: By priority, the most important first, while no phase rules.
        law: The inner loop's law and gains; the first one, where robots have different ones.
        laws: Those that differ; empty where all robots have one.
        team_laws: Which of them each team has, from 0, or the one team of all.
        own_laws: Which of them each robot has of its own, whatever its team, shape (n,); -1 for none.
        radius: Distance to keep from the target [m].
        target_feedforward: Whether the target's velocity is added to the escort behaviors.
        max_speed: Largest reference speed [m/s]; inf for none.
        arrangement: The formation that chords keeps; None without chords.
        obstacle_position: Centers, shape (m, p) [m].
        obstacle_radius: Shape (m,) [m]; 0 for those that are no spheres.
        robot_radius: Shape (n,) [m].
        force_limit: Largest force per axis, shape (n,) [N]; inf for none.
        target: Position and velocity of the target [m].
        disturbance: Force on every robot by those disturbances that depend on time alone [N]; None for none.
        disturbances: The others.
        goals: By behavior `goal`, as `all_behaviors` has them, the waypoints of each robot, shape
            (waypoints, p) [m].
        formations: By behavior `formation`, likewise.
        radii: By behavior `surface` whose radius changes, likewise: its radius, one component.
        figure: The even figure that vertices keeps; None without vertices.
        failures: Robots whose motors fail.
        reforming: Figures of fewer robots; None without vertices, or where no robot fails.
        phases: Tables that say when other behaviors than those above rule; of those that do, the last one.
        trigger: When robots run their outer loop; None for every step.
        outer: How behaviors become one velocity.
        sensing: What sensors make of the truth.
        movers: Obstacles that move, and a target that can be bumped.
        opponents: Tables of those of the obstacles that want to reach the target; they come last.
        teams: Tables of robots with targets of their own, which are the last obstacles before opponents;
            empty where all escort the target.
        shaped: Whether some obstacle is no sphere: robots then see the nearest points.
        expected_distances: Distances to obstacles that expectations put bounds on [m].
        shapes: Obstacles as lines meet them; empty where none has to, or all are spheres.
        outside: What is written from outside, between steps: the reference velocities, instead of those of
            the outer loop; velocities added to what the behaviors lead to; or forces, instead of those of
            both loops; None for nothing.
        opponents_outside: Whether the velocities that opponents want are written from outside, too.
        driven: Whether some robot has a drive of its own.
        mass: Nominal masses, shape (n,) [kg].
        target_radius: [m]; None without a target.
        extents: Half the upright boxes around the centers of obstacles, 0 for spheres, shape (m, p) [m]; None
            where all are spheres.
        sight: Who sees the target, and how; None where all robots know what the team's sensors show.
        radio: How robots communicate; None where they know each other's positions.
        estimator: What robots with sight make of what they see and hear.
        start_deviation: How well these know position, velocity and acceleration of the target at the start
            [m, m/s, m/s^2].
    """

    timestep: float
    seed: int
    behaviors: tuple[Any, ...]
    law: Any
    radius: float
    target_feedforward: bool
    max_speed: float
    arrangement: Arrangement | None = None
    obstacle_position: Array
    obstacle_radius: Array
    robot_radius: Array
    force_limit: Array
    target: FunctionOfTime
    disturbance: FunctionOfTime | None
    goals: tuple[tuple[Array, ...], ...] = ()
    formations: tuple[Frame, ...] = ()
    radii: tuple[FunctionOfTime, ...] = ()
    figure: Figure | None = None
    failures: tuple[Any, ...] = ()
    reforming: Reforming | None = None
    phases: tuple[Any, ...] = ()
    trigger: Any = None
    outer: Any
    sensing: Any
    movers: tuple[Mover, ...] = ()
    opponents: tuple[Any, ...] = ()
    teams: tuple[Any, ...] = ()
    shaped: bool = False
    shapes: tuple[Shape, ...] = ()
    expected_distances: tuple[float, ...] = ()
    outside: Outside | None = None
    opponents_outside: bool = False
    driven: bool = False
    mass: Array | float = 1.0
    target_radius: float | None = None
    extents: Array | None = None
    sight: Any = None
    radio: Any = None
    estimator: Any
    start_deviation: tuple[float, float, float] = (0.0, 0.0, 0.0)
    laws: tuple[Any, ...] = ()
    team_laws: tuple[int, ...] = ()
    own_laws: tuple[int, ...] = ()
    disturbances: tuple[Any, ...] = ()

    @property
    def estimating(self) -> bool:
        """Whether each robot has an estimate of the target of its own."""
        return self.sight is not None

    @property
    def led(self) -> bool:
        """Whether behaviors lead the robots."""
        return self.outside in (None, "residual")

    def commanded(self, outside: Outside | None, opponents: bool = False) -> Self:
        """Return it with robots, and opponents, that are commanded from outside.

        Raises:
            UsageError: If velocities are to be added, and the outer loop has none to which that would be.
        """
        if outside == "residual" and not self.outer.composes:
            words = f"the outer loop {self.outer.loop} does not compose behaviors"
            raise UsageError(f"command: found residual; {words}: expected velocity or force")
        return replace(self, outside=outside, opponents_outside=opponents)

    @property
    def opponent_places(self) -> range:
        """Which obstacles opponents are, from 0, in the order in which a trace numbers them."""
        end = len(self.obstacle_radius)
        return range(end - sum(group.count for group in self.opponents), end)

    @property
    def target_places(self) -> list[range]:
        """Which obstacles the targets of each team are at the start, from 0."""
        counts = [len(team.targets) for team in self.teams]
        ends = accumulate(counts, initial=self.opponent_places.start - sum(counts))
        return [range(*pair) for pair in pairwise(ends)]

    def radii_of(self, team: Any) -> list[float]:
        """Return all distances that a team keeps at any time, first that at the start [m]."""
        return [team.radius or self.radius, *(each.radius for each in team.radii)]

    @property
    def auctioned(self) -> bool:
        """Whether robots bid for their vertices."""
        return any(behavior.bids for behavior in self.all_behaviors)

    @property
    def apart(self) -> bool:
        """Whether robots have targets and teammates each by itself: of its team, or as it knows."""
        return self.estimating or bool(self.teams)

    @property
    def members(self) -> NDArray[np.int64]:
        """Team of each robot at the start, from 0, shape (n,); 0 where all are one."""
        found = np.zeros(self.count, dtype=np.int64)
        for number, team in enumerate(self.teams):
            found[[robot - 1 for robot in team.robots]] = number
        return found

    @property
    def all_laws(self) -> tuple[Any, ...]:
        """The laws that some robot has."""
        return self.laws or (self.law,)

    @cached_property
    def _memory(self) -> tuple[dict[Remembering, list[int]], dict[str, Any]]:
        members: dict[Remembering, Sequence[Any]] = {
            "laws": self.all_laws,
            "disturbances": self.disturbances,
            "behaviors": self.all_behaviors,
            "rules": [phase.when for phase in self.phases],
        }
        starts, rows, names = dict[Remembering, list[int]](), dict[str, Any](), list[str]()
        for kind, own in members.items():
            starts[kind] = []
            for member in own:
                starts[kind].append(len(rows))
                if member is None or not member.memories():
                    continue
                names.append(type(member).own_name())
                known = names.count(names[-1])
                label = names[-1] if known == 1 else f"{names[-1]}_{known}"
                rows |= {f"{label}.{key}": memory for key, memory in member.memories().items()}
        return starts, rows

    @property
    def memory(self) -> dict[str, Any]:
        """What components integrate of their own: a `Memory` for each row, by its name."""
        return self._memory[1]

    def memory_rows(self, kind: Remembering) -> list[int]:
        """Return the row of `memory` at which that of each component of a kind begins."""
        return self._memory[0][kind]

    @property
    def memory_phases(self) -> list[int]:
        """Phase whose behavior keeps each row of `memory`; -1 for what others keep."""
        found = [-1] * len(self.memory)
        phases = [number for number, stack in enumerate(self.stacks) for _ in stack]
        for phase, first, behavior in zip(
            phases, self.memory_rows("behaviors"), self.all_behaviors, strict=True
        ):
            found[first : first + len(behavior.memories())] = [phase] * len(behavior.memories())
        return found

    def undisturbed(self) -> Self:
        """Return it without disturbances."""
        return replace(self, disturbance=None, disturbances=())

    @property
    def has_lyapunov(self) -> bool:
        """Whether the proof's Lyapunov function V1 is that of the law, which all robots share."""
        return bool(self.law.has_lyapunov) and not self.laws

    def by_robot(self, name: str, members: NDArray[np.int64] | None = None) -> Array:
        """Return a parameter of the law of each robot, shape (n,).

        Args:
            name: Of the parameter.
            members: Team of each robot, from 0; None for the start.
        """
        values = np.array([float(getattr(law, name)) for law in self.all_laws])
        return values[self.laws_of(members)]

    def laws_of(self, members: NDArray[np.int64] | None = None) -> NDArray[np.int64]:
        """Return which of `all_laws` each robot has, from 0, shape (n,).

        Args:
            members: Team of each robot, from 0; None for the start.
        """
        members = self.members if members is None else members
        if not self.laws:
            return np.zeros_like(members)
        own = np.array(self.own_laws, dtype=np.int64)
        return np.where(own >= 0, own, np.array(self.team_laws, dtype=np.int64)[members])

    @property
    def count(self) -> int:
        """Number of robots, n."""
        return len(self.robot_radius)

    @property
    def headed(self) -> bool:
        """Whether robots have goals."""
        return bool(self.goals or self.formations)

    def destinations(self, duration: float) -> Array:
        """Where robots are sent: all waypoints, and corners around the formations on their ways.

        Args:
            duration: How long formations are looked at [s].

        Returns:
            Points, shape (k, p) [m]; those of formations that go with the target are left out.
        """
        p, times = self.axes, np.linspace(0.0, duration, WAY_SAMPLES)
        found = [np.zeros((0, p)), *(points for stack in self.goals for points in stack)]
        for frame in self.formations:
            if not frame.follows:
                value = frame.function.position(times)
                reach = np.abs(value[:, -1]) * np.linalg.norm(frame.offsets, axis=1).max()
                ways = np.concatenate([np.eye(p), -np.eye(p)])
                found.append((value[:, None, :p] + reach[:, None, None] * ways).reshape(-1, p))
        return np.concatenate(found)

    def numbered(self, kind: type[B]) -> list[tuple[int, B]]:
        """Return the behaviors of a kind, each with the number of its phase, in their order."""
        return [
            (number, behavior)
            for number, stack in enumerate(self.stacks)
            for behavior in stack
            if isinstance(behavior, kind)
        ]

    @property
    def stacks(self) -> list[tuple[Any, ...]]:
        """The behaviors of each phase by priority; the first one rules where no other does."""
        return [self.behaviors, *(phase.behaviors for phase in self.phases)]

    @property
    def kinds(self) -> list[str]:
        """Names of all behaviors that may rule, in the order in which the mission names them."""
        return list(dict.fromkeys(behavior.behavior for behavior in self.all_behaviors))

    @property
    def all_behaviors(self) -> list[Any]:
        """The behaviors of all phases, one priority stack behind the other."""
        return [behavior for stack in self.stacks for behavior in stack]

    @property
    def acceleration(self) -> Array:
        """The most that its motors give each robot, shape (n,) [m/s^2]; inf without a force limit."""
        return np.asarray(math.sqrt(self.axes) * self.force_limit / self.mass)

    @property
    def avoidance(self) -> list[Any]:
        """What distances to bodies its behaviors keep, of those that keep some, see `Avoidance`."""
        found = [behavior.avoidance(self) for behavior in self.all_behaviors]
        return [avoidance for avoidance in found if avoidance is not None]

    @property
    def axes(self) -> int:
        """Dimension of the space, p."""
        return self.obstacle_position.shape[1]

    @property
    def nearest_within(self) -> float:
        """Gap to a shape from which on it makes no difference to anything by how much it is farther [m]."""
        seen = [behavior.looks_within for behavior in self.all_behaviors]
        conditions = [phase.when for phase in self.phases if phase.when is not None]
        bounds = [bound for when in conditions for bound in (when.threshold, when.release)]
        if self.outer.looks_far or self.radii:
            return math.inf
        return max([1.0, *seen, *self.expected_distances, *(bound for bound in bounds if bound is not None)])

    @property
    def seen_radius(self) -> Array:
        """Radii of obstacles as robots see them, shape (m,) [m]; 0 for returns of a lidar."""
        return self.obstacle_radius * (self.sensing.lidar is None)

    @property
    def obstacle_extent(self) -> Array:
        """Half the upright boxes around the centers of obstacles, 0 for spheres, shape (m, p) [m]."""
        return np.zeros_like(self.obstacle_position) if self.extents is None else self.extents

    @property
    def least_energies(self) -> list[float]:
        """Least energies of n robots and of what failures leave, from n down; empty where not looked for.

        Looked for where the points are solved anyway or in no time: for `vertices`, in the plane, and for the
        other behaviors that spread few robots.
        """
        few = self.count <= EASY and not {"chords", "repulsion"}.isdisjoint(self.kinds)
        if self.count > MOST_JUDGED or not (self.axes == 2 or few or self.figure is not None):
            return []
        fewer = self.count if self.teams else len(self.failures) + 1
        return [least_energy(self.count - lost, self.axes) for lost in range(fewer)]

    @property
    def spacing(self) -> Array:
        """Distances between neighbors in the formation [m], even where nobody says who stands where."""
        return self.edges[1] if self.figure is None else self.radius * self.figure.lengths

    @property
    def edges(self) -> tuple[NDArray[np.int64], Array]:
        """Neighbors in the formation, as robots from 0, shape (edges, 2), and the distances to keep [m].

        None where nobody says before the mission which robot stands where.
        """
        if self.arrangement is not None:
            pairs = self.arrangement.pairs
            return pairs, np.full(len(pairs), self.arrangement.length)
        if self.figure is not None and not self.auctioned:
            return self.figure.edges, self.radius * self.figure.lengths
        return np.zeros((0, 2), dtype=np.int64), np.zeros(0)
