"""Everything that the controller is given of a mission, before it is packed for the compiled kernel."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from escort_mj.behaviors import AvoidObstacles, Behavior, Vertices
from escort_mj.behaviors.avoid_obstacles import HEARD
from escort_mj.components.rays import Shape
from escort_mj.components.teams import EscortTeam
from escort_mj.control.failure import Failure
from escort_mj.control.outer_loops import Nsb, OuterLoop
from escort_mj.control.supervisor import ControlPhase
from escort_mj.control.trigger import Trigger
from escort_mj.estimators import Estimator, Hold
from escort_mj.knowledge.links import Radio
from escort_mj.knowledge.sight import Sight
from escort_mj.laws import Law
from escort_mj.numerics.formation import Arrangement
from escort_mj.numerics.reform import Reforming
from escort_mj.numerics.thomson import Figure, least_energy
from escort_mj.policies import Policy
from escort_mj.sensing.sensors import Sensors

Array = NDArray[np.float64]
B = TypeVar("B", bound=Behavior)

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
        policy: What it wants, where that is not its path; the path is then where it begins.
    """

    path: FunctionOfTime
    mass: float
    force_limit: float
    gain: float
    obstacle: int
    policy: Policy | None = None


class Opponent(NamedTuple):
    """A body that wants to reach the target.

    Attributes:
        obstacle: Which obstacle it is, from 0.
        start: When it comes [s].
        capture: Gap to a robot at which it is intercepted [m].
        reach: Gap to the target at which it has reached it [m].
    """

    obstacle: int
    start: float
    capture: float
    reach: float


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


