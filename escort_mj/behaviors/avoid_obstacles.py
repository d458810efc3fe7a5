"""Obstacle avoidance (paper eqs. 3, 23-24): leave the safe sphere of the obstacle that intrudes most."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, NonNegativeFloat, PositiveFloat

from escort_mj.behaviors.behavior import Behavior
from escort_mj.behaviors.wish import Wish, along
from escort_mj.components.obstacles import obstacle_places
from escort_mj.components.setup import MissionSetup
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
from escort_mj.plan import Plan, State

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

    @property
    def looks_within(self) -> float:
        """Distance from which on it makes no difference to it by how much an obstacle is farther [m]."""
        return self.safe_distance

    def distance_of_teammates(self, setup: MissionSetup) -> float:
        """Return the safe distance between teammates [m]; 0 where teammates do not count as obstacles."""
        if not self.teammates:
            return 0.0
        if self.teammate_distance is not None:
            return self.teammate_distance
        if not len(setup.spacing):
            return self.safe_distance
        bodies = 2.0 * float(setup.robot_radius.max()) if self.measure == "surface" else 0.0
        return min(self.safe_distance, max(0.5 * (float(setup.spacing.min()) - bodies), 0.0))

    def hears(self, setup: MissionSetup) -> bool:
        """Whether robots keep away from teammates that they hear, instead of those that they see."""
        return self.teammates == HEARD and setup.radio is not None

    @classmethod
    def numbers(cls) -> dict[str, type]:
        """Return its parameters as kernels see them; a null `teammate_distance` is the mission's own."""
        return {
            "safe_distance": float, "measure": int, "teammate_distance": float, "heard_distance": float,
            "gain": int, "gain_margin": float, "sidestep": float,
        }  # fmt: skip

    def packed(self, setup: MissionSetup | None = None) -> dict[str, float]:
        """Return its parameters as numbers, 0 for the distance to teammates that do not count."""
        assert setup is not None
        distance, hears = self.distance_of_teammates(setup), self.hears(setup)
        return {
            "safe_distance": self.safe_distance, "measure": float(self.measure == "surface"),
            "teammate_distance": distance * (not hears), "heard_distance": distance * hears,
            "gain": float(self.gain == "printed"), "gain_margin": self.gain_margin, "sidestep": self.sidestep,
        }  # fmt: skip

    def wish_lanes(self, i: int, plan: Plan, state: State, x: Array, wish: Array, at: int) -> Wish:
        """Return eq. 3 with the gain of eqs. 23, 24: sigma = |q - o| is to grow to the safe distance.

        The sidestep is not part of it: see `sidestep`.
        """
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
