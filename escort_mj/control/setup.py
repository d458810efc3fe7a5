"""Everything that the controller is told about a mission, before it is packed for the compiled kernel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from escort_mj.control.behaviors import AvoidObstacles, BehaviorParameters
from escort_mj.control.failure import Failure
from escort_mj.control.formation import Arrangement
from escort_mj.control.laws import LawParameters
from escort_mj.control.outer_loops import Nsb, OuterLoop
from escort_mj.control.reform import Reforming
from escort_mj.control.sensing import Sensors
from escort_mj.control.supervisor import Phase
from escort_mj.control.thomson import Figure, least_energy
from escort_mj.control.trigger import Trigger

Array = NDArray[np.float64]

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
        """Instructions (ops, 3), first row and count per axis (p, 2), pieces (rows, 5)."""
        ...


@dataclass(frozen=True)
class Setup:
    """The controller's knowledge, and the disturbances and noise that the plant adds around it.

    Attributes:
        timestep: Physics and control step [s].
        seed: Key of the measurement noise.
        behaviors: By priority, the most important first, while no phase rules.
        law: The inner loop's law and gains.
        radius: Distance to keep from the target [m].
        target_feedforward: Whether the target's velocity is added to the escort behaviors.
        max_speed: Largest reference speed [m/s]; inf for none.
        arrangement: The formation that chords keeps; None without chords.
        obstacle_position: Centers, shape (m, p) [m].
        obstacle_radius: Shape (m,) [m].
        robot_radius: Shape (n,) [m].
        force_limit: Largest force per axis, shape (n,) [N]; inf for none.
        target: Position and velocity of the target [m].
        disturbance: External force on every robot [N]; None for none.
        figure: The even figure that vertices keeps; None without vertices.
        failures: Robots whose motors fail.
        reforming: Figures of fewer robots; None without vertices, or where no robot fails.
        phases: When other behaviors than those above rule; of those that do, the last one.
        trigger: When robots run their outer loop; None for every step.
        outer: How behaviors become one velocity.
        sensing: What sensors make of the truth.
    """

    timestep: float
    seed: int
    behaviors: tuple[BehaviorParameters, ...]
    law: LawParameters
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
    figure: Figure | None = None
    failures: tuple[Failure, ...] = ()
    reforming: Reforming | None = None
    phases: tuple[Phase, ...] = ()
    trigger: Trigger | None = None
    outer: OuterLoop = Nsb()
    sensing: Sensors = Sensors()

    @property
    def count(self) -> int:
        """Number of robots, n."""
        return len(self.robot_radius)

    @property
    def kinds(self) -> list[str]:
        """Names of all behaviors that may rule, in the order in which the mission names them."""
        ladders = [self.behaviors, *(phase.behaviors for phase in self.phases)]
        return list(dict.fromkeys(behavior.behavior for ladder in ladders for behavior in ladder))

    @property
    def axes(self) -> int:
        """Dimension of the space, p."""
        return self.obstacle_position.shape[1]

    def teammate_distance(self, avoid: AvoidObstacles) -> float:
        """Safe distance between teammates [m]; 0 where teammates do not count as obstacles."""
        if not avoid.teammates:
            return 0.0
        if avoid.teammate_distance is not None:
            return avoid.teammate_distance
        spacing = self.edges[1]
        if not len(spacing):
            return avoid.safe_distance
        bodies = 2.0 * float(self.robot_radius.max()) if avoid.measure == "surface" else 0.0
        return min(avoid.safe_distance, max(0.5 * (float(spacing.min()) - bodies), 0.0))

    @property
    def least_energies(self) -> list[float]:
        """Least energies of n robots and of what failures leave, from n down; empty where not looked for.

        Looked for where the points are solved anyway or in no time: for `vertices`, in the plane, and for the
        other behaviors that spread few robots.
        """
        few = self.count <= EASY and not {"chords", "repulsion"}.isdisjoint(self.kinds)
        if self.count > MOST_JUDGED or not (self.axes == 2 or few or self.figure is not None):
            return []
        return [least_energy(self.count - lost, self.axes) for lost in range(len(self.failures) + 1)]

    @property
    def edges(self) -> tuple[NDArray[np.int64], Array]:
        """Neighbors in the formation, as robots from 0, shape (edges, 2), and the distances to keep [m]."""
        if self.arrangement is not None:
            pairs = self.arrangement.pairs
            return pairs, np.full(len(pairs), self.arrangement.length)
        if self.figure is not None:
            return self.figure.edges, self.radius * self.figure.lengths
        return np.zeros((0, 2), dtype=np.int64), np.zeros(0)