@dataclass(frozen=True)
class Setup:
    """The controller's knowledge, and the disturbances and noise that the plant adds around it.

    Attributes:
        timestep: Physics and control step [s].
        seed: Key of the measurement noise.
        behaviors: By priority, the most important first, while no phase rules.
        law: The inner loop's law and gains; of the first team, where teams have different ones.
        laws: Those of each team, where they differ; empty where all robots have one.
        radius: Distance to keep from the target [m].
        target_feedforward: Whether the target's velocity is added to the escort behaviors.
        max_speed: Largest reference speed [m/s]; inf for none.
        arrangement: The formation that chords keeps; None without chords.
        obstacle_position: Centers, shape (m, p) [m].
        obstacle_radius: Shape (m,) [m]; 0 for those that are no spheres.
        robot_radius: Shape (n,) [m].
        force_limit: Largest force per axis, shape (n,) [N]; inf for none.
        target: Position and velocity of the target [m].
        disturbance: External force on every robot [N]; None for none.
        goals: By behavior `goal`, as `all_behaviors` has them, the waypoints of each robot, shape
            (waypoints, p) [m].
        formations: By behavior `formation`, likewise.
        radii: By behavior `surface` whose radius changes, likewise: its radius, one component.
        figure: The even figure that vertices keeps; None without vertices.
        failures: Robots whose motors fail.
        reforming: Figures of fewer robots; None without vertices, or where no robot fails.
        phases: When other behaviors than those above rule; of those that do, the last one.
        trigger: When robots run their outer loop; None for every step.
        outer: How behaviors become one velocity.
        sensing: What sensors make of the truth.
        movers: Obstacles that move, and a target that can be bumped.
        opponents: Those of the obstacles that want to reach the target; they come last.
        teams: Robots with targets of their own, which are obstacles; empty where all escort the target.
        shaped: Whether some obstacle is no sphere: robots then see the nearest points.
        expected_distances: Distances to obstacles that expectations put bounds on [m].
        shapes: Obstacles as lines meet them; empty where none has to, or all are spheres.
        outside: What is written from outside, between steps, instead of computed: the reference velocities of
            the outer loop, or the forces of both loops; None for nothing.
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
    behaviors: tuple[Behavior, ...]
    law: Law
    radius: float
    target_feedforward: bool
    max_speed: float
    arrangement: Arrangement | None
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
    failures: tuple[Failure, ...] = ()
    reforming: Reforming | None = None
    phases: tuple[ControlPhase, ...] = ()
    trigger: Trigger | None = None
    outer: OuterLoop = Nsb()
    sensing: Sensors = Sensors()
    movers: tuple[Mover, ...] = ()
    opponents: tuple[Opponent, ...] = ()
    teams: tuple[EscortTeam, ...] = ()
    shaped: bool = False
    shapes: tuple[Shape, ...] = ()
    expected_distances: tuple[float, ...] = ()
    outside: Literal["velocity", "force"] | None = None
    opponents_outside: bool = False
    driven: bool = False
    mass: Array | float = 1.0
    target_radius: float | None = None
    extents: Array | None = None
    sight: Sight | None = None
    radio: Radio | None = None
    estimator: Estimator = Hold()
    start_deviation: tuple[float, float, float] = (0.0, 0.0, 0.0)
    laws: tuple[Law, ...] = ()

    @property
    def informed(self) -> bool:
        """Whether each robot has an estimate of the target of its own."""
        return self.sight is not None

    @property
    def auctioned(self) -> bool:
        """Whether robots bid for their vertices."""
        return Vertices.auctioned(self.all_behaviors)

    @property
    def apart(self) -> bool:
        """Whether robots have targets and teammates each by itself: of its team, or as it knows."""
        return self.informed or bool(self.teams)

    @property
    def members(self) -> NDArray[np.int64]:
        """Team of each robot at the start, from 0, shape (n,); 0 where all are one."""
        found = np.zeros(self.count, dtype=np.int64)
        for number, team in enumerate(self.teams):
            found[[*team.robots]] = number
        return found

    @property
    def all_laws(self) -> tuple[Law, ...]:
        """The law of each team, or the one of all robots."""
        return self.laws or (self.law,)

    @property
    def has_lyapunov(self) -> bool:
        """Whether the proof's Lyapunov function V1 is that of the law, which all robots share."""
        return self.law.has_lyapunov and not self.laws

    def by_robot(self, name: str, members: NDArray[np.int64] | None = None) -> Array:
        """Return a parameter of the law of each robot, shape (n,).

        Args:
            name: Of the parameter.
            members: Team of each robot, from 0; None for the start.
        """
        values = np.array([float(getattr(law, name)) for law in self.all_laws])
        return values[(self.members if members is None else members) * bool(self.laws)]

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
            for number, phase in enumerate(self.all_phases)
            for behavior in phase.behaviors
            if isinstance(behavior, kind)
        ]

    @property
    def kinds(self) -> list[str]:
        """Names of all behaviors that may rule, in the order in which the mission names them."""
        stacks = [self.behaviors, *(phase.behaviors for phase in self.phases)]
        return list(dict.fromkeys(behavior.behavior for stack in stacks for behavior in stack))

    @property
    def all_phases(self) -> list[ControlPhase]:
        """All phases; the first one rules where none of the supervisor's does."""
        return [ControlPhase("", self.behaviors), *self.phases]

    @property
    def all_behaviors(self) -> list[Behavior]:
        """The behaviors of all phases, one priority stack behind the other."""
        return [behavior for phase in self.all_phases for behavior in phase.behaviors]

    @property
    def acceleration(self) -> Array:
        """The most that its motors give each robot, shape (n,) [m/s^2]; inf without a force limit."""
        return np.asarray(math.sqrt(self.axes) * self.force_limit / self.mass)

    @property
    def axes(self) -> int:
        """Dimension of the space, p."""
        return self.obstacle_position.shape[1]

    @property
    def nearest_within(self) -> float:
        """Gap to a shape from which on it makes no difference to anything by how much it is farther [m]."""
        stacks = [self.behaviors, *(phase.behaviors for phase in self.phases)]
        safe = [b.safe_distance for stack in stacks for b in stack if isinstance(b, AvoidObstacles)]
        conditions = [phase.when for phase in self.phases if phase.when is not None]
        bounds = [bound for when in conditions for bound in (when.threshold, when.release)]
        if self.outer.looks_far or self.radii:
            return math.inf
        return max([1.0, *safe, *self.expected_distances, *(bound for bound in bounds if bound is not None)])

    @property
    def seen_radius(self) -> Array:
        """Radii of obstacles as robots see them, shape (m,) [m]; 0 for returns of a lidar."""
        return self.obstacle_radius * (self.sensing.lidar is None)

    @property
    def obstacle_extent(self) -> Array:
        """Half the upright boxes around the centers of obstacles, 0 for spheres, shape (m, p) [m]."""
        return np.zeros_like(self.obstacle_position) if self.extents is None else self.extents

    def teammate_distance(self, avoid: AvoidObstacles) -> float:
        """Safe distance between teammates [m]; 0 where teammates do not count as obstacles."""
        if not avoid.teammates:
            return 0.0
        if avoid.teammate_distance is not None:
            return avoid.teammate_distance
        spacing = self.edges[1] if self.figure is None else self.radius * self.figure.lengths
        if not len(spacing):
            return avoid.safe_distance
        bodies = 2.0 * float(self.robot_radius.max()) if avoid.measure == "surface" else 0.0
        return min(avoid.safe_distance, max(0.5 * (float(spacing.min()) - bodies), 0.0))

    def hears(self, avoid: AvoidObstacles) -> bool:
        """Whether robots keep away from teammates that they hear, instead of those that they see."""
        return avoid.teammates == HEARD and self.radio is not None

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
