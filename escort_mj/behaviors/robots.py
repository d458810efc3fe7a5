"""What behaviors see: eight robots at a moment, each value with a lane for every robot."""

from __future__ import annotations

from typing import Any

from escort_mj.components.obstacles import obstacle_places, obstacles_seen
from escort_mj.components.parameters import UNLIMITED
from escort_mj.components.teams import radius_rows
from escort_mj.knowledge.belief import target_of, target_velocity_of
from escort_mj.knowledge.teammates import Mate, mate_of, places_of
from escort_mj.native.kernels import inlined
from escort_mj.native.lanes import (
    Lanes,
    everywhere,
    gather,
    greatest,
    lane_numbers,
    least,
    load,
    row_of,
    set_row,
    stack_rows,
    there,
    where,
)
from escort_mj.native.values import Computed, maker_of
from escort_mj.native.vectors import Vec, norm, one_row, part_at, rows_at, rows_from, set_part
from escort_mj.plan import Plan, State


class Robots(Computed):
    """Robots i to i + 7, and what they know; SI units, world frame.

    Positions and velocities are vectors (`Vec`), all else is lanes or, where it is the same for all robots, a
    number. Lanes past the last robot are computed and read by nobody.
    """

    i: int
    plan: Plan
    state: State

    @property
    def there(self) -> Any:
        """Which lanes stand for a robot."""
        return there(self.state.q.shape[0] - self.i)

    @property
    def q(self) -> Vec:
        """Measured position [m]."""
        return rows_at(self.state, self.state.q_measured, self.i)

    @property
    def v(self) -> Vec:
        """Measured velocity [m/s]."""
        return rows_at(self.state, self.state.v_measured, self.i)

    @property
    def e(self) -> Vec:
        """Error of the position, q_d - q [m]."""
        return rows_at(self.state, self.state.e, self.i)

    @property
    def slope(self) -> Lanes:
        """Slope of s = e_dot + slope * e of the robot's law [1/s]."""
        return load(self.state.slopes, self.i)

    @property
    def target(self) -> Vec:
        """Where each robot believes its target to be [m]."""
        return target_of(self.i, self.plan, self.state)

    @property
    def target_velocity(self) -> Vec:
        """How fast each robot believes its target to move [m/s]."""
        return target_velocity_of(self.i, self.plan, self.state)

    @property
    def radius(self) -> Lanes:
        """Distance that each robot is to keep from its target, of the mission or of its team [m]."""
        return radius_rows(self.i, self.plan, self.state)

    @property
    def robot_radius(self) -> Lanes:
        """Radius of each robot [m]."""
        return load(self.plan.robot_radius, self.i)

    @property
    def time(self) -> float:
        """Time of the mission [s]."""
        return self.state.time[0]

    @property
    def timestep(self) -> float:
        """Physics and control step [s]."""
        return self.plan.timestep

    @property
    def max_speed(self) -> float:
        """Largest reference speed; 1e300 for no limit [m/s]."""
        return self.plan.max_speed

    def vector(self, numbers: Any) -> Vec:
        """Return a parameter that is a vector, the same for all robots."""
        return one_row(self.state, numbers)

    def at(self, matrix: Any, first: int) -> Vec:
        """Return a vector for each robot, of a matrix whose rows from the first one on are the robots'."""
        return rows_at(self.state, matrix, first + self.i)

    def position_of(self, others: Any) -> Vec:
        """Return the measured position of another robot for each robot, by its number [m]."""
        known = least(greatest(load(others, self.i), 0.0), float(self.state.q.shape[0] - 1))
        return rows_from(self.state, self.state.q_measured, known)

    @property
    def obstacles(self) -> int:
        """How many obstacles there are."""
        return self.plan.obstacle_radius.shape[0]

    def obstacle_radius(self, j: int) -> float:
        """Return the radius of an obstacle; 0 where it is no sphere [m]."""
        return self.plan.seen_radius[j]

    def obstacle(self, j: int) -> Vec:
        """Return where each robot finds an obstacle: its center, or of no sphere its nearest point [m]."""
        return obstacle_places(self.i, j, self.plan, self.state)

    def obstacle_gap(self, j: int) -> Lanes:
        """Return the distance to an obstacle, surface to surface; 1e300 out of the sensors' range [m]."""
        gap = norm(self.q - self.obstacle(j)) - self.robot_radius - self.plan.seen_radius[j]
        return where(gap > self.plan.sensing_obstacles, UNLIMITED, gap)

    def target_gap(self, j: int) -> Lanes:
        """Return how far the target's center is from an obstacle's surface; 1e300 for one not seen [m]."""
        place = obstacles_seen(self.state.q.shape[0], self.plan, self.state)[j]
        gap = norm(self.target - one_row(self.state, place)) - self.plan.obstacle_radius[j]
        return where(self.obstacle_gap(j) < UNLIMITED, gap, UNLIMITED)

    @property
    def goal(self) -> Vec:
        """Where `goal` or `formation` sends each robot; where it is, without such a behavior [m]."""
        return self.at(self.state.goal, 0) if self.state.goal.shape[0] > 0 else self.q

    @property
    def goal_velocity(self) -> Vec:
        """How fast that place moves [m/s]."""
        return self.at(self.state.goal_velocity, 0) if self.state.goal.shape[0] > 0 else 0.0 * self.q

    @property
    def vertex(self) -> Vec:
        """Unit vector of each robot's vertex of the even figure as it is turned, see `uses_vertices`."""
        if self.state.vertices.shape[0] == 0:
            return 0.0 * self.q
        return _vertices_at(self.i, self.plan, self.state)

    @property
    def chord_length(self) -> float:
        """Edge of the formation of `chords` [m]."""
        return self.state.chord_length[0]

    @property
    def cycles(self) -> int:
        """How many robots come before each along that formation: 1 on a ring, 2 on an octahedron."""
        return self.state.predecessors.shape[0]

    def predecessor(self, cycle: int) -> Vec:
        """Return where the robot before each is, along cycle 0 or 1 of that formation [m]."""
        return self.position_of(self.state.predecessors[cycle])

    @property
    def guards(self) -> Any:
        """Which robots have been assigned an opponent."""
        if self.state.threat.shape[0] == 0:
            return everywhere(0.0) > 0.5
        return self.there & (load(self.state.threat, self.i) > 0.5)

    @property
    def threat(self) -> Vec:
        """Where the opponent of each robot that guards is [m]."""
        return self.at(self.state.threat_position, 0) if self.state.threat.shape[0] > 0 else self.q

    @property
    def threat_velocity(self) -> Vec:
        """Its velocity [m/s]."""
        return self.at(self.state.threat_velocity, 0) if self.state.threat.shape[0] > 0 else 0.0 * self.q

    @property
    def robots(self) -> int:
        """How many robots there are."""
        return self.state.q.shape[0]

    @property
    def lost(self) -> float:
        """How many of them have failed, as the team knows."""
        count = 0.0
        for j in range(self.state.lost.shape[0]):
            count += self.state.lost[j]
        return count

    def robot_gap(self, j: int) -> Lanes:
        """Return the distance to a robot, surface to surface; 1e300 out of range, and to itself [m]."""
        way = norm(self.q - one_row(self.state, self.state.q_measured[j]))
        gap = way - self.robot_radius - self.plan.robot_radius[j]
        other = abs(lane_numbers() + float(self.i - j)) > 0.5
        return where(other & (gap <= self.plan.sensing_robots), gap, UNLIMITED)

    @property
    def places(self) -> int:
        """How many teammates a robot can know of, see `mate`."""
        return places_of(self.state)

    def mate(self, place: int) -> Mate:
        """Return a teammate of each robot, at a place from 0 to `places` - 1 of what the robot knows.

        With a radio, these are teammates that it has heard within the timeout, where they are by now if they
        have kept their velocity; without one, all left of its team, as the sensors show them.
        """
        return mate_of(self.i, place, self.plan, self.state)


@inlined
def _vertices_at(i: int, plan: Plan, state: State) -> Vec:
    """Return the vertices R u_i in the figure as it is turned: the team's, or each robot's own."""
    p, own = state.q.shape[1], rows_at(state, state.vertices, i)
    rows, found = stack_rows(p), stack_rows(p)
    set_part(rows, 0, own)
    for k in range(p):
        vertex = everywhere(0.0)
        for c in range(p):
            turn = everywhere(state.rotation[0, k, c])
            if plan.apart:
                turn = gather(state.rotation, (i * p + k) * p + c, p * p)
            vertex = vertex + turn * row_of(rows, c)
        set_row(found, k, vertex)
    return part_at(state, found, 0)


robots_at = maker_of(Robots)
