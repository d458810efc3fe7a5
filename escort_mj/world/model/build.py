"""From a scenario to a MuJoCo world: MJCF composed from parts, which carries the controller's parameters."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from contextlib import nullcontext
from dataclasses import dataclass, field
from functools import cached_property
from xml.etree.ElementTree import Element

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj import palette
from escort_mj.control.setup import Setup
from escort_mj.errors import PluginError
from escort_mj.memory.layout import state_size
from escort_mj.memory.packing import pack
from escort_mj.metrics.watching import asked_of
from escort_mj.mjcf import child_named, section, set_attributes
from escort_mj.monitor.signals import GEOMS
from escort_mj.plugin_calls import is_plugins, watched
from escort_mj.scenario.geometry.bodies import Bodies
from escort_mj.scenario.geometry.crowd import CROWD, contact_physics
from escort_mj.scenario.geometry.obstacles import Body
from escort_mj.scenario.geometry.placement import Placement, gravity_of
from escort_mj.scenario.geometry.shapes import extent
from escort_mj.scenario.geometry.steps import Schedule
from escort_mj.scenario.mission import Mission, mission_of
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.signals import record_size
from escort_mj.world.loop.addresses import thickness
from escort_mj.world.model.cameras import add_cameras
from escort_mj.world.model.compiling import add_numbers, compile_addressed
from escort_mj.world.model.parts import new_root, place_of
from escort_mj.world.model.robot.placing import add_assets, add_media, models_of, own_geoms
from escort_mj.world.model.robots import add_robots, check_hulls
from escort_mj.world.model.surroundings import add_obstacles, add_target, add_tethers, set_floor, set_medium
from escort_mj.world.model.touching import Solids, check_pairs, solids_of
from escort_mj.world.stages import IN_SPACE, Stage, corners, stages_of

Array = NDArray[np.float64]

INTEGRATORS = {"euler": "Euler", "implicitfast": "implicitfast", "implicit": "implicit"}
SOLVERS = {"newton": "Newton", "cg": "CG", "pgs": "PGS"}
PATH_SAMPLES = 500
FRICTIONLESS = 1  # condim of a contact that only pushes
ARENA, ARENA_PER_ROBOT = 16_384, 64  # room for contacts of a crowd [KiB]; balls squeezed together use 10 each


@dataclass(frozen=True)
class World:
    """A compiled world and what it was made from.

    Attributes:
        model: MuJoCo's model; it carries the controller's parameters, and no textures.
        tree: The same model as MJCF, and with textures.
        mission: What it was made from.
        thickness: Least extent of each body, shape (bodies,) [m].
        shapes: What of each body can touch: `geoms` of a robot that is more than its hull, else one shape,
            shape (bodies,).
        sizes: Size of each dimension of the record.
        assets: Files that the tree names.
    """

    model: mujoco.MjModel
    tree: Element = field(repr=False)
    mission: Mission = field(repr=False)
    thickness: Array
    shapes: tuple[str, ...]
    sizes: dict[str, int]
    assets: dict[str, bytes] = field(default_factory=dict, repr=False)

    @property
    def scenario(self) -> Scenario:
        """The mission's scenario."""
        return self.mission.scenario

    @property
    def setup(self) -> Setup:
        """What the controller is given."""
        return self.mission.setup

    @property
    def team(self) -> Placement:
        """The robots."""
        return self.mission.team

    @property
    def bodies(self) -> Bodies:
        """What can touch."""
        return self.mission.bodies

    @property
    def schedule(self) -> Schedule:
        """When samples are taken."""
        return self.mission.schedule

    @cached_property
    def asked(self) -> tuple[str, ...]:
        """Names of the signals that these are found from."""
        return asked_of(self.mission.watches, self.sizes)

    @cached_property
    def record_size(self) -> int:
        """Number of values of one whole sample."""
        return record_size(self.sizes)

    @cached_property
    def xml(self) -> str:
        """The tree as text, to open in any MuJoCo viewer."""
        ElementTree.indent(self.tree)
        return ElementTree.tostring(self.tree, "unicode")


