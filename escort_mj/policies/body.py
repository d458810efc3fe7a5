"""What policies see: a body with a will of its own, and all around it."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

from escort_mj.native.fields import Array
from escort_mj.native.kernels import inlined
from escort_mj.native.memory import part_of
from escort_mj.native.values import Computed, maker_of
from escort_mj.native.vectors import Vec, dot, numbers_at, numbers_from, of_numbers
from escort_mj.numerics.gaussian import POLICY, fractions


class PolicyView(NamedTuple):
    """What policies see of the mission, all of it true and at once; n robots, p axes, m obstacles."""

    timestep: float  # [s]
    seed: int  # of the mission's random streams
    radius: float  # of the mission [m]
    time: Annotated[Array, 1]  # [s]
    q: Annotated[Array, "n", "p"]  # position of the robots [m]
    v: Annotated[Array, "n", "p"]  # their velocity [m/s]
    robot_radius: Annotated[Array, "n"]  # [m]
    target_position: Annotated[Array, "p"]  # [m]
    target_velocity: Annotated[Array, "p"]  # [m/s]
    obstacle_position: Annotated[Array, "m", "p"]  # centers [m]
    obstacle_velocity: Annotated[Array, "m", "p"]  # [m/s]
    obstacle_radius: Annotated[Array, "m"]  # 0 for those that are not spheres [m]
    networks: Annotated[Array, "networks"]  # of learned policies
    mover_position: Annotated[Array, "movers", "p"]  # of the bodies with a drive, its own among them [m]
    mover_velocity: Annotated[Array, "movers", "p"]  # [m/s]
    mover_start: Annotated[Array, "movers", "p"]  # where they begin [m]
    mover_first: Annotated[Array, "movers"]  # where the numbers begin that their policies keep
    policy_memory: Annotated[Array, "policy_values"]  # these, at first 0
    policy_memory_next: Annotated[Array, "policy_values"]  # written: what becomes of them
    mover_wish: Annotated[Array, "movers", "p"]  # written: the velocity that it wants [m/s]


class Body(Computed):
    """A body with a policy, and what it sees, all of it true and at once; SI units, world frame.

    What the policy keeps of its own, it has by name.
    """

    b: int
    seen: PolicyView

    @property
    def q(self) -> Vec:
        """Its position [m]."""
        return numbers_at(self.seen, self.seen.mover_position, self.b)

    @property
    def v(self) -> Vec:
        """Its velocity [m/s]."""
        return numbers_at(self.seen, self.seen.mover_velocity, self.b)

    @property
    def start(self) -> Vec:
        """Where it began [m]."""
        return numbers_at(self.seen, self.seen.mover_start, self.b)

    @property
    def target(self) -> Vec:
        """Position of the target; with teams, of the one nearest to the body [m]."""
        return numbers_at(self.seen, self.seen.target_position, 0)

    @property
    def target_velocity(self) -> Vec:
        """Velocity of that target [m/s]."""
        return numbers_at(self.seen, self.seen.target_velocity, 0)

    @property
    def radius(self) -> float:
        """Radius of the mission [m]."""
        return self.seen.radius

    @property
    def time(self) -> float:
        """Time of the mission [s]."""
        return self.seen.time[0]

    @property
    def timestep(self) -> float:
        """Physics step [s]."""
        return self.seen.timestep

    @property
    def robots(self) -> int:
        """How many robots there are."""
        return self.seen.q.shape[0]

    def robot(self, k: int) -> Vec:
        """Return the position of a robot, by its number from 0 [m]."""
        return numbers_at(self.seen, self.seen.q, k)

    def robot_velocity(self, k: int) -> Vec:
        """Return its velocity [m/s]."""
        return numbers_at(self.seen, self.seen.v, k)

    def robot_radius(self, k: int) -> float:
        """Return its radius [m]."""
        return self.seen.robot_radius[k]

    @property
    def nearest(self) -> int:
        """Number of the robot whose center is nearest, from 0."""
        found, least = 0, dot(self.q - self.robot(0), self.q - self.robot(0))
        for k in range(1, self.robots):
            square = dot(self.q - self.robot(k), self.q - self.robot(k))
            if square < least:
                found, least = k, square
        return found

    @property
    def obstacles(self) -> int:
        """How many obstacles there are, opponents and other bodies with a drive among them."""
        return self.seen.obstacle_radius.shape[0]

    def obstacle(self, j: int) -> Vec:
        """Return the center of an obstacle, by its number from 0 [m]."""
        return numbers_at(self.seen, self.seen.obstacle_position, j)

    def obstacle_velocity(self, j: int) -> Vec:
        """Return its velocity [m/s]."""
        return numbers_at(self.seen, self.seen.obstacle_velocity, j)

    def obstacle_radius(self, j: int) -> float:
        """Return its radius; 0 where it is no sphere [m]."""
        return self.seen.obstacle_radius[j]

    def random(self, k: int) -> Vec:
        """Return random numbers, one for each axis, uniform in [-1, 1): the same ones whenever k is."""
        x, y, z, _ = fractions(self.seen.seed, 1, POLICY, self.b, k)
        return of_numbers(self.q, 2.0 * x - 1.0, 2.0 * y - 1.0, 2.0 * z - 1.0)


body_at = maker_of(Body)


@inlined
def place_of(seen: PolicyView, b: int, numbers: int, vectors: int) -> int:
    """Return where something lies that the policy of a body keeps, behind so many numbers and vectors."""
    return int(seen.mover_first[b]) + numbers + vectors * seen.q.shape[1]


def kept(is_vector: bool, numbers: int, vectors: int) -> property:
    """Return a property that reads what a policy keeps behind so many numbers and vectors."""

    def number(body: Any) -> float:
        return body.seen.policy_memory[place_of(body.seen, body.b, numbers, vectors)]

    def vector(body: Any) -> Vec:
        return numbers_from(body.seen, body.seen.policy_memory, place_of(body.seen, body.b, numbers, vectors))

    return property(vector if is_vector else number)


policy_view = part_of(PolicyView)
