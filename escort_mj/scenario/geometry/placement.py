"""The team as it starts: how many robots, what each is like, and where each stands."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.components.random_placement import RandomPlacement
from escort_mj.errors import Fault, ScenarioError
from escort_mj.robots.kind import MOST_MOTORS, RobotKind, plane_height
from escort_mj.robots.modeled import ModeledKind, RobotModel
from escort_mj.scenario.geometry.obstacle_body import Body, clear_of
from escort_mj.scenario.geometry.obstacles import obstacles_of
from escort_mj.scenario.geometry.teams import team_center
from escort_mj.scenario.geometry.trajectory import target_trajectory
from escort_mj.scenario.schema.environment import tilted
from escort_mj.scenario.schema.robots import Actuators
from escort_mj.scenario.schema.scenario import Scenario

Array = NDArray[np.float64]

DEFAULT_COUNT = {2: 5}  # the paper's teams; in more axes a cross-polytope: two robots an axis
TRIES_PER_ROBOT = 2000
TRIES_AT_ONCE = 4
GAINS = 1  # stream of random numbers beside that of positions, with the same seed
STANDARD_GRAVITY = 9.81


class Placement(NamedTuple):
    """The robots, one row each.

    Attributes:
        position: Where they start, shape (n, p) [m].
        velocity: At the start, shape (n, p) [m/s].
        mass: Shape (n,) [kg].
        radius: Shape (n,) [m].
        force_limit: Largest force per axis, shape (n,) [N]; inf for none.
        kind: What each is.
        actuators: What the motors of each do to commands.
        gains: Gain of each of their motors, 1 for what the controller believes.
    """

    position: Array
    velocity: Array
    mass: Array
    radius: Array
    force_limit: Array
    kind: tuple[RobotKind, ...]
    actuators: tuple[Actuators, ...]
    gains: tuple[Array, ...]

    @property
    def height(self) -> float:
        """Height at which a planar mission happens [m]: what hangs below robots clears the floor."""
        return plane_height(zip(self.kind, map(float, self.radius), strict=True))

    @property
    def coordinates(self) -> int:
        """Number of generalized positions of all robots."""
        return coordinates_of(self.kind, self.position.shape[1])

    def model(self, robot: int) -> RobotModel | None:
        """Return the whole MJCF model that a robot is, by its number from 0; None where it is none."""
        kind = self.kind[robot]
        if not isinstance(kind, ModeledKind):
            return None
        return kind.robot(float(self.mass[robot]), float(self.radius[robot]))


def coordinates_of(kinds: Sequence[RobotKind], axes: int) -> int:
    """Number of generalized positions of robots of these kinds in a mission of so many axes."""
    return sum(kind.coordinates(axes) for kind in kinds)


def kinds_of(scenario: Scenario) -> tuple[RobotKind, ...]:
    """What each robot is."""
    kinds = [scenario.robots.kind] * robot_count(scenario)
    for override in scenario.robots.overrides:
        kinds[override.robot - 1] = override.kind or kinds[override.robot - 1]
    return tuple(kinds)


def gravity_of(scenario: Scenario) -> tuple[float, ...]:
    """Gravity, world frame, shape (3,) [m/s^2]: as told, or downward where kind of robot or slope need it.

    On a slope the world's frame is that of the floor: gravity is tilted.
    """
    slope, gravity = scenario.environment.slope, scenario.physics.gravity
    if gravity is None:
        heavy = slope.angle > 0.0 or any(kind.needs_gravity for kind in kinds_of(scenario))
        gravity = (0.0, 0.0, -STANDARD_GRAVITY if heavy else 0.0)
    return tuple(map(float, tilted(gravity, slope)))


def _gains(
    seed: int, kinds: Sequence[RobotKind], actuators: Sequence[Actuators], axes: int
) -> tuple[Array, ...]:
    """Gain of each motor of each robot, those of a robot whatever the others are; many motors repeat some."""
    random = np.random.Generator(np.random.Philox([seed, GAINS]))
    drawn = 2.0 * random.random((len(kinds), MOST_MOTORS)) - 1.0
    return tuple(
        1.0 + each.gain_error * np.resize(row, kind.motors(axes))
        if each.gains is None
        else np.array(each.gains)
        for kind, each, row in zip(kinds, actuators, drawn, strict=True)
    )


def robot_count(scenario: Scenario) -> int:
    """Number of robots: as told, as many as have positions, or the default team for the axes."""
    robots = scenario.robots
    if robots.count is not None:
        return robots.count
    if robots.positions is not None:
        return len(robots.positions)
    return DEFAULT_COUNT.get(scenario.axes, 2 * scenario.axes)


@lru_cache(maxsize=16)
def team(scenario: Scenario) -> Placement:
    """The robots of a scenario; random positions come from its seed, the same on every machine.

    Raises:
        ScenarioError: If random positions are asked for and there is no room for them.
    """
    robots, count = scenario.robots, robot_count(scenario)
    mass = np.full(count, robots.mass)
    radius = np.full(count, robots.radius)
    force_limit = np.full(count, np.inf if robots.force_limit is None else robots.force_limit)
    actuators = [robots.actuators] * count
    position = np.full((count, scenario.axes), np.nan)
    if robots.positions is not None:
        position[:] = robots.positions
    for override in robots.overrides:
        robot = override.robot - 1
        mass[robot] = override.mass or mass[robot]
        radius[robot] = override.radius or radius[robot]
        force_limit[robot] = override.force_limit or force_limit[robot]
        actuators[robot] = override.actuators or actuators[robot]
        if override.position is not None:
            position[robot] = override.position
    if robots.positions is None:
        random = np.random.Generator(np.random.Philox(scenario.seed))
        for placement, members in _placements(scenario, count):
            draw_places(scenario, placement, random, position, radius, "robot", members)
    kinds = kinds_of(scenario)
    gains = _gains(scenario.seed, kinds, actuators, scenario.axes)
    velocity = np.zeros((count, scenario.axes))
    if robots.velocities is not None:
        velocity[:] = robots.velocities
    for array in (position, velocity, mass, radius, force_limit, *gains):
        array.setflags(write=False)
    return Placement(position, velocity, mass, radius, force_limit, kinds, tuple(actuators), gains)


def _placements(scenario: Scenario, count: int) -> Iterator[tuple[RandomPlacement, NDArray[np.bool_]]]:
    """Yield where robots are placed at random, those of each team around its targets, shape (n,) each."""
    given = scenario.robots.placement
    if not scenario.teams:
        within = 2.0 * scenario.mission.radius
        yield given or RandomPlacement(within=within), np.ones(count, dtype=bool)
    for one in scenario.teams:
        near = given or RandomPlacement(within=2.0 * (one.radius or scenario.mission.radius))
        center = near.center or tuple(map(float, team_center(scenario, one.name)))
        members = np.isin(np.arange(count), np.array(one.robots) - 1)
        yield near.model_copy(update={"center": center}), members


def draw_places(
    scenario: Scenario,
    placement: RandomPlacement,
    random: np.random.Generator,
    position: Array,
    radius: Array,
    what: str,
    which: NDArray[np.bool_] | bool = True,
) -> None:
    """Draw the rows that are NaN, clear of one another and of everything else but robots.

    Args:
        scenario: Gives obstacles and target.
        placement: Where, and how far apart.
        random: Draws them.
        position: Shape (n, p) [m]; changed in place.
        radius: Of what is to stand there, shape (n,) [m].
        what: Name of what is to stand there, for messages: `robot` or `goal`.
        which: Rows that are drawn at all, shape (n,).

    Raises:
        ScenarioError: If there is no room for them.
    """
    target = target_trajectory(scenario).position(0.0)
    center = target if placement.center is None else np.array(placement.center)
    target_radius = [scenario.target.radius] if scenario.target is not None else []
    unknown = np.isnan(position).any(axis=1)
    free = unknown & which
    obstacles = obstacles_of(scenario)
    spheres = [body for body in obstacles if body.is_sphere]
    taken = np.concatenate(
        [
            target[np.newaxis][: len(target_radius)],
            np.array([body.position for body in spheres]).reshape(-1, scenario.axes),
            position[~unknown],
        ]
    )
    taken_radius = np.concatenate(
        [
            target_radius,
            [body.bounding_radius for body in spheres],
            radius[~unknown],
        ]
    )
    others = [body for body in obstacles if not body.is_sphere]
    for robot in np.flatnonzero(free):
        reach = taken_radius + radius[robot] + placement.least_gap
        drawn = _draw(
            random, center, placement.within, taken, reach, others, radius[robot] + placement.least_gap
        )
        if drawn is None:
            words = _no_room(placement, f"{what} {robot + 1} of {len(radius)}")
            raise ScenarioError(
                [Fault(words, "robots.placement" if what == "robot" else "mission.behaviors")]
            )
        position[robot] = drawn
        taken = np.concatenate([taken, drawn[np.newaxis]])
        taken_radius = np.append(taken_radius, radius[robot])


def _draw(
    random: np.random.Generator,
    center: Array,
    within: float,
    taken: Array,
    reach: Array,
    others: Sequence[Body],
    apart: float,
) -> Array | None:
    """A point uniform in the ball, at least `reach` from points that are taken and `apart` from other bodies.

    None after many tries. Drawn in the cube around the ball and kept if inside: plain arithmetic, equal bits
    everywhere.
    """
    tried = 0
    while tried < TRIES_PER_ROBOT:
        offsets = 2.0 * random.random((TRIES_AT_ONCE, len(center))) - 1.0
        points = center + within * offsets[(offsets * offsets).sum(axis=1) <= 1.0]
        tried += len(points)
        difference = points[:, np.newaxis] - taken
        clear = ((difference * difference).sum(axis=2) >= reach * reach).all(axis=1)
        clear[clear] = clear_of(others, points[clear], apart)
        if clear.any():
            return np.asarray(points[np.argmax(clear)])
    return None


def _no_room(placement: RandomPlacement, what: str) -> str:
    return (
        f"found no free place for {what} within {placement.within:g} m at gaps of "
        f"{placement.least_gap:g} m; give a larger within, a smaller least_gap or fewer robots"
    )