def build(mission: Mission | Scenario) -> World:
    """Build and compile the world of a mission.

    Args:
        mission: Worked out, or a checked scenario as it stands.

    Raises:
        PluginError: If a plugin's kind of robots is not what it must be, or changes what the process shares.
    """
    if isinstance(mission, Scenario):
        mission = mission_of(mission)
    kinds = {type(kind): kind for kind in mission.team.kind}
    own = " or ".join(place_of(kind) for model, kind in kinds.items() if is_plugins(model))
    with watched() if own else nullcontext(list[str]()) as changes:
        world = _built(mission)
    if changes:
        raise PluginError(f"{own}: {changes[0]}")
    return world


def _built(mission: Mission) -> World:
    """The compiled world of a mission."""
    scenario, robots, stages = mission.scenario, mission.team, _stages(mission)
    tree = new_root("arena", "mission")
    _set_physics(tree, scenario)
    _add_bodies(tree, mission, stages)
    _add_cameras(tree, mission, stages)
    count = len(robots.mass)
    solids = Solids((False,) * count)
    if scenario.axes <= IN_SPACE and mission.seen is None:  # nobody logged how a robot's joints stood
        solids = solids_of(tree, count)
    sampling = mission.sampling(solids.several)
    sizes = mission.record_sizes(sampling)
    plan = pack(mission.setup, sampling, asked_of(mission.watches, sizes))
    _add_state(tree, plan)
    _add_watch(tree)
    own = own_geoms(tree, robots)
    _set_contacts(tree, scenario, count, own)
    set_medium(tree, scenario.environment, own)
    add_numbers(tree, "escort_plan", plan)
    models = models_of(robots)
    assets = {name: content for each in models for name, content in each.assets.items()}
    add_media(tree, models, scenario.environment)
    model = compile_addressed(tree, mission, stages, assets, solids)
    if scenario.axes <= IN_SPACE:
        check_hulls(model, robots)
        check_pairs(model, mission.bodies, [kind.kind for kind in robots.kind])
    thin = thickness(model, mission.bodies.names)
    return World(model, tree, mission, thin, _shapes(mission, solids), sizes, assets)


def _shapes(mission: Mission, solids: Solids) -> tuple[str, ...]:
    """What of each body can touch, see `World`."""
    robots = (GEOMS if several else "sphere" for several in solids.several)
    return (*robots, "sphere", *(body.shape for body in mission.obstacles), "plane")


def _add_bodies(tree: Element, mission: Mission, stages: list[Stage]) -> None:
    """Add all that can be touched; robots come before every other body."""
    scenario, setup, robots = mission.scenario, mission.setup, mission.team
    count = len(robots.mass)
    radius = scenario.mission.radius
    if scenario.axes == 2:
        set_floor(tree, scenario.environment)
    add_assets(tree, models_of(robots))
    teams = [palette.team_color(int(number)) for number in setup.members] if setup.teams else []
    add_robots(tree, robots, gravity_of(scenario), stages, radius, teams or palette.robot_colors(count))
    add_obstacles(tree, mission.obstacles, stages, count, radius)
    add_target(tree, scenario, setup.target.position(0.0), stages, count)
    add_tethers(tree, scenario.robots.tethers)


def _add_cameras(tree: Element, mission: Mission, stages: list[Stage]) -> None:
    """Add cameras that see all that happens; in planar missions from the floor to the highest top."""
    scenario, (low, high) = mission.scenario, corners(stages)
    if scenario.axes == 2:
        tops = [mission.team.radius.max(), _target_radius(scenario), *map(_above, mission.obstacles)]
        low[2], high[2] = 0.0, high[2] + max(tops)
    target = child_named(section(tree, "worldbody"), "body", "target")
    add_cameras(tree, target, scenario, low, high)


