"""Obstacle avoidance (paper eqs. 3, 23-24): leave the safe sphere of the obstacle that intrudes most."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, NonNegativeFloat

from escort_mj.behaviors.behavior import Avoidance, Behavior
from escort_mj.behaviors.bodies import Body, obstacle_body, teammate_body
from escort_mj.behaviors.robots import Robots
from escort_mj.behaviors.task import Task, along
from escort_mj.components.component import Derived, OfMission
from escort_mj.components.facts import Facts, Misfit
from escort_mj.components.parameters import Distance
from escort_mj.components.setup import MissionSetup
from escort_mj.knowledge.teammates import find_nearest_heard
from escort_mj.native.kernels import inlined
from escort_mj.native.lanes import WIDTH, Lanes, any_of, everywhere, greatest, load, root
from escort_mj.native.vectors import Vec, dot, norm, numbers_at, unit_axis, where
from escort_mj.numerics.neighbors import candidate, number_of_candidates, seen_neighbors
from escort_mj.plan import Plan, State

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

HEARD: Literal["heard"] = "heard"
POLAR = 0.9  # a unit vector with more than this along the last axis hardly turns in the others
PRINTED = 1  # place of that gain among the choices


class AvoidObstacles(Behavior):
    """Keep each robot outside the safe spheres around obstacles and teammates."""

    frame: ClassVar[Literal["target", "world"]] = "world"

    behavior: Literal["avoid_obstacles"] = "avoid_obstacles"
    safe_distance: Distance = 2.0
    """Distance to an obstacle or a failed robot below which the behavior is active [m]."""
    measure: Literal["center", "surface"] = "surface"
    """Measure of distances: `surface` to surface, or `center` to center (as for the paper's point robots)."""
    teammates: Literal[True, False, "heard"] = True
    """Whether a teammate that comes too close counts as an obstacle (remark 2): `true`, if the robot sees it;
    `heard`, at every place where it could be by now, according to its messages; `false`, never."""
    teammate_distance: Distance | None = None
    """Safe distance to teammates [m]; null: `safe_distance`, but at most half the spacing of the formation.
    """
    gain: Literal["consistent", "printed"] = "consistent"
    """State-dependent gain: as eq. 23 of the paper requires (`consistent`), or with the coefficient that the
    paper prints (`printed`)."""
    gain_margin: NonNegativeFloat = 0.1
    """Constant added to the state-dependent gain [1/s] (paper: rho_i)."""
    sidestep: Annotated[float, Field(ge=0.0, le=10.0)] = 0.1
    """Share of the velocity that an obstacle blocks. What the speed around the obstacle lacks of it is added,
    all the same way around, so that robots do not stop head-on (remark 6); 0: nothing (the paper)."""

    python_only: ClassVar[frozenset[str]] = frozenset({"measure", "teammates", "teammate_distance"})

    @Derived
    def to_surface(self) -> float:
        """1 if distances are between surfaces, 0 if between centers."""
        return float(self.measure == "surface")

    @OfMission
    def seen_distance(self, setup: MissionSetup) -> float:
        """Safe distance to teammates that robots see [m]; 0: to none."""
        return 0.0 if self.hears(setup) else self.distance_of_teammates(setup)

    @OfMission
    def heard_distance(self, setup: MissionSetup) -> float:
        """Safe distance to teammates that robots hear [m]; 0: to none."""
        return self.distance_of_teammates(setup) if self.hears(setup) else 0.0

    def misfits(self, mission: Facts) -> Iterator[Misfit]:
        """Yield bodies that robots notice too late, and teammates that keep them from their places."""
        mates = self.teammate_distance or self.safe_distance
        apart = mates + 2.0 * mission.robot_radius * (self.measure == "surface")
        if self.teammates == HEARD:
            yield from self._misfits_of_messages(mission, apart)
        seen_mates = mates if self.teammates is True else 0.0
        if mission.failures:  # a lost robot is an obstacle
            seen_mates = max(seen_mates, self.safe_distance)
        needed = (("robots", seen_mates), ("obstacles", self.safe_distance))
        for (name, distance), within in zip(needed, mission.seen_within, strict=True):
            if within is not None and within < distance:
                words = f"found {distance:g} m; expected at most {within:g} m, sensing.radius.{name}"
                key = "safe_distance" if distance == self.safe_distance else "teammate_distance"
                yield Misfit(words, key, (("sensing", "radius", name),))
        if self.teammate_distance is not None and self.teammates and apart > mission.spacing:
            words = f"found {mates:g} m, which reaches beyond the formation's neighbors at "
            words += f"{mission.spacing:.4g} m"
            yield Misfit(f"{words}: avoidance would never let them take their places", "teammate_distance")

    def _misfits_of_messages(self, mission: Facts, apart: float) -> Iterator[Misfit]:
        """Yield what keeps robots from hearing of teammates in time."""
        if not mission.heard:
            words = f"found {HEARD} without communication; expected true, false or a table communication"
            yield Misfit(words, "teammates", (("communication",),))
            return
        if mission.max_speed is None and None in mission.force_limits:
            words = (
                f"found {HEARD} with neither mission.max_speed nor robots.force_limit; expected one or both"
            )
            words += ", as they bound where a teammate may have got to since it was heard"
            yield Misfit(words, "teammates", (("mission", "max_speed"), ("robots", "force_limit")))
        if mission.heard_within is not None and mission.heard_within < apart:
            words = (
                f"found {HEARD}; robots hear each other up to {mission.heard_within:g} m between centers, "
            )
            words += f"less than the {apart:g} m that they are to keep"
            yield Misfit(words, "teammates", (("communication", "range"),))

    def keeps_off(self, radius: float) -> float:
        """Return how far it keeps a robot's center from the surfaces of obstacles [m]."""
        return self.safe_distance + radius * (self.measure == "surface")

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

    def avoidance(self, setup: MissionSetup) -> Avoidance:
        """Return its distances; that to teammates is kept to those seen, or to those heard."""
        numbers = self.packed(setup)
        seen, heard = numbers["seen_distance"], numbers["heard_distance"]
        return Avoidance(self.safe_distance, seen, heard, self.to_surface, self.sidestep)

    def hears(self, setup: MissionSetup) -> bool:
        """Whether robots keep away from teammates that they hear, instead of those that they see."""
        return self.teammates == HEARD and setup.radio is not None

    def task(self, r: Robots) -> Task:
        """Return eq. 3 with the gain of eqs. 23, 24: sigma = |q - o| is to grow to the safe distance."""
        kept = Avoidance(
            self.safe_distance, self.seen_distance, self.heard_distance, self.to_surface, self.sidestep
        )
        depth, distance, x = _worst_intruder(kept, r)
        nothing = everywhere(0.0)
        if not any_of(depth > 0.0):
            return along(x, nothing, 0.0 * x, nothing, nothing, nothing, self.sidestep)
        x = where(distance > 0.0, x / distance, unit_axis(x, 0))  # at its own place, any direction does
        speed, error = norm(r.v), r.slope * norm(r.e)
        if int(self.gain) == PRINTED:
            # (b + sqrt(b^2 + 4ac)) / 2a with the printed b, multiplied out so that nothing cancels
            pull = speed - 2.0 * error + root(greatest(error * (5.0 * error - 2.0 * speed), 0.0))
        else:
            pull = speed + (math.sqrt(2.0) - 1.0) * error
        active = where(depth > 0.0, 1.0, nothing)
        velocity = where(depth > 0.0, (pull + self.gain_margin * depth) * x, 0.0)
        return along(x, active, velocity, active, depth, distance, self.sidestep)


@inlined
def _worst_intruder(avoid: Avoidance, r: Robots) -> tuple[Lanes, Lanes, Vec]:
    """Look for what is deepest in the safe sphere of each robot: the inequality that is broken most.

    Returns:
        How deep it is, 0 where nothing intrudes [m]; how far away it is, and the way from there [m].
    """
    plan, state = r.plan, r.state
    worst, distance, x = everywhere(0.0), everywhere(0.0), 0.0 * r.q
    for j in range(r.obstacles):
        worst, distance, x = _deeper(obstacle_body(avoid, j, r), worst, distance, x)
    if avoid.heard_distance > 0.0:
        find_nearest_heard(r.i, avoid.heard_distance, avoid.to_surface, plan, state)
        deep = -load(state.heard_margin, r.i)
        worse = (deep > worst) & r.there
        worst, distance = where(worse, deep, worst), where(worse, 1.0, distance)
        x = where(worse, r.at(state.wished_direction, 0), x)
    looking = avoid.teammate_distance > 0.0
    if looking and seen_neighbors(state).shape[0] > 0:
        looking = someone_within(avoid.teammate_distance, r.i, avoid, plan, state)
    if not looking and plan.failure.shape[0] == 0:
        return worst, distance, x
    for j in range(state.q.shape[0]):
        body = teammate_body(avoid, j, r)
        if body.safe > 0.0:
            worst, distance, x = _deeper(body, worst, distance, x)
    return worst, distance, x


@inlined
def _deeper(body: Body, worst: Lanes, distance: Lanes, x: Vec) -> tuple[Lanes, Lanes, Vec]:
    """Return what is deepest so far, with one more body.

    Args:
        body: The body.
        worst: The deepest so far: how deep [m],
        distance: how far away [m],
        x: and the way from there [m].
    """
    square, reach = dot(body.x, body.x), body.reach
    near = (square < reach * reach) & body.counts
    if any_of(near):
        length = root(square)
        worse = near & (reach - length > worst)
        worst, distance = where(worse, reach - length, worst), where(worse, length, distance)
        x = where(worse, body.x, x)
    return worst, distance, x


@inlined
def someone_within(distance: float, i: int, avoid: Avoidance, plan: Plan, state: State) -> bool:
    """Whether one of robots i to i + 7 has a teammate within a distance [m]."""
    for robot in range(i, min(i + WIDTH, state.q.shape[0])):
        if mate_within(distance, robot, avoid, plan, state):
            return True
    return False


@inlined
def mate_within(distance: float, robot: int, avoid: Avoidance, plan: Plan, state: State) -> bool:
    """Whether a robot has a teammate within a distance [m]."""
    n, q, radius = state.q.shape[0], numbers_at(state, state.q_measured, robot), plan.robot_radius
    lists = seen_neighbors(state)
    for c in range(number_of_candidates(robot, n, lists)):
        j = candidate(robot, c, lists)
        way = q - numbers_at(state, state.q_measured, j)
        reach = distance + avoid.to_surface * (radius[robot] + radius[j])
        if dot(way, way) < reach * reach and j != robot:
            return True
    return False
