"""From a scenario to a MuJoCo world: MJCF composed from parts, compiled, and wired to the controller."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal
from xml.etree.ElementTree import Element

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj.components.plan import state_size
from escort_mj.control.packing import pack
from escort_mj.control.setup import Setup
from escort_mj.errors import Fault, PluginError, ScenarioError
from escort_mj.mjcf import section, write
from escort_mj.scenario.geometry.bodies import Bodies, bodies_of
from escort_mj.scenario.geometry.crowd import CROWD, ContactPhysics, contact_physics
from escort_mj.scenario.geometry.obstacles import Body, obstacles_of
from escort_mj.scenario.geometry.placement import Team, gravity_of, team
from escort_mj.scenario.geometry.shapes import extent
from escort_mj.scenario.geometry.steps import Schedule, schedule_of
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.scenario.setup import controller_setup
from escort_mj.signals import record_size, truth_sizes
from escort_mj.world.loop.sampling import room_for
from escort_mj.world.loop.wiring import faces_of, thickness, wire, wiring_size
from escort_mj.world.model.cameras import add_cameras
from escort_mj.world.model.parts import new_root
from escort_mj.world.model.robots import add_robots, add_start
from escort_mj.world.model.surroundings import add_obstacles, add_target, set_floor, set_medium
from escort_mj.world.stages import IN_SPACE, Stage, corners, stages_of

INTEGRATORS = {"euler": "Euler", "implicitfast": "implicitfast", "implicit": "implicit"}
SOLVERS = {"newton": "Newton", "cg": "CG", "pgs": "PGS"}
PATH_SAMPLES = 500
FRICTIONLESS = 1  # condim of a contact that only pushes
ARENA, ARENA_PER_ROBOT = 16_384, 64  # room for contacts of a crowd [KiB]; balls squeezed together use 10 each
PAIR = 8  # bytes that MuJoCo takes for each pair of bodies: in the search for pairs and in its result
MOST_NUMBERS = 500  # that MuJoCo's reader takes in one element


@dataclass(frozen=True)
class World:
    """A compiled world and what it was made from.

    Attributes:
        model: MuJoCo's model; it carries the controller's parameters, and no textures.
        tree: The same model as MJCF, and with textures.
        setup: What the controller is told.
        team: The robots.
        bodies: What can touch.
        thickness: Least extent of each body, shape (bodies,) [m].
        schedule: When samples are taken.
        sizes: Size of each dimension of the record.
    """

    model: mujoco.MjModel
    tree: Element = field(repr=False)
    setup: Setup
    team: Team
    bodies: Bodies
    thickness: NDArray[np.float64]
    schedule: Schedule
    sizes: dict[str, int]

    @cached_property
    def record_size(self) -> int:
        """Number of values of one whole sample."""
        return record_size(self.sizes)

    @cached_property
    def xml(self) -> str:
        """The tree as text, to open in any MuJoCo viewer."""
        ElementTree.indent(self.tree)
        return ElementTree.tostring(self.tree, "unicode")


def build(scenario: Scenario, outside: Literal["velocity", "force"] | None = None) -> World:
    """Builds and compiles the world of a scenario.

    Args:
        scenario: A checked scenario.
        outside: What is written from outside instead of computed, see `Setup`.
    """
    robots = team(scenario)
    setup = replace(controller_setup(scenario, robots), outside=outside)
    coordinates = robots.coordinates + len(setup.movers) * scenario.axes
    schedule = schedule_of(scenario)

    tree = new_root("arena", "mission")
    _set_physics(tree, scenario)
    if scenario.axes == 2:
        set_floor(tree, scenario.environment)
    obstacles = obstacles_of(scenario)
    stages = _stages(scenario, setup, robots, obstacles)
    add_robots(tree, robots, gravity_of(scenario), stages, scenario.mission.radius)
    add_obstacles(tree, obstacles, stages, len(robots.mass), scenario.mission.radius)
    target = add_target(tree, scenario, setup.target.position(0.0), stages, len(robots.mass))
    low, high = corners(stages)
    if scenario.axes == 2:
        low[2], high[2] = (
            0.0,
            high[2] + max(robots.radius.max(), scenario.target.radius, *(_above(body) for body in obstacles)),
        )
    add_cameras(tree, target, scenario, low, high)
    bodies = bodies_of(scenario)
    truth = scenario.recording.truth
    sizes = {
        "robot": len(robots.mass),
        "axis": scenario.axes,
        "obstacle": len(setup.obstacle_radius),
        "behavior": len(setup.kinds),
        "coordinate": coordinates,
        "group": len(bodies.watched),
    } | truth_sizes(scenario.axes, truth, setup.law.has_lyapunov)
    record = record_size(sizes)
    samples = 0 if truth else room_for(record), record  # truth needs Python at every sample
    plan = pack(
        setup, schedule.stride, coordinates, truth, sizes["group"], bodies.columns, samples, schedule.extra
    )
    write(section(tree, "size"), nuserdata=state_size(plan))
    watch = ElementTree.SubElement(section(tree, "sensor"), "user", name="watch")
    write(watch, dim=1, needstage="acc", datatype="real")
    if scenario.axes > IN_SPACE:  # a body's parts may lie on another's while the two are far apart
        for geom in tree.iter("geom"):
            write(geom, contype=0, conaffinity=0)
    else:
        _set_contacts(tree, contact_physics(scenario), len(robots.mass))
    set_medium(tree, scenario.environment)
    _add_numbers(tree, "escort_plan", _normal(plan))
    movers, faces = len(setup.movers), faces_of(obstacles)
    model = _wired(tree, robots, gravity_of(scenario), stages, bodies.names, movers, faces)
    return World(
        model,
        tree,
        setup,
        robots,
        bodies,
        thickness(model, bodies.names),
        schedule,
        sizes,
    )


def _compiled(tree: Element) -> mujoco.MjModel:
    """The model of a tree, without its textures: to make them takes longer than all the rest.

    Raises:
        ScenarioError: If MuJoCo refuses it, as numbers that its reader does not take.
    """
    assets = section(tree, "asset")
    place = list(tree).index(assets)
    bare = Element("asset")
    for element in assets:
        if element.get("texture"):
            element = Element(
                element.tag, {key: element.attrib[key] for key in element.keys() if key != "texture"}
            )
        if element.tag != "texture":
            bare.append(element)
    tree[place] = bare
    try:
        return mujoco.MjModel.from_xml_string(ElementTree.tostring(tree, "unicode"))
    except ValueError as error:
        words = " ".join(str(error).split())
        raise ScenarioError([Fault(f"MuJoCo refuses the world: {words}")]) from None
    finally:
        tree[place] = assets


def _first_compiled(tree: Element, robots: Team) -> mujoco.MjModel:
    """The same, the first time.

    Raises:
        PluginError: If MuJoCo refuses a body that a plugin brings.
    """
    try:
        return _compiled(tree)
    except ScenarioError as error:
        own = next((kind.kind for kind in robots.kind if kind.mjcf), None)
        if own is None:
            raise
        words = str(error).replace("refuses the world", "refuses its body")
        raise PluginError(f"the kind {own}: {words}") from None


def _wired(
    tree: Element,
    robots: Team,
    gravity: Sequence[float],
    stages: Sequence[Stage],
    names: Sequence[str],
    movers: int,
    faces: NDArray[np.float64],
) -> mujoco.MjModel:
    """The model of a tree with its wiring, which tells where the compiler has put what.

    What is found only in a compiled model is written into it, and into the tree: to compile again would
    double the time. Only what does not start at rest, or is more than the tree shows, is compiled again.

    Args:
        tree: MJCF tree without wiring and start; receives both.
        robots: What they are.
        gravity: World frame, shape (3,) [m/s^2].
        stages: Where the axes of the mission are.
        names: Of the bodies that can touch.
        movers: How many of these move by themselves.
        faces: Of those that are meshes, see `faces_of`.

    Raises:
        PluginError: If MuJoCo refuses a body that a plugin brings.
    """
    geoms = sum(1 for _ in section(tree, "worldbody").iter("geom"))
    axes = sum(len(stage.directions) for stage in stages)
    room = np.zeros(wiring_size(robots, axes, names, movers, geoms, len(faces)))
    elements = _add_numbers(tree, "escort_wiring", room)
    model = _first_compiled(tree, robots)
    wiring = _normal(wire(model, robots, gravity, stages, names, faces))
    for element in elements:
        section(tree, "custom").remove(element)
    _add_numbers(tree, "escort_wiring", wiring)
    more = [add_start(tree, model, robots, gravity), _add_memory(tree, model), len(wiring) != len(room)]
    if any(more):
        return _compiled(tree)
    model.numeric_data[-len(wiring) :] = wiring
    return model


def _add_memory(tree: Element, model: mujoco.MjModel) -> bool:
    """Enlarge MuJoCo's memory where pairs of bodies take more than a quarter of it; whether that was so.

    MuJoCo ends a step by an error where its memory is too small, and its own guess knows contacts only.
    """
    pairs = PAIR * model.nbody * (model.nbody - 1) // 2
    if 4 * pairs <= model.narena:
        return False
    write(section(tree, "size"), memory=f"{(model.narena + pairs) // 1024 + 1}K")
    return True


def _add_numbers(tree: Element, name: str, numbers: NDArray[np.float64]) -> list[Element]:
    """Adds numbers to what the model carries; MuJoCo reads few at once, and keeps all one behind another."""
    elements = []
    for part, first in enumerate(range(0, len(numbers), MOST_NUMBERS), 1):
        elements.append(ElementTree.SubElement(section(tree, "custom"), "numeric", name=f"{name}_{part}"))
        write(elements[-1], data=numbers[first : first + MOST_NUMBERS])
    return elements


def _normal(numbers: NDArray[np.float64]) -> NDArray[np.float64]:
    """Numbers too small to be normal as none: MuJoCo's reader refuses them."""
    return np.where(np.abs(numbers) < np.finfo(float).tiny, 0.0 * numbers, numbers)


