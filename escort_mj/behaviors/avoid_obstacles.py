"""Obstacle avoidance (paper eqs. 3, 23-24): leave the safe sphere of the obstacle that intrudes most."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, NonNegativeFloat, PositiveFloat

from escort_mj.behaviors.behavior import Behavior
from escort_mj.behaviors.task import Situation, Task, distance
from escort_mj.behaviors.wish import Wish, along
from escort_mj.components.obstacles import obstacle_places
from escort_mj.knowledge.teammates import find_nearest_heard
from escort_mj.native.kernels import inlined
from escort_mj.native.lanes import (
    WIDTH,
    Lanes,
    any_of,
    everywhere,
    greatest,
    lane_numbers,
    load,
    load_rows,
    root,
    row_of,
    set_row,
    stack_rows,
    there,
    where,
)
from escort_mj.numerics.neighbors import candidate, number_of_candidates, seen_neighbors

if TYPE_CHECKING:
    from escort_mj.control.setup import Setup
    from escort_mj.knowledge.teammates import Heard
    from escort_mj.memory.layout import Plan, State

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

HEARD: Literal["heard"] = "heard"
PRINTED = 1  # place of that gain among the choices
POLAR = 0.9  # a unit vector with more than this along the last axis hardly turns in the others


class AvoidObstacles(Behavior):
    """Keep each robot outside the safe spheres around obstacles and teammates."""

    frame: ClassVar[Literal["target", "world"]] = "world"
    avoids: ClassVar[bool] = True

    behavior: Literal["avoid_obstacles"] = "avoid_obstacles"
    safe_distance: PositiveFloat = 2.0
    """Distance to an obstacle or a failed robot below which the behavior is active [m]."""
    measure: Literal["center", "surface"] = "surface"
    """Measure of distances: `surface` to surface, or `center` to center (as for the paper's point robots)."""
    teammates: Literal[True, False, "heard"] = True
    """Whether a teammate that comes too close counts as an obstacle (remark 2): `true`, if the robot sees it;
    `heard`, at every place where it could be by now, according to its messages; `false`, never."""
    teammate_distance: PositiveFloat | None = None
    """Safe distance to teammates [m]; null: `safe_distance`, but at most half the spacing of the formation.
    """
    gain: Literal["consistent", "printed"] = "consistent"
    """State-dependent gain: as eq. 23 of the paper requires (`consistent`), or with the coefficient that the
    paper prints (`printed`)."""
    gain_margin: NonNegativeFloat = 0.1
    """Constant added to the state-dependent gain [1/s] (paper: rho_i)."""
    sidestep: Annotated[float, Field(ge=0.0, le=10.0)] = 0.1
    """Minimum tangential velocity around an obstacle, as a share of the velocity that the obstacle blocks, so
    that robots do not stop in front of it (remark 6); 0: no minimum, so that only noise ends such a stop (the
    paper)."""

    python_only: ClassVar[frozenset[str]] = frozenset({"behavior", "teammates"})

    @staticmethod
    def margin(behaviors: Iterable[Behavior], radius: float) -> float:
        """Return how far a robot's center keeps from obstacles [m].

        Args:
            behaviors: Of the mission.
            radius: The robot's [m].
        """
        avoids = [each for each in behaviors if isinstance(each, AvoidObstacles)]
        return max((a.safe_distance + radius * (a.measure == "surface") for a in avoids), default=radius)

    @classmethod
    def numbers(cls) -> dict[str, type]:
        """Return its parameters as kernels see them; a null `teammate_distance` is the mission's own."""
        return {
            "safe_distance": float, "measure": int, "teammate_distance": float, "heard_distance": float,
            "gain": int, "gain_margin": float, "sidestep": float,
        }  # fmt: skip

    def packed(self, setup: Setup | None = None) -> dict[str, float]:
        """Return its parameters as numbers, 0 for the distance to teammates that do not count."""
        assert setup is not None
        distance, hears = setup.teammate_distance(self), setup.hears(self)
        return {
            "safe_distance": self.safe_distance, "measure": float(self.measure == "surface"),
            "teammate_distance": distance * (not hears), "heard_distance": distance * hears,
            "gain": float(self.gain == "printed"), "gain_margin": self.gain_margin, "sidestep": self.sidestep,
        }  # fmt: skip

    def team_tasks(self, now: Situation) -> tuple[Task, ...]:
        """Return eq. 3 with the gain of eqs. 23, 24: sigma = |q - o| is to grow to the safe distance."""
        depth, intruder = self._worst(now)
        active = self.active(now)
        jacobian = np.where(active[:, None], distance(now.q, intruder).jacobian, 0.0)
        speed, error = np.linalg.norm(now.v, axis=1), np.linalg.norm(now.e, axis=1)
        rate = np.zeros(len(now.q))
        slope = now.setup.by_robot("slope", now.members)[active]
        gain = self.escape_gain(depth[active], speed[active], error[active], slope)
        rate[active] = gain * depth[active]
        return (Task(jacobian, rate),)

    def active(self, now: Situation) -> Mask:
        """Return whose safe sphere something is in."""
        return (self._worst(now)[0] > 0.0) & ~now.team.lost

    def error(self, now: Situation) -> Array:
        """Return how deep the worst intruder is in each safe sphere."""
        return self._worst(now)[0]

    def _worst(self, now: Situation) -> tuple[Array, Array]:
        lost, heard = now.team.lost, now.heard
        return now.once((id(self), "worst"), lambda: self.intrusion(now.q, now.setup, lost, heard))

    def teammates_of(
        self, q: Array, setup: Setup, lost: Mask | bool, heard: Heard | None
    ) -> tuple[Array, Array, Array]:
        """Return where each robot takes its teammates to be.

        Args:
            q: Measured positions, shape (n, p) [m].
            setup: Gives distances.
            lost: Robots that are obstacles, shape (n,).
            heard: What robots have heard of teammates.

        Returns:
            Places, shape (n, n, p), how far from there teammates may be, and the least distances to keep,
            0 for those that are not avoided, shape (n, n) [m].
        """
        n, p = q.shape
        places, balls = np.broadcast_to(q, (n, n, p)), np.zeros((n, n))
        safe = np.full((n, n), setup.teammate_distance(self))
        safe[:, lost] = max(self.safe_distance, setup.teammate_distance(self))
        if heard is not None and setup.hears(self):
            places, balls = heard.place, heard.ball
            safe = np.where(heard.known, setup.teammate_distance(self), self.safe_distance * lost)
        np.fill_diagonal(safe, 0.0)
        return places, balls, safe

    def intrusion(
        self, q: Array, setup: Setup, lost: Mask | bool = False, heard: Heard | None = None
    ) -> tuple[Array, Array]:
        """Return how deep the worst intruder is in each safe sphere, and where it is (eq. 3, remark 2).

        Args:
            q: Measured positions, shape (n, p) [m].
            setup: Gives obstacles, radii and distances.
            lost: Robots that are obstacles, shape (n,).
            heard: What robots have heard of teammates.

        Returns:
            sigma~, not positive where nothing intrudes, shape (n,) [m], and positions, shape (n, p) [m].
        """
        teammates, balls, safe = self.teammates_of(q, setup, lost, heard)
        centers = np.concatenate([setup.obstacles_seen()[:-1], teammates], axis=1)  # by each robot
        gaps = np.linalg.norm(q[:, None] - centers, axis=2)
        if self.measure == "surface":
            radii = np.concatenate([setup.seen_radius, setup.robot_radius])
            gaps -= setup.robot_radius[:, None] + radii
        obstacles, robots = len(setup.obstacle_position), np.arange(len(q))
        reach = np.where(safe > 0.0, safe + balls, -np.inf)
        depth = np.hstack([np.full((len(q), obstacles), self.safe_distance), reach]) - gaps
        worst = np.argmax(depth, axis=1)
        return depth[robots, worst], centers[robots, worst]

    def escape_gain(self, depth: Array, speed: Array, error: Array, slope: Array | float) -> Array:
        """Return the gain lambda = lambda* + rho by the quadratic of eq. 24, shape (k,) [1/s].

        Args:
            depth: sigma~, positive, shape (k,) [m].
            speed: |v|, shape (k,) [m/s].
            error: |e|, shape (k,) [m].
            slope: gamma of the sliding surface, one or shape (k,) [1/s].
        """
        g, printed = slope * error, self.gain == "printed"
        a, b = depth**2, 2.0 * depth * (speed - (2.0 * g if printed else g))
        # b^2 + 4ac with c = g^2 + 2g|v| - |v|^2, multiplied out: where g << |v| it cancels to rounding noise.
        discriminant = 4.0 * a * (5.0 * g**2 - 2.0 * g * speed if printed else 2.0 * g**2)
        return (b + np.sqrt(np.maximum(discriminant, 0.0))) / (2.0 * a) + self.gain_margin

    def beside(self, now: Situation, below: Array) -> Array:
        """Return the sidestep: what goes along the safe sphere against head-on approaches (remark 6).

        Args:
            now: The situation.
            below: What the behaviors below want within the speed limit, shape (n, p) [m/s].
        """
        q, (depth, intruder) = now.q, self._worst(now)
        robots, axes = np.arange(len(q)), q.shape[1]
        r = distance(q, intruder).jacobian.reshape(len(q), *q.shape)[robots, robots]
        outward = np.sum(r * below, axis=1)
        left = np.linalg.norm(below - outward[:, None] * r, axis=1)
        speed = np.where(depth > 0.0, np.maximum(-self.sidestep * outward - left, 0.0), 0.0)
        pairs = np.kron(np.eye(axes // 2), np.array([[0.0, -1.0], [1.0, 0.0]]))
        odd = axes % 2
        equatorial = np.pad(pairs, (0, odd))  # turns all axes but, where they are odd, the last one
        polar = np.pad(pairs, (odd, 0))
        turned_r = np.where(np.abs(r[:, -1:]) > POLAR, r @ polar.T, r @ equatorial.T)
        return np.asarray(speed[:, None] * turned_r)

    def wish_lanes(self, i: int, plan: Plan, state: State, x: Array, wish: Array, at: int) -> Wish:
        """The same for robots i to i + 7, compiled, but for the sidestep: see `sidestep`."""
        p = state.q.shape[1]
        depth, distance = _worst_intruder(i, self, plan, state, x)
        nothing = everywhere(0.0)
        if not any_of(depth > 0.0):
            for k in range(p):
                set_row(wish, at + k, nothing)
            return along(nothing, nothing, nothing)
        velocity, offset, square, error = stack_rows(p), stack_rows(p), everywhere(0.0), everywhere(0.0)
        load_rows(state.v_measured, i, velocity)
        load_rows(state.e, i, offset)
        for k in range(p):
            aside = everywhere(1.0 if k == 0 else 0.0)  # no direction leads away from one's own place
            set_row(x, k, where(distance > 0.0, row_of(x, k) / distance, aside))
            square = square + row_of(velocity, k) * row_of(velocity, k)
            error = error + row_of(offset, k) * row_of(offset, k)
        speed, error = root(square), load(state.slopes, i) * root(error)
        if int(self.gain) == PRINTED:
            # (b + sqrt(b^2 + 4ac)) / 2a with the printed b, multiplied out so that nothing cancels
            pull = speed - 2.0 * error + root(greatest(error * (5.0 * error - 2.0 * speed), 0.0))
        else:
            pull = speed + (math.sqrt(2.0) - 1.0) * error
        active = where(depth > 0.0, 1.0, nothing)
        for k in range(p):
            set_row(wish, at + k, where(depth > 0.0, (pull + self.gain_margin * depth) * row_of(x, k), 0.0))
        return along(active, active, depth)


@inlined
def _worst_intruder(i: int, avoid: Any, plan: Plan, state: State, x: Array) -> tuple[Lanes, Lanes]:
    """Looks for what is deepest in the safe spheres of robots i to i + 7; writes x = q - where it is.

    Returns:
        How deep it is, 0 where nothing intrudes [m], and the length of x [m].
    """
    n, p = state.q.shape
    q, radius, to_surface = state.q_measured, plan.robot_radius, float(avoid.measure)
    own, worst, distance = load(radius, i), everywhere(0.0), everywhere(0.0)
    here = stack_rows(p)
    load_rows(q, i, here)
    for k in range(p):
        set_row(x, k, everywhere(0.0))
    for j in range(plan.obstacle_radius.shape[0]):
        square = everywhere(0.0)
        for k in range(p):
            way = row_of(here, k) - obstacle_places(i, j, k, plan, state)
            square = square + way * way
        reach = avoid.safe_distance + to_surface * (own + plan.seen_radius[j])
        near = (square < reach * reach) & there(n - i)
        if any_of(near):
            length = root(square)
            worse = near & (reach - length > worst)
            worst, distance = where(worse, reach - length, worst), where(worse, length, distance)
            for k in range(p):
                way = row_of(here, k) - obstacle_places(i, j, k, plan, state)
                set_row(x, k, where(worse, way, row_of(x, k)))
    if avoid.heard_distance > 0.0:
        find_nearest_heard(i, avoid.heard_distance, to_surface, plan, state)
        away, deep = stack_rows(p), -load(state.heard_margin, i)
        load_rows(state.wished_direction, i, away)
        worse = (deep > worst) & there(n - i)
        worst, distance = where(worse, deep, worst), where(worse, 1.0, distance)
        for k in range(p):
            set_row(x, k, where(worse, row_of(away, k), row_of(x, k)))
    lists = seen_neighbors(state)
    looking = avoid.teammate_distance > 0.0
    if looking and lists.shape[0] > 0:
        looking = someone_within(avoid.teammate_distance, i, avoid, q, radius, lists)
    failing = plan.failure_start.shape[0] > 0
    if not looking and not failing:
        return worst, distance
    for j in range(n):
        safe = avoid.teammate_distance
        if failing and state.lost[j] != 0.0:  # an obstacle (remark 2)
            safe = max(safe, avoid.safe_distance)
        if safe <= 0.0:
            continue
        square = everywhere(0.0)
        for k in range(p):
            way = row_of(here, k) - q[j, k]
            square = square + way * way
        reach = safe + to_surface * (own + radius[j])
        near = (square < reach * reach) & (lane_numbers() + float(i) != float(j)) & there(n - i)
        if any_of(near):
            length = root(square)
            worse = near & (reach - length > worst)
            worst, distance = where(worse, reach - length, worst), where(worse, length, distance)
            for k in range(p):
                set_row(x, k, where(worse, row_of(here, k) - q[j, k], row_of(x, k)))
    return worst, distance


@inlined
def someone_within(distance: float, i: int, avoid: Any, q: Array, radius: Array, lists: Array) -> bool:
    """Whether one of robots i to i + 7 has a teammate within a distance [m]."""
    for robot in range(i, min(i + WIDTH, q.shape[0])):
        if mate_within(distance, robot, avoid, q, radius, lists):
            return True
    return False


@inlined
def mate_within(distance: float, robot: int, avoid: Any, q: Array, radius: Array, lists: Array) -> bool:
    """Whether a robot has a teammate within a distance [m]."""
    n, p = q.shape
    for c in range(number_of_candidates(robot, n, lists)):
        j = candidate(robot, c, lists)
        square = 0.0
        for k in range(p):
            way = q[robot, k] - q[j, k]
            square += way * way
        reach = distance + float(avoid.measure) * (radius[robot] + radius[j])
        if square < reach * reach and j != robot:
            return True
    return False


@inlined
def sidestep(level: int, share: float, active: Lanes, direction: Array, wanted: Array, parts: Array) -> None:
    """Adds to avoidance a part along the safe sphere, where the wishes below it are blocked head-on.

    What they leave along the sphere, w, is filled up to a share of what avoidance blocks of them. All robots
    turn the same way around whatever they meet (counterclockwise in the plane), so that two that meet head-on
    pass each other. Along `direction` nothing changes: J1 v_d stays lambda sigma~.

    Args:
        level: Which part is that of avoidance.
        share: Share of the blocked speed.
        active: 1 for robots that avoid, else 0.
        direction: Unit vector r away from the intruder, in rows for axes.
        wanted: Velocity that robots would have without avoidance, within the speed limit [m/s]. Wishes
            beyond it would turn a robot another way than it goes outside of the sphere, and hold it there.
        parts: Parts by level, p rows each [m/s]; that of avoidance is changed.
    """
    p = wanted.shape[0]
    outward, square = everywhere(0.0), everywhere(0.0)
    for k in range(p):
        along = row_of(wanted, k)
        outward = outward + along * row_of(direction, k)
        square = square + along * along
    speed = -share * outward - root(greatest(square - outward * outward, 0.0))
    speed = where(speed > 0.0, speed, 0.0) * active
    if p % 2 == 0:
        _turn(p, level, 0, speed, direction, parts)
        return
    # Axes are turned in pairs; where p is odd one axis has no partner: not the one that r points along.
    polar = abs(row_of(direction, p - 1)) > POLAR
    _turn(p, level, 0, where(polar, 0.0, speed), direction, parts)
    _turn(p, level, 1, where(polar, speed, 0.0), direction, parts)


@inlined
def _turn(p: int, level: int, first: int, speed: Lanes, direction: Array, parts: Array) -> None:
    """Adds a velocity across a direction, in pairs of axes."""
    for k in range(first, first + p - p % 2, 2):
        set_row(parts, level * p + k, row_of(parts, level * p + k) - speed * row_of(direction, k + 1))
        set_row(parts, level * p + k + 1, row_of(parts, level * p + k + 1) + speed * row_of(direction, k))
