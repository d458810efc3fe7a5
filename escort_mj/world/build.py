"""From a scenario to a MuJoCo world: MJCF composed from parts, compiled, and wired to the controller."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj import palette
from escort_mj.control.packing import pack
from escort_mj.control.plan import state_size
from escort_mj.control.setup import Setup
from escort_mj.scenario.bodies import Bodies, bodies_of
from escort_mj.scenario.obstacles import obstacles_of
from escort_mj.scenario.placement import Team, gravity_of, team
from escort_mj.scenario.schema import Scenario
from escort_mj.scenario.setup import controller_setup
from escort_mj.signals import truth_sizes
from escort_mj.world.cameras import add_cameras
from escort_mj.world.parts import graft, load_part, new_root
from escort_mj.world.robots import add_robots, add_start
from escort_mj.world.stages import IN_SPACE, THIN, Stage, corners, stages_of
from escort_mj.world.wiring import thickness, wire

INTEGRATORS = {"euler": "Euler", "implicitfast": "implicitfast", "implicit": "implicit"}
SOLVERS = {"newton": "Newton", "cg": "CG", "pgs": "PGS"}
PATH_SAMPLES = 500
MOST_NUMBERS = 500  # that MuJoCo's reader takes in one element


@dataclass(frozen=True)
class World:
    """A compiled world and what it was made from.

    Attributes:
        model: MuJoCo's model; it carries the controller's parameters.
        xml: The same model as MJCF text, to open in any MuJoCo viewer.
        setup: What the controller is told.
        team: The robots.
        bodies: What can touch.
        thickness: Least extent of each body, shape (bodies,) [m].
        stride: Physics steps between two recorded samples.
        sizes: Size of each dimension of the record.
    """

    model: mujoco.MjModel
    xml: str
    setup: Setup
    team: Team
    bodies: Bodies
    thickness: NDArray[np.float64]
    stride: int
    sizes: dict[str, int]


def build(scenario: Scenario) -> World:
    """Builds and compiles the world of a scenario.

    Args:
        scenario: A checked scenario.
    """
    robots = team(scenario)
    setup = controller_setup(scenario, robots)
    stride = round(1.0 / (scenario.recording.rate * scenario.physics.timestep))

    root = new_root("arena", "mission")
    _set_physics(root, scenario)
    if scenario.axes == 2:
        floor = load_part("floor").find("geom", "floor")
        graft(floor, root.worldbody, "floor")
    stages = _stages(scenario, setup, robots)
    add_robots(root, robots, gravity_of(scenario), stages, scenario.mission.radius)
    _add_obstacles(root, scenario, stages, len(robots.mass))
    target = _add_target(root, scenario, setup.target.position(0.0), stages, len(robots.mass))
    low, high = corners(stages)
    if scenario.axes == 2:
        low[2], high[2] = (
            0.0,
            high[2] + max(robots.radius.max(), scenario.target.radius, *setup.obstacle_radius),
        )
    add_cameras(root, target, scenario, low, high)
    if scenario.axes > IN_SPACE:  # a body's parts may lie on another's while the two are far apart
        for geom in root.find_all("geom"):
            geom.contype = geom.conaffinity = 0

    bodies = bodies_of(scenario)
    watched = len(bodies.watched)
    plan = pack(setup, stride, robots.coordinates, scenario.recording.truth, watched, bodies.columns)
    root.size.nuserdata = state_size(plan)
    root.sensor.add("user", name="watch", dim=1, needstage="acc", datatype="real")
    _add_numbers(root, "escort_plan", plan)
    model = mujoco.MjModel.from_xml_string(root.to_xml_string())
    wiring = wire(model, robots, gravity_of(scenario), stages, bodies.names)
    _add_numbers(root, "escort_wiring", wiring)
    add_start(root, model, robots, gravity_of(scenario))
    xml = root.to_xml_string()
    sizes = {
        "robot": len(robots.mass),
        "axis": scenario.axes,
        "obstacle": len(setup.obstacle_radius),
        "behavior": len(setup.kinds),
        "coordinate": robots.coordinates,
        "group": watched,
    } | truth_sizes(scenario.axes, scenario.recording.truth, setup.law.has_lyapunov)
    return World(
        mujoco.MjModel.from_xml_string(xml),
        xml,
        setup,
        robots,
        bodies,
        thickness(model, bodies.names),
        stride,
        sizes,
    )


def _add_numbers(root: Any, name: str, numbers: NDArray[Any]) -> None:
    """Adds numbers to what the model carries; MuJoCo reads few at once, and keeps all one behind another.

    Numbers too small to be normal are none: MuJoCo's reader refuses them.
    """
    numbers = np.where(np.abs(numbers) < np.finfo(float).tiny, 0.0 * numbers, numbers)
    for part, first in enumerate(range(0, len(numbers), MOST_NUMBERS), 1):
        root.custom.add("numeric", name=f"{name}_{part}", data=numbers[first : first + MOST_NUMBERS])


def _set_physics(root: Any, scenario: Scenario) -> None:
    """Writes MuJoCo's options; a state that turns NaN stays visible instead of being reset."""
    physics = scenario.physics
    root.option.timestep = physics.timestep
    root.option.integrator = INTEGRATORS[physics.integrator]
    root.option.solver = SOLVERS[physics.solver]
    root.option.gravity = gravity_of(scenario)
    root.option.flag.autoreset = "disable"