def _add_state(tree: Element, plan: Array) -> None:
    """Make room for the controller's state."""
    set_attributes(section(tree, "size"), nuserdata=state_size(plan))


def _add_watch(tree: Element) -> None:
    """Add the sensor by which MuJoCo calls what looks at every step after the solver."""
    watch = ElementTree.SubElement(section(tree, "sensor"), "user", name="watch")
    set_attributes(watch, dim=1, needstage="acc", datatype="real")


def _set_physics(tree: Element, scenario: Scenario) -> None:
    """Writes MuJoCo's options; a state that turns NaN stays visible instead of being reset."""
    physics, option = scenario.physics, section(tree, "option")
    set_attributes(
        option,
        timestep=physics.timestep,
        integrator=INTEGRATORS[physics.integrator],
        solver=SOLVERS[contact_physics(scenario).solver],
        gravity=gravity_of(scenario),
    )
    set_attributes(section(option, "flag"), autoreset="disable")


def _set_contacts(tree: Element, scenario: Scenario, count: int, own: set[Element]) -> None:
    """Set friction of what touches, but for geoms with their own, and room for the contacts of a crowd.

    MuJoCo's own guess of the room, for 1000 robots 0.5 GB and for 5000 9 GB, is that of Newton's method.
    """
    if scenario.axes > IN_SPACE:  # a body's parts may lie on another's while the two are far apart
        for geom in tree.iter("geom"):
            set_attributes(geom, contype=0, conaffinity=0)
        return
    contacts = contact_physics(scenario)
    if not contacts.friction:
        for geom in tree.iter("geom"):
            if geom.get("name") != "floor" and geom not in own:
                set_attributes(geom, condim=FRICTIONLESS)
    if contacts.solver == "cg" and count >= CROWD:
        set_attributes(section(tree, "size"), memory=f"{ARENA + ARENA_PER_ROBOT * count}K")


def _target_radius(scenario: Scenario) -> float:
    """Radius of the target [m]; 0 without one."""
    return 0.0 if scenario.target is None else scenario.target.radius


def _above(body: Body) -> float:
    """How far an obstacle of a planar mission reaches above the robots' centers at the start [m]."""
    return float(extent(body.solid)[1][2])


def _stages(mission: Mission) -> list[Stage]:
    """Where the axes of the mission are in the world; planar missions happen at one height."""
    scenario, setup, robots = mission.scenario, mission.setup, mission.team
    samples = PATH_SAMPLES if scenario.target is not None else 0
    path = setup.target.position(np.linspace(0.0, scenario.duration, samples))
    reach = max(scenario.mission.radius + robots.radius.max(), _target_radius(scenario))
    around = np.concatenate([np.full(len(path), reach), robots.radius])[:, None]
    centers = np.vstack([path, robots.position])
    sent, largest = setup.destinations(scenario.duration), robots.radius.max()
    corners = [corner for body in mission.obstacles for corner in body.corners(scenario.axes)]
    moments = np.linspace(0.0, scenario.duration, PATH_SAMPLES)
    corners += [mover.path.position(moments) for mover in setup.movers if mover.obstacle >= 0]
    changing = any(target.escorted_by for team in setup.teams for target in team.targets)
    for team, places in zip(setup.teams, setup.target_places, strict=True):
        ways = [mover.path.position(moments) for mover in setup.movers if mover.obstacle in places]
        reach = max(setup.radii_of(team)) + robots.radius.max()
        for middle in ways if changing else [np.mean(ways, axis=0)]:
            corners += [middle - reach, middle + reach]
    every = np.vstack([centers - around, centers + around, sent - largest, sent + largest, *corners])
    low, high = every.min(axis=0), every.max(axis=0)
    height = robots.height if scenario.axes == 2 else 0.0
    return stages_of(low, high, height, scenario.mission.radius, robots.radius.max(), len(robots.mass))


__all__ = ["World", "build"]
