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
from escort_mj.scenario.placement import Team, team
from escort_mj.scenario.schema import Scenario
from escort_mj.scenario.setup import controller_setup
from escort_mj.signals import truth_sizes
from escort_mj.world.cameras import add_cameras
from escort_mj.world.parts import graft, load_part, new_root
from escort_mj.world.wiring import PLAN_SIZE, Group, wire

INTEGRATORS = {"euler": "Euler", "implicitfast": "implicitfast", "implicit": "implicit"}
SOLVERS = {"newton": "Newton", "cg": "CG", "pgs": "PGS"}
STANDARD_GRAVITY = 9.81
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
        stride: Physics steps between two recorded samples.
        sizes: Size of each dimension of the record.
    """

    model: mujoco.MjModel
    xml: str
    setup: Setup
    team: Team
    stride: int
    sizes: dict[str, int]


def obstacle_names(scenario: Scenario) -> list[str]:
    """Names of the obstacles, given or numbered."""
    return [obstacle.name or f"obstacle_{j}" for j, obstacle in enumerate(scenario.obstacles, 1)]


def build(scenario: Scenario) -> World:
    """Builds and compiles the world of a scenario.

    Args:
        scenario: A checked scenario.
    """
    robots = team(scenario)
    setup = controller_setup(scenario, robots)
    stride = round(1.0 / (scenario.recording.rate * scenario.physics.timestep))
    coordinates = len(robots.mass) * (7 if scenario.robots.kind == "rolling_sphere" else scenario.axes)

    root = new_root("arena", "mission")
    _set_physics(root, scenario)
    if scenario.axes == 2:
        floor = load_part("floor").find("geom", "floor")
        graft(floor, root.worldbody, "floor")
    height = scenario.robots.radius if scenario.axes == 2 else 0.0
    _add_robots(root, scenario, robots, height)
    _add_obstacles(root, scenario, height)
    start = _in_space(setup.target.position(0.0), height)
    target = graft(load_part("target").find("body", "target"), root.worldbody, "target")
    target.pos = start
    target.find("geom", "target_body").set_attributes(
        size=[scenario.target.radius], rgba=[*palette.TARGET, 1.0]
    )
    add_cameras(root, target, scenario, *_extent(scenario, setup, robots, height))

    plan = pack(setup, stride, coordinates, scenario.recording.truth)
    root.size.nuserdata = state_size(plan)
    root.sensor.add("user", name="watch", dim=1, needstage="acc", datatype="real")
    plan[PLAN_SIZE] = len(plan)
    _add_numbers(root, "escort_plan", plan)
    model = mujoco.MjModel.from_xml_string(root.to_xml_string())
    _add_numbers(root, "escort_wiring", wire(model, len(robots.mass)))
    xml = root.to_xml_string()
    sizes = {
        "robot": len(robots.mass),
        "axis": scenario.axes,
        "obstacle": len(scenario.obstacles),
        "behavior": len(setup.kinds),
        "coordinate": coordinates,
    } | truth_sizes(scenario.axes, scenario.recording.truth, setup.law.has_lyapunov)
    return World(mujoco.MjModel.from_xml_string(xml), xml, setup, robots, stride, sizes)


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
    rolls = scenario.robots.kind == "rolling_sphere"
    root.option.gravity = physics.gravity or [0.0, 0.0, -STANDARD_GRAVITY if rolls else 0.0]
    root.option.flag.autoreset = "disable"


def _in_space(position: NDArray[Any], height: float) -> NDArray[Any]:
    """A position of the mission as a point of the world: planar missions happen at one height."""
    return np.asarray(position) if len(position) == 3 else np.array([*position, height])


def _add_robots(root: Any, scenario: Scenario, robots: Team, height: float) -> None:
    """One body and its motors per robot."""
    part = load_part(scenario.robots.kind)
    axes = "xyz"[: scenario.axes]
    body_part = part.find("body", "robot")
    motors = [part.find("actuator", axis) for axis in axes]
    rolls = scenario.robots.kind == "rolling_sphere"
    for i, position in enumerate(robots.position):
        name = f"robot_{i + 1}"
        body = graft(body_part, root.worldbody, name, skip=tuple(set("xyz") - set(axes)))
        body.pos = _in_space(position, robots.radius[i] if rolls else height)
        body.find("geom", f"{name}_body").set_attributes(
            size=[robots.radius[i]],
            mass=robots.mass[i],
            rgba=[*palette.robot_color(i, len(robots.mass)), 1.0],
        )
        if not rolls:
            for axis, start in zip(axes, position, strict=True):
                body.find("joint", f"{name}_{axis}").ref = start
        for motor in motors:
            copy = root.actuator.add(
                "motor", name=f"{name}_{motor.name}", joint=f"{name}_{motor.joint.name}", gear=motor.gear
            )
            if np.isfinite(robots.force_limit[i]):
                copy.forcerange = [-robots.force_limit[i], robots.force_limit[i]]


def _add_obstacles(root: Any, scenario: Scenario, height: float) -> None:
    """One fixed body per obstacle."""
    part = load_part("obstacle").find("body", "obstacle")
    for name, obstacle in zip(obstacle_names(scenario), scenario.obstacles, strict=True):
        body = graft(part, root.worldbody, name)
        body.pos = _in_space(np.array(obstacle.position), height)
        body.find("geom", f"{name}_body").set_attributes(
            size=[obstacle.radius], rgba=[*palette.OBSTACLE, 1.0]
        )


def _extent(
    scenario: Scenario, setup: Setup, robots: Team, height: float
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Corners of the box in which the mission happens, shape (3,) each [m]."""
    path = setup.target.position(np.linspace(0.0, scenario.duration, PATH_SAMPLES))
    reach = max(scenario.mission.radius + robots.radius.max(), scenario.target.radius)
    centers = np.vstack([path, robots.position, setup.obstacle_position])
    around = np.concatenate([np.full(len(path), reach), robots.radius, setup.obstacle_radius])[:, None]
    low, high = (centers - around).min(axis=0), (centers + around).max(axis=0)
    if scenario.axes == 2:
        tallest = max(robots.radius.max(), scenario.target.radius, *setup.obstacle_radius)
        return np.array([*low, 0.0]), np.array([*high, height + tallest])
    return low, high


__all__ = ["Group", "World", "build", "obstacle_names"]
