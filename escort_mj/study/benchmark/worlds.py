"""Worlds of the GCBF+ benchmark: read from a file, or drawn by its published rules.

The rules are those of github.com/MIT-REALM/gcbfplus, in gcbfplus/env (double_integrator.py, linear_drone.py,
crazyflie.py and utils.py): boxes anywhere in a square, or spheres anywhere in a cube, perhaps overlapping;
then for each agent a start and a goal, uniform there and drawn again until they are four radii away
from all that stands and all other starts, or goals.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Literal, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, NonNegativeInt, PositiveFloat, PositiveInt, ValidationError

from escort_mj.components.parameters import Mass, Parameters, Radius, Vector
from escort_mj.errors import Fault, ScenarioError, UsageError
from escort_mj.recognize import irregular
from escort_mj.scenario.findings import key_path, listed, shown
from escort_mj.scenario.reader.explain import findings_of
from escort_mj.scenario.reader.load import tuples

Array = NDArray[np.float64]

Environment = Literal["DoubleIntegrator", "LinearDrone", "CrazyFlie"]
SHIPPED = {name: f"gcbf_double_integrator_{name}.json" for name in ("n8", "n32")}
LENGTHS = {"DoubleIntegrator": (0.1, 0.5), "LinearDrone": (0.15, 0.3), "CrazyFlie": (0.1, 0.6)}
"""Sides of boxes and diameters of spheres [m]."""
BODIES: dict[str, dict[str, float]] = {
    "DoubleIntegrator": {},
    "LinearDrone": {},
    "CrazyFlie": {"mass": 0.0299, "sight": 1.0, "speed_limit_per_axis": 0.3},
}
"""What an environment's agents have that is not the default of `Worlds`."""
APART = 4.0  # radii of a robot between starts, between goals, and from either to boxes
TRIES = 1024


class Box(Parameters):
    """A box that stands in the way."""

    center: Vector
    """Its center [m]."""
    size: Annotated[tuple[Radius, ...], Field(min_length=2, max_length=2)]
    """Lengths of its sides [m]."""
    angle: float = 0.0
    """How far it is turned [rad]."""


class Ball(Parameters):
    """A sphere that stands in the way."""

    center: Vector
    """Its center [m]."""
    radius: Radius
    """Its radius [m]."""


class BenchmarkEpisode(Parameters):
    """One world: where agents start, where they go, and what stands in the way."""

    episode: NonNegativeInt = 0
    """Its number."""
    start: Annotated[tuple[Vector, ...], Field(min_length=1)]
    """Where each agent starts [m]."""
    goal: Annotated[tuple[Vector, ...], Field(min_length=1)]
    """Where each agent goes [m]."""
    boxes: tuple[Box, ...] = ()
    """What stands in the way in a square."""
    balls: tuple[Ball, ...] = ()
    """What stands in the way in a cube."""


class Worlds(Parameters):
    """Worlds, and what all of them share."""

    environment: Environment = "DoubleIntegrator"
    """Name of the published dynamics."""
    robots: PositiveInt
    """Number of agents."""
    area: PositiveFloat = 4.0
    """Side of the square or cube [m]."""
    obstacles: NonNegativeInt = 8
    """Number of boxes or spheres."""
    timestep: PositiveFloat = 0.03
    """Time between two decisions of the published controllers [s]."""
    steps: PositiveInt = 1024
    """Number of these in an episode."""
    robot_radius: Radius = 0.05
    """Radius of an agent [m]."""
    mass: Mass = 0.1
    """Mass of an agent [kg]."""
    force_limit: PositiveFloat = 1.0
    """Largest force per axis [N]."""
    speed_limit_per_axis: PositiveFloat = 0.5
    """Largest speed per axis [m/s]."""
    sight: PositiveFloat = 0.5
    """How far an agent sees from its center [m]."""
    rays: PositiveInt = 32
    """Number of the rays by which the published controllers see boxes."""
    seed: NonNegativeInt = 0
    """What they were drawn from."""
    episodes: Annotated[tuple[BenchmarkEpisode, ...], Field(min_length=1)]
    """The worlds."""

    @property
    def duration(self) -> float:
        """Length of an episode [s]."""
        return self.timestep * self.steps


def read_worlds(source: str | os.PathLike[str]) -> Worlds:
    """Read worlds.

    Args:
        source: A JSON file, or the name of shipped worlds: n8 or n32.

    Raises:
        UsageError: If there is no such file, or it is no JSON.
        ScenarioError: With all its faults.
    """
    name = os.fspath(source)
    path = Path(str(files(__package__))) / "worlds" / SHIPPED[name] if name in SHIPPED else Path(source)
    if kind := irregular(path):
        raise UsageError(f"{name}: is {kind}, not a file")
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise UsageError(f"{name}: there is no such file; shipped worlds are {', '.join(SHIPPED)}") from None
    except (OSError, ValueError) as error:
        raise UsageError(f"{name}: cannot be read as JSON: {error}") from None
    try:
        worlds = Worlds.model_validate(tuples(data), strict=True)
    except ValidationError as error:
        faults = [(key_path(each.path), each.message) for each in findings_of(error, data, Worlds)]
        raise ScenarioError([Fault(message, key, source=name) for key, message in faults]) from None
    for number, each in enumerate(worlds.episodes):
        for key, points in (("start", each.start), ("goal", each.goal)):
            if len(points) != worlds.robots:
                words = f"found {len(points)} points; expected {worlds.robots}, as robots says"
                raise ScenarioError([Fault(words, f"episodes[{number}].{key}", source=name)])
    return worlds


def draw_worlds(
    agents: int,
    area: float,
    obstacles: int,
    episodes: int,
    seed: int,
    environment: str = "DoubleIntegrator",
    travel: float | None = None,
) -> Worlds:
    """Draw worlds by the published rules.

    Args:
        agents: Number of agents.
        area: Side of the square or cube [m].
        obstacles: Number of boxes or spheres.
        episodes: Number of worlds.
        seed: What they are drawn from; each world has a stream of its own.
        environment: Name of the published dynamics; `DoubleIntegrator` has a square, the others a cube.
        travel: Farthest that a goal is from its start along an axis [m]; None for anywhere.

    Raises:
        UsageError: If there is no such environment, or agents find no room.
    """
    if environment not in LENGTHS:
        allowed = listed(list(get_args(Environment)))
        raise UsageError(f"environment: found {shown(environment)}; allowed are {allowed}")
    common = {"robots": agents, "area": area, "obstacles": obstacles, "seed": seed}
    apart = APART * Worlds.model_fields["robot_radius"].default
    drawn = [
        _draw(
            np.random.Generator(np.random.Philox([seed, i])),
            agents,
            area,
            obstacles,
            apart,
            environment,
            math.inf if travel is None else travel,
        )
        | {"episode": i}
        for i in range(episodes)
    ]
    return Worlds.model_validate(
        common | BODIES[environment] | {"environment": environment, "episodes": drawn}
    )


def _draw(
    random: np.random.Generator,
    agents: int,
    area: float,
    obstacles: int,
    apart: float,
    environment: str,
    travel: float,
) -> dict[str, object]:
    """Draw one world."""
    axes = 2 if environment == "DoubleIntegrator" else 3
    centers = random.uniform(0.0, area, (obstacles, axes))
    if axes == 2:
        sizes = random.uniform(*LENGTHS[environment], (obstacles, 2))
        angles = random.uniform(0.0, 2.0 * math.pi, obstacles)
        standing: dict[str, object] = {
            "boxes": [
                {"center": center.tolist(), "size": size.tolist(), "angle": float(angle)}
                for center, size, angle in zip(centers, sizes, angles, strict=True)
            ]
        }
    else:
        radii = 0.5 * random.uniform(*LENGTHS[environment], obstacles)
        balls = zip(centers, radii, strict=True)
        standing = {"balls": [{"center": at.tolist(), "radius": float(radius)} for at, radius in balls]}

    def clear(point: Array) -> bool:
        if axes == 2:
            return bool(np.all(_gaps(point, centers, sizes, angles) >= apart))
        return bool(np.all(np.linalg.norm(centers - point, axis=1) > radii + apart))

    room = (area + apart) ** axes / apart**axes  # at most so many even if they stood on a dense grid
    tries = TRIES if agents < 2.0 * room else 0
    for _ in range(tries):  # starts over where an agent finds no room, as the published code does
        starts, goals = np.zeros((0, axes)), np.zeros((0, axes))
        while len(goals) < agents:
            start = _free(random, np.zeros(axes), np.full(axes, area), starts, clear, apart)
            if start is None:
                break
            low, high = np.maximum(start - travel, 0.0), np.minimum(start + travel, area)
            goal = _free(random, low, high, goals, clear, apart)
            if goal is None:
                break
            starts, goals = np.vstack([starts, start]), np.vstack([goals, goal])
        else:
            return {"start": starts.tolist(), "goal": goals.tolist()} | standing
    raise UsageError(f"found no room for {agents} agents in {area:g} m; give a larger area")


def _free(
    random: np.random.Generator,
    low: Array,
    high: Array,
    taken: Array,
    clear: Callable[[Array], bool],
    apart: float,
) -> Array | None:
    """A point that far from points that are taken and from all that stands; None after many tries."""
    for _ in range(TRIES):
        point: Array = random.uniform(low, high)
        if np.all(np.linalg.norm(taken - point, axis=1) > apart) and clear(point):
            return point
    return None


def _gaps(point: Array, centers: Array, sizes: Array, angles: Array) -> Array:
    """Distance from a point to each box, 0 inside, shape (boxes,) [m]."""
    way, cosine, sine = point - centers, np.cos(angles), np.sin(angles)
    inward = np.stack([cosine * way[:, 0] + sine * way[:, 1], cosine * way[:, 1] - sine * way[:, 0]], axis=1)
    return np.asarray(np.linalg.norm(np.maximum(np.abs(inward) - 0.5 * sizes, 0.0), axis=1))