def _set_physics(tree: Element, scenario: Scenario) -> None:
    """Writes MuJoCo's options; a state that turns NaN stays visible instead of being reset."""
    physics, option = scenario.physics, section(tree, "option")
    write(
        option,
        timestep=physics.timestep,
        integrator=INTEGRATORS[physics.integrator],
        solver=SOLVERS[contact_physics(scenario).solver],
        gravity=gravity_of(scenario),
    )
    write(section(option, "flag"), autoreset="disable")


def _set_contacts(tree: Element, contacts: ContactPhysics, count: int) -> None:
    """Friction of what touches, and room for the contacts of a crowd.

    MuJoCo's own guess of the room, for 1000 robots 0.5 GB and for 5000 9 GB, is that of Newton's method.
    """
    if not contacts.friction:
        for geom in tree.iter("geom"):
            if geom.get("name") != "floor":
                write(geom, condim=FRICTIONLESS)
    if contacts.solver == "cg" and count >= CROWD:
        write(section(tree, "size"), memory=f"{ARENA + ARENA_PER_ROBOT * count}K")


def _above(body: Body) -> float:
    """How far an obstacle of a planar mission reaches above the robots' centers at the start [m]."""
    return float(extent(body.solid)[1][2])


def _stages(scenario: Scenario, setup: Setup, robots: Team, bodies: Sequence[Body]) -> list[Stage]:
    """Where the axes of the mission are in the world; planar missions happen at one height."""
    path = setup.target.position(np.linspace(0.0, scenario.duration, PATH_SAMPLES))
    reach = max(scenario.mission.radius + robots.radius.max(), scenario.target.radius)
    centers = np.vstack([path, robots.position])
    around = np.concatenate([np.full(len(path), reach), robots.radius])[:, None]
    corners = [corner for body in bodies for corner in body.corners(scenario.axes)]
    moments = np.linspace(0.0, scenario.duration, PATH_SAMPLES)
    corners += [mover.path.position(moments) for mover in setup.movers if mover.obstacle >= 0]
    every = np.vstack([centers - around, centers + around, *corners])
    low, high = every.min(axis=0), every.max(axis=0)
    height = robots.height if scenario.axes == 2 else 0.0
    return stages_of(low, high, height, scenario.mission.radius, robots.radius.max(), len(robots.mass))


__all__ = ["World", "build"]
