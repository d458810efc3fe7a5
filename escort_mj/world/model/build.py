"""From a scenario to a MuJoCo world: MJCF composed from parts, which carries the controller's parameters."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal, NamedTuple
from xml.etree.ElementTree import Element

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj import palette
from escort_mj.components.setup import FunctionOfTime
from escort_mj.control.setup import Setup
from escort_mj.expectations.expectation import watches_of
from escort_mj.memory.layout import state_size
from escort_mj.memory.packing import pack
from escort_mj.metrics.watching import Watch, asked_of
from escort_mj.mjcf import child_named, section, set_attributes
from escort_mj.monitor.clearances import FAR_AWAY
from escort_mj.monitor.sampling import samples_kept
from escort_mj.monitor.signals import GEOMS
from escort_mj.scenario.geometry.bodies import Bodies, bodies_of
from escort_mj.scenario.geometry.crowd import CROWD, contact_physics
from escort_mj.scenario.geometry.obstacles import Body, obstacles_of
from escort_mj.scenario.geometry.placement import Placement, gravity_of, team
from escort_mj.scenario.geometry.shapes import extent
from escort_mj.scenario.geometry.steps import Schedule, schedule_of
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.scenario.setup import controller_setup
from escort_mj.sensing.sensors import Sensors, readings_of
from escort_mj.signals import SEVERAL, channel_sizes, record_size, truth_sizes
from escort_mj.world.loop.addresses import faces_of, thickness
from escort_mj.world.model.cameras import add_cameras
from escort_mj.world.model.compiling import add_numbers, compile_addressed
from escort_mj.world.model.parts import new_root
from escort_mj.world.model.robot.placing import add_assets, add_media, models_of, own_geoms
from escort_mj.world.model.robots import add_robots
from escort_mj.world.model.surroundings import add_obstacles, add_target, set_floor, set_medium
from escort_mj.world.model.touching import Solids, check_pairs, solids_of
from escort_mj.world.stages import IN_SPACE, Stage, corners, stages_of

Array = NDArray[np.float64]

INTEGRATORS = {"euler": "Euler", "implicitfast": "implicitfast", "implicit": "implicit"}
SOLVERS = {"newton": "Newton", "cg": "CG", "pgs": "PGS"}
PATH_SAMPLES = 500
NEARBY, ROOM = 1.0, 1.1  # m, and times each bound: from here on clearances of robots of geoms are exact
PLAYED = frozenset(
    {"q", "target_position", "lost", "kept_radius", "obstacle_distance", "robot_distance_min"}
    | {"clearance", "target_clearance"}
)
"""Signals that are found of motion that is known instead of simulated."""
FRICTIONLESS = 1  # condim of a contact that only pushes
ARENA, ARENA_PER_ROBOT = 16_384, 64  # room for contacts of a crowd [KiB]; balls squeezed together use 10 each


@dataclass(frozen=True)
class World:
    """A compiled world and what it was made from.

    Attributes:
        model: MuJoCo's model; it carries the controller's parameters, and no textures.
        tree: The same model as MJCF, and with textures.
        setup: What the controller is given.
        team: The robots.
        bodies: What can touch.
        thickness: Least extent of each body, shape (bodies,) [m].
        shapes: What of each body can touch: `geoms` of a robot that is more than its hull, else one shape,
            shape (bodies,).
        exact_within: Clearances of robots of `geoms` are exact below, and at least as large beyond [m].
        schedule: When samples are taken.
        sizes: Size of each dimension of the record.
        scenario: What it was made from.
        watches: What expectations ask about every physics step.
        assets: Files that the tree names.
    """

    model: mujoco.MjModel
    tree: Element = field(repr=False)
    setup: Setup
    team: Placement
    bodies: Bodies
    thickness: Array
    shapes: tuple[str, ...]
    exact_within: float
    schedule: Schedule
    sizes: dict[str, int]
    scenario: Scenario = field(repr=False)
    watches: tuple[Watch, ...] = ()
    assets: dict[str, bytes] = field(default_factory=dict, repr=False)

    @cached_property
    def asked(self) -> tuple[str, ...]:
        """Names of the signals that these are found from."""
        return asked_of(self.watches, self.sizes)

    @cached_property
    def record_size(self) -> int:
        """Number of values of one whole sample."""
        return record_size(self.sizes)

    @cached_property
    def xml(self) -> str:
        """The tree as text, to open in any MuJoCo viewer."""
        ElementTree.indent(self.tree)
        return ElementTree.tostring(self.tree, "unicode")


class Seen(NamedTuple):
    """What was seen of real robots, whose motion is known instead of simulated.

    Attributes:
        position: Where they start, shape (n, p) [m].
        target: Where the target was; None for where the scenario has it.
        edges: Physics steps beside which the motion is unknown; there are samples in them.
    """

    position: Array
    target: FunctionOfTime | None = None
    edges: tuple[int, ...] = ()


class Draft(NamedTuple):
    """What a scenario says of its world, before anything of it is built.

    Attributes:
        scenario: What all else follows from.
        robots: The team.
        setup: What the controller is given.
        obstacles: What stands in the way.
        stages: Where the axes of the mission are.
        bodies: What can touch.
        schedule: When samples are taken.
        sizes: Size of each dimension of the record.
        watches: What expectations ask about every physics step.
    """

    scenario: Scenario
    robots: Placement
    setup: Setup
    obstacles: Sequence[Body]
    stages: list[Stage]
    bodies: Bodies
    schedule: Schedule
    sizes: dict[str, int]
    watches: tuple[Watch, ...]


def build(
    scenario: Scenario,
    outside: Literal["velocity", "force"] | None = None,
    seen: Seen | None = None,
    opponents_outside: bool = False,
) -> World:
    """Build and compile the world of a scenario.

    Args:
        scenario: A checked scenario.
        outside: What is written from outside instead of computed, see `Setup`.
        seen: What was seen of real robots; None for a simulation.
        opponents_outside: Whether what opponents want is written from outside, too.
    """
    draft = _draft(scenario, outside, seen, opponents_outside)
    tree = new_root("arena", "mission")
    _set_physics(tree, scenario)
    _add_bodies(tree, draft)
    _add_cameras(tree, draft)
    count = len(draft.robots.mass)
    solids = Solids((False,) * count)
    if scenario.axes <= IN_SPACE and seen is None:  # nobody logged how a robot's joints stood
        solids = solids_of(tree, count)
    draft.sizes.update({SEVERAL: 1} if solids.any else {})
    plan = _plan(draft, solids)
    _add_state(tree, plan)
    _add_watch(tree)
    own = own_geoms(tree, draft.robots)
    _set_contacts(tree, scenario, count, own)
    set_medium(tree, scenario.environment, own)
    add_numbers(tree, "escort_plan", plan)
    models = models_of(draft.robots)
    assets = {name: content for each in models for name, content in each.assets.items()}
    add_media(tree, models, scenario.environment)
    model = _compile(tree, draft, assets, solids)
    if scenario.axes <= IN_SPACE:
        check_pairs(model, draft.bodies, [kind.kind for kind in draft.robots.kind])
    thin = thickness(model, draft.bodies.names)
    return World(
        model, tree, draft.setup, draft.robots, draft.bodies, thin, _shapes(draft, solids),
        _exact_within(scenario), draft.schedule, draft.sizes, scenario, draft.watches, assets,
    )  # fmt: skip


def _shapes(draft: Draft, solids: Solids) -> tuple[str, ...]:
    """What of each body can touch, see `World`."""
    robots = (GEOMS if several else "sphere" for several in solids.several)
    return (*robots, "sphere", *(body.shape for body in draft.obstacles), "plane")


def _exact_within(scenario: Scenario) -> float:
    """Below what clearance the sphere around a robot does not do for its geoms [m]."""
    asked = [bound for one in scenario.expect for bound in one.robot_distances()]
    return max([NEARBY, *(ROOM * bound for bound in asked)])


def _draft(
    scenario: Scenario,
    outside: Literal["velocity", "force"] | None,
    seen: Seen | None,
    opponents_outside: bool,
) -> Draft:
    """Work out all that a scenario says; arguments as of `build`."""
    robots = team(scenario)
    if seen is not None:
        robots = robots._replace(position=seen.position)
    setup = controller_setup(scenario, robots, seen and seen.target)
    setup = replace(setup, outside=outside, opponents_outside=opponents_outside)
    if seen is not None:  # what was logged has been measured, and pushed, by reality
        setup = replace(setup, sensing=Sensors(), trigger=None, sight=None, radio=None).undisturbed()
    obstacles = obstacles_of(scenario)
    stages = _stages(scenario, setup, robots, obstacles)
    bodies = bodies_of(scenario)
    sizes = {
        "robot": len(robots.mass),
        "axis": scenario.axes,
        "obstacle": len(setup.obstacle_radius),
        "behavior": len(setup.kinds),
        "coordinate": robots.coordinates + len(setup.movers) * scenario.axes,
        "group": len(bodies.watched),
    }
    sizes |= truth_sizes(scenario.axes, scenario.recording.truth, setup.has_lyapunov)
    watches = watches_of(scenario.expect)
    if seen is not None:  # of all else the log knows no more than at its own times
        watches = tuple(watch for watch in watches if PLAYED.issuperset(watch.course.signals))
    slots = setup.radio.senders(setup.count).shape[1] if setup.radio is not None else 0
    lidar = setup.sensing.lidar
    rays = len(lidar.rays) if lidar is not None and lidar.recorded else 0
    sizes |= channel_sizes(
        setup.driven, setup.headed, setup.informed, scenario.axes, slots, rays, len(setup.opponents),
        len(setup.teams), len(setup.movers), resized=bool(setup.radii), watches=len(watches),
        memories=len(setup.memory), readings=len(readings_of(setup.sensing.own, setup.axes)),
    )  # fmt: skip
    schedule = schedule_of(scenario, seen.edges if seen is not None else ())
    return Draft(scenario, robots, setup, obstacles, stages, bodies, schedule, sizes, watches)


def _plan(draft: Draft, solids: Solids) -> Array:
    """Return the controller's parameters as one flat vector."""
    truth, sizes, schedule = draft.scenario.recording.truth, draft.sizes, draft.schedule
    record = record_size(sizes)
    return pack(
        draft.setup,
        schedule.stride,
        sizes["coordinate"],
        truth,
        sizes["group"],
        draft.bodies.columns,
        (0 if truth else samples_kept(record), record),  # truth needs Python at every sample
        schedule.extra,
        np.where(solids.several, -FAR_AWAY, draft.setup.robot_radius) if solids.any else None,
        _exact_within(draft.scenario) if solids.any else 0.0,
        len(draft.watches),
        asked_of(draft.watches, sizes),
    )


def _add_bodies(tree: Element, draft: Draft) -> None:
    """Add all that can be touched; robots come before every other body."""
    scenario, stages, count = draft.scenario, draft.stages, len(draft.robots.mass)
    radius = scenario.mission.radius
    if scenario.axes == 2:
        set_floor(tree, scenario.environment)
    add_assets(tree, models_of(draft.robots))
    setup = draft.setup
    teams = [palette.team_color(int(number)) for number in setup.members] if setup.teams else []
    add_robots(tree, draft.robots, gravity_of(scenario), stages, radius, teams or palette.robot_colors(count))
    add_obstacles(tree, draft.obstacles, stages, count, radius)
    add_target(tree, scenario, draft.setup.target.position(0.0), stages, count)


def _add_cameras(tree: Element, draft: Draft) -> None:
    """Add cameras that see all that happens; in planar missions from the floor to the highest top."""
    scenario, (low, high) = draft.scenario, corners(draft.stages)
    if scenario.axes == 2:
        tops = [draft.robots.radius.max(), _target_radius(scenario), *map(_above, draft.obstacles)]
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


def _compile(tree: Element, draft: Draft, assets: dict[str, bytes], solids: Solids) -> mujoco.MjModel:
    """Compile a tree, and wire it to the controller."""
    movers, faces = len(draft.setup.movers), faces_of(draft.obstacles)
    gravity, names = gravity_of(draft.scenario), draft.bodies.names
    return compile_addressed(tree, draft.robots, gravity, draft.stages, names, movers, faces, assets, solids)


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


def _stages(scenario: Scenario, setup: Setup, robots: Placement, bodies: Sequence[Body]) -> list[Stage]:
    """Where the axes of the mission are in the world; planar missions happen at one height."""
    samples = PATH_SAMPLES if scenario.target is not None else 0
    path = setup.target.position(np.linspace(0.0, scenario.duration, samples))
    reach = max(scenario.mission.radius + robots.radius.max(), _target_radius(scenario))
    around = np.concatenate([np.full(len(path), reach), robots.radius])[:, None]
    centers = np.vstack([path, robots.position])
    sent, largest = setup.destinations(scenario.duration), robots.radius.max()
    corners = [corner for body in bodies for corner in body.corners(scenario.axes)]
    moments = np.linspace(0.0, scenario.duration, PATH_SAMPLES)
    corners += [mover.path.position(moments) for mover in setup.movers if mover.obstacle >= 0]
    changing = any(one.escorts for one in setup.teams)
    for one in setup.teams:
        ways = [mover.path.position(moments) for mover in setup.movers if mover.obstacle in one.targets]
        reach = max(one.all_radii) + robots.radius.max()
        for middle in ways if changing else [np.mean(ways, axis=0)]:
            corners += [middle - reach, middle + reach]
    every = np.vstack([centers - around, centers + around, sent - largest, sent + largest, *corners])
    low, high = every.min(axis=0), every.max(axis=0)
    height = robots.height if scenario.axes == 2 else 0.0
    return stages_of(low, high, height, scenario.mission.radius, robots.radius.max(), len(robots.mass))


__all__ = ["Seen", "World", "build"]