def _stages(scenario: Scenario, setup: Setup, robots: Team) -> list[Stage]:
    """Where the axes of the mission are in the world; planar missions happen at one height."""
    path = setup.target.position(np.linspace(0.0, scenario.duration, PATH_SAMPLES))
    reach = max(scenario.mission.radius + robots.radius.max(), scenario.target.radius)
    centers = np.vstack([path, robots.position, setup.obstacle_position])
    around = np.concatenate([np.full(len(path), reach), robots.radius, setup.obstacle_radius])[:, None]
    low, high = (centers - around).min(axis=0), (centers + around).max(axis=0)
    height = robots.height if scenario.axes == 2 else 0.0
    return stages_of(low, high, height, scenario.mission.radius, robots.radius.max(), len(robots.mass))


def _add_obstacles(root: Any, scenario: Scenario, stages: list[Stage], count: int) -> None:
    """The fixed bodies of each obstacle, one for each stage."""
    part = load_part("obstacle").find("body", "obstacle")
    for obstacle in obstacles_of(scenario):
        name = obstacle.name
        for stage in stages:
            body = graft(part, root.worldbody, name + stage.suffix)
            body.pos = stage.place(obstacle.position)
            geom = body.find("geom", f"{name}{stage.suffix}_body")
            geom.set_attributes(size=obstacle.size, rgba=[*palette.OBSTACLE, 1.0], group=stage.number)
            if stage.is_abacus:  # a band across all columns: this far the obstacle reaches along the axis
                size = [stage.width(count) / 2, THIN * scenario.mission.radius, obstacle.bounding_radius]
                geom.set_attributes(type="box", size=size, rgba=[*palette.OBSTACLE, 0.3])


def _add_target(root: Any, scenario: Scenario, start: NDArray[Any], stages: list[Stage], count: int) -> Any:
    """The bodies of the target, one for each stage, moved along its trajectory; the first is returned."""
    part = load_part("target").find("body", "target")
    radius = scenario.mission.radius
    for stage in stages:
        name = f"target{stage.suffix}"
        body = graft(part, root.worldbody, name, skip=("follow",) if stage.suffix else ())
        body.pos = stage.place(start)
        geom = body.find("geom", f"{name}_body")
        geom.set_attributes(size=[scenario.target.radius], rgba=[*palette.TARGET, 1.0], group=stage.number)
        if stage.is_abacus:  # bars across all columns: at the target, and as far from it as robots can be
            half = stage.width(count) / 2
            geom.set_attributes(type="box", size=[half, THIN * radius, THIN * radius])
            for side in (-1.0, 1.0):
                body.add(
                    "geom", type="box", pos=[0.0, 0.0, side * radius], rgba=[*palette.LIMIT, 0.6],
                    size=[half, THIN * radius / 2, THIN * radius / 2], group=stage.number,
                )  # fmt: skip
        elif stage.suffix:
            rgba = [*palette.LIMIT, 0.08]
            body.add("geom", type="sphere", size=[radius], rgba=rgba, group=stage.number)
    return root.find("body", "target")


__all__ = ["World", "build"]
