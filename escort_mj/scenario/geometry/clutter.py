"""Clutter: obstacles drawn from a seed, with a passage of guaranteed width between any two of them.

Every obstacle lies in a ball of its own, and balls keep the passage between them, to the other obstacles, to
where the target ever is and to the robots' given starts. Plain arithmetic: the same on every machine.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from escort_mj.errors import Fault, ScenarioError
from escort_mj.scenario.geometry.obstacle_body import Body, clear_of
from escort_mj.scenario.geometry.trajectory import target_trajectory
from escort_mj.scenario.schema.obstacle_tables import Clutter
from escort_mj.scenario.schema.scenario import Scenario

Array = NDArray[np.float64]
Quaternion = tuple[float, float, float, float]

TRIES = 4000
TRIES_AT_ONCE = 16
PATH_SAMPLES = 4001
LEAST_SHARE = 0.4  # of the ball's radius: the least half-size of what is drawn into it
LYING = (0.5, 0.5, 0.5, 0.5)  # turns an own z axis into the world's x axis


def drawn(scenario: Scenario, placed: Sequence[Body]) -> Iterator[Body]:
    """The obstacles that a scenario's clutter table asks for.

    Args:
        scenario: The scenario.
        placed: What stands in the way already.

    Raises:
        ScenarioError: If there is no room for all of them.
    """
    clutter, axes = scenario.clutter, scenario.axes
    if clutter is None:
        return
    random = np.random.Generator(np.random.Philox(scenario.seed if clutter.seed is None else clutter.seed))
    taken, reach = _kept_clear(scenario)
    for index in range(clutter.count):
        radius = clutter.least_radius + random.random() * (clutter.largest_radius - clutter.least_radius)
        shape = clutter.shapes[int(random.random() * len(clutter.shapes))]
        size, orientation = _shape(random, shape, radius, axes, scenario.robots.height)
        center = _place(random, clutter, placed, taken, reach, radius)
        if center is None:
            raise ScenarioError([Fault(_no_room(clutter, index), "clutter")])
        taken, reach = np.vstack([taken, center]), np.append(reach, radius)
        yield Body(
            name=f"clutter_{index + 1}",
            group="obstacles",
            shape=shape,
            size=size,
            position=center,
            bounding_radius=radius,
            path=("clutter",),
            orientation=orientation,
        )


def _kept_clear(scenario: Scenario) -> tuple[Array, Array]:
    """Where the target is and robots start, shape (k, p), and how much room each takes, shape (k,) [m]."""
    samples = PATH_SAMPLES if scenario.target is not None else 0
    radius = scenario.target.radius if scenario.target is not None else 0.0
    path = target_trajectory(scenario).position(np.linspace(0.0, scenario.duration, samples))
    between = 0.5 * float(np.linalg.norm(np.diff(path, axis=0), axis=1).max(initial=0.0))
    path = path[np.sort(np.unique(path, axis=0, return_index=True)[1])]
    robots = scenario.robots
    starts = [*(robots.positions or ()), *(o.position for o in robots.overrides if o.position is not None)]
    largest = robots.largest_radius
    taken = np.vstack([path, *(np.array([start]) for start in starts)])
    reach = np.concatenate([np.full(len(path), radius + between), np.full(len(starts), largest)])
    return taken, reach


def _place(
    random: np.random.Generator,
    clutter: Clutter,
    placed: Sequence[Body],
    taken: Array,
    reach: Array,
    radius: float,
) -> Array | None:
    """A center in the box whose ball keeps the passage to everything; None after many tries."""
    low, high = np.array(clutter.low), np.array(clutter.high)
    apart = reach + radius + clutter.passage
    for _ in range(TRIES // TRIES_AT_ONCE):
        points = low + random.random((TRIES_AT_ONCE, len(low))) * (high - low)
        difference = points[:, np.newaxis] - taken
        clear = ((difference * difference).sum(axis=2) >= apart * apart).all(axis=1)
        clear[clear] = clear_of(placed, points[clear], radius + clutter.passage)
        if clear.any():
            return np.asarray(points[np.argmax(clear)])
    return None


def _no_room(clutter: Clutter, index: int) -> str:
    return (
        f"found no place for obstacle {index + 1} of {clutter.count} with a passage of {clutter.passage:g} m "
        "around it; give a larger box, a smaller passage, smaller radii or fewer obstacles"
    )


def _shape(
    random: np.random.Generator, shape: str, radius: float, axes: int, height: float
) -> tuple[tuple[float, ...], Quaternion]:
    """Size and orientation of a shape that fills a ball of a radius as far as it can.

    In the plane its outline at the height of the robots' centers does; it is as high as they are.
    """
    share = [LEAST_SHARE + (1.0 - LEAST_SHARE) * random.random() for _ in range(3)]
    if axes == 2:
        turn = _yaw(random)
        if shape == "box":
            return (*_scaled(share[:2], radius), height), turn
        if shape == "ellipsoid":
            return (radius, share[1] * radius, height), turn
        if shape == "cylinder":
            return (radius, height), turn
        if shape == "capsule":
            return (0.5 * share[0] * radius, radius - 0.5 * share[0] * radius), _product(turn, LYING)
        return (radius,), (1.0, 0.0, 0.0, 0.0)
    turn = _turn(random)
    if shape == "box":
        return _scaled(share, radius), turn
    if shape == "ellipsoid":
        return (radius, share[1] * radius, share[2] * radius), turn
    if shape == "cylinder":
        return _scaled(share[:2], radius), turn
    if shape == "capsule":
        return (0.5 * share[0] * radius, radius - 0.5 * share[0] * radius), turn
    return (radius,), (1.0, 0.0, 0.0, 0.0)


def _scaled(sides: Sequence[float], radius: float) -> tuple[float, ...]:
    """Numbers in the same proportion whose squares add up to that of a radius."""
    square = 0.0
    for side in sides:
        square += side * side
    return tuple(float(side * (radius / np.sqrt(square))) for side in sides)


def _yaw(random: np.random.Generator) -> Quaternion:
    """A random turn about the vertical: a unit vector of the plane as half-angle."""
    while True:
        x, y = 2.0 * random.random(2) - 1.0
        square = x * x + y * y
        if 1e-3 < square <= 1.0:
            return float(x / np.sqrt(square)), 0.0, 0.0, float(y / np.sqrt(square))


def _turn(random: np.random.Generator) -> Quaternion:
    """A random turn in space: a unit vector of four axes."""
    while True:
        x = 2.0 * random.random(4) - 1.0
        square = float(x[0] * x[0] + x[1] * x[1] + x[2] * x[2] + x[3] * x[3])
        if 1e-3 < square <= 1.0:
            w, i, j, k = (float(part / np.sqrt(square)) for part in x)
            return w, i, j, k


def _product(a: Quaternion, b: Quaternion) -> Quaternion:
    """The turn b followed by the turn a."""
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )
