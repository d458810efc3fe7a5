"""Our own loop on the mission of `stage.py`: all on that a run has, sampled into memory as a run is."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import version
from typing import Any

import numpy as np

from benchmarks.peers import stage
from benchmarks.peers.flight import Flight
from escort_mj.api import load_scenario
from escort_mj.scenario import Scenario
from escort_mj.world.model.build import World
from escort_mj.world.plant import Plant

# The law's gains for quadrotors are those of scenarios/robots/quadrotor.yaml, which docs/robots.md explains.
BEHAVIORS: list[Any] = [{"behavior": "avoid_obstacles", "safe_distance": 0.8}, "vertices", "surface"]
BASES = {"point_mass": "main", "quadrotor": "robots/quadrotor"}


def mission(
    kind: str, n: int, axes: int, spacing: float = 1.0, changes: Mapping[str, Any] | None = None
) -> Scenario:
    """The mission with noise, disturbance, avoidance of obstacles and teammates, and a place for everyone.

    Args:
        kind: Of robots.
        n: How many.
        axes: 2 in the plane, 3 in space.
        spacing: Distances between robots, relative to those of `stage.py`.
        changes: Keys of the scenario that are to be different.
    """
    place, axis = stage.target(0.0, n, axes)[0] + spacing * stage.places(n, axes), range(axes)
    pace = stage.SPEED / stage.SWEEP
    course: list[Any] = [
        f"{stage.SWEEP}*cos({pace}*t)",
        f"{stage.SWEEP}*sin({pace}*t)",
        stage.height(n, axes),
    ]
    push = ["0.5*sin(0.5*t)", "0.5*sin(0.7*t)", "0.5*cos(0.5*t)"]
    told = {
        "axes": axes,
        "target.position": course[:axes],
        "robots.count": n,
        "robots.placement": None,
        "robots.radius": stage.RADIUS,
        "robots.positions": place.tolist(),
        "obstacles": [
            {"position": center, "radius": stage.OBSTACLE_RADIUS}
            for center in stage.obstacles(n, axes).tolist()
        ],
        "mission.radius": spacing * stage.radius(n, axes),
        "mission.behaviors": BEHAVIORS,
        "uncertainty.disturbance": [push[k] for k in axis],
        "expect": [],
    }
    return load_scenario(BASES[kind], told | dict(changes or {}))


def advance(plant: Plant, steps: int) -> None:
    """Takes steps as a run does, samples and episodes of contact taken off on the way."""
    left = steps // plant.world.schedule.stride
    while left > 0:
        left -= len(plant.samples(left))
        if plant.has_ended:
            plant.ended()


def fly(world: World) -> Flight:
    """A mission under way; to be stepped inside `native_loop(world)`."""
    plant = Plant(world)

    def step(count: int) -> None:
        advance(plant, count)

    def error() -> float:
        state = plant.state
        reach = np.linalg.norm(state.q - state.target_position, axis=1)
        return float(np.abs(reach - world.setup.radius).mean())

    robots = world.sizes["robot"]
    return Flight(step, error, world.model.opt.timestep, robots, version("escort-mj"), world.schedule.stride)


def fly_many(world: World, count: int) -> Flight:
    """So many missions under way at once, each in a thread of its own."""
    flights = [fly(world) for _ in range(count)]
    pool = ThreadPoolExecutor(count)
    one = flights[0]

    def step(steps: int) -> None:
        list(pool.map(lambda flight: flight.step(steps), flights))

    def error() -> float:
        return float(np.mean([flight.error() for flight in flights]))

    return Flight(step, error, one.timestep, count * one.robots, one.version, one.chunk)
