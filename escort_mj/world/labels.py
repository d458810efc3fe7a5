"""What a trace says of its mission beside its signals: names, masses, radii, formation, versions."""

from __future__ import annotations

import platform
from functools import cache
from typing import Any

import mujoco
import numpy as np

from escort_mj.behaviors.behavior import Plane
from escort_mj.components.movers import kept_by
from escort_mj.components.setup import MissionSetup
from escort_mj.errors import PluginError
from escort_mj.native.levels import level
from escort_mj.native.shipped import numba_version
from escort_mj.record.revision import git_revision
from escort_mj.scenario.geometry.crowd import contact_physics
from escort_mj.scenario.geometry.shapes import outline
from escort_mj.scenario.mission import Mission
from escort_mj.scenario.reader.catalog import catalog_of
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.sensing.sensors import readings_of
from escort_mj.signals import SEVERAL
from escort_mj.version import __version__
from escort_mj.world.model.build import World
from escort_mj.world.stages import IN_SPACE

FORCES = "MuJoCo's, and 0 where geometry alone finds a touch: of a led target with what stands"
NO_FORCES = "none: beyond three axes bodies go through one another, and forces of episodes are 0"


def _outlines(mission: Mission) -> list[list[list[float]]]:
    """Points around each obstacle, relative to its center, for pictures; none where all are spheres."""
    bodies = mission.obstacles
    if all(body.is_sphere for body in bodies):
        return []
    return [outline(body.solid, mission.scenario.axes).tolist() for body in bodies]


def _borders(setup: MissionSetup) -> dict[tuple[str, Plane], None]:
    """The lines or planes that robots do not cross, each once, with the name of the behavior.

    Raises:
        PluginError: If a plugin's has another number of axes.
    """
    found: dict[tuple[str, Plane], None] = {}
    for behavior in setup.all_behaviors:
        if (border := behavior.border()) is None:
            continue
        if {len(border.point), len(border.normal)} != {setup.axes}:
            words = f"border returned {border}; the mission has {setup.axes} axes"
            raise PluginError(f"the behavior {behavior.behavior}: {words}")
        found[behavior.behavior, Plane(tuple(border.point), tuple(border.normal))] = None
    return found


def labels_of(scenario: Scenario, world: World) -> dict[str, Any]:
    """What the trace says of the mission beside its signals, and what it was made with."""
    facts = facts_of(scenario, world)
    plugins = {f"version_plugin_{each.name}": each.identity for each in catalog_of(scenario).plugins}
    facts["attributes"] |= {**_versions(), **plugins, "version_git_revision": git_revision()}
    return facts


def facts_of(scenario: Scenario, world: World) -> dict[str, Any]:
    """What the trace says of the mission beside its signals."""
    obstacles = [body.name for body in world.mission.obstacles]
    setup, memories = world.setup, world.setup.memory
    readings = readings_of(setup.sensing.own, setup.axes)
    movers = ["target" if mover.obstacle < 0 else obstacles[mover.obstacle] for mover in setup.movers]
    kept = {
        f"{name}.{mover.policy.policy}.{value}": unit
        for name, mover, values in zip(movers, setup.movers, kept_by(setup), strict=True)
        for value, unit in values.items()
    }
    tethers = scenario.robots.tethers
    (neighbors, spacing), lidar = setup.edges, setup.sensing.lidar
    edge_team = setup.members[neighbors[:, 0]]
    avoids = (behavior.avoidance(setup) for behavior in setup.behaviors)
    avoid = next(filter(None, avoids), None)
    borders = _borders(setup)
    return {
        "bodies": world.bodies.names,
        "body_groups": world.bodies.groups,
        "body_motions": world.bodies.motions,
        "body_shapes": world.shapes,
        "body_thickness": world.thickness.tolist(),
        "groups": world.bodies.watched,
        "obstacles": obstacles,
        "behaviors": setup.kinds,
        "robot_mass": world.team.mass.tolist(),
        "robot_radius": setup.robot_radius.tolist(),
        "obstacle_radius": setup.obstacle_radius.tolist(),
        "obstacle_outline": _outlines(world.mission),
        "lidar_ray": lidar.directions(setup.axes).tolist() if lidar is not None and lidar.record else [],
        "borders": [name for name, _ in borders],
        "border_point": [plane.point for _, plane in borders],
        "border_normal": [plane.normal for _, plane in borders],
        "force_limit": setup.force_limit.tolist(),
        "neighbors": (neighbors + 1).tolist(),
        "spacing": spacing.tolist(),
        "teams": [team.name for team in setup.teams],
        "edge_radius": [
            setup.radii_of(setup.teams[team])[0] if setup.teams else setup.radius for team in edge_team
        ],
        "edge_team": [int(team) + 1 for team in edge_team] if setup.teams else [],
        "watches": [watch.label for watch in world.mission.watches],
        "memories": [*memories],
        "memory_units": [memory.unit for memory in memories.values()],
        "memory_truths": [memory.truth for memory in memories.values()],
        "readings": [*readings],
        "reading_units": [*readings.values()],
        "policy_values": [*kept],
        "policy_units": [*kept.values()],
        "movers": movers,
        "attributes": {
            "title": scenario.name,
            "description": scenario.description,
            "law": scenario.law_names,
            "seed": scenario.seed,
            "timestep": scenario.physics.timestep,
            "contact_physics": str(contact_physics(scenario)),
            "contact_forces": FORCES if scenario.axes <= IN_SPACE else NO_FORCES,
            **_surroundings(world),
            "mission_radius": _size(scenario, world),
            "phases": ", ".join(
                ["mission", *(phase.name or f"phase_{k}" for k, phase in enumerate(setup.phases, 1))]
            ),
            "tethers": [end if end != "target" else 0 for each in tethers for end in each.between] or None,
            "tether_length": [each.length for each in tethers] or None,
            "tether_stiffness": [each.stiffness or 0.0 for each in tethers] or None,
            "goal_reach": next(filter(None, (b.arrives_within for b in setup.all_behaviors)), 0.0),
            "safe_distance": avoid.safe_distance if avoid else 0.0,
            "safe_distance_measure": ("surface" if avoid.to_surface else "center") if avoid else "none",
            **_limits(scenario, max(avoid.teammate_distance, avoid.heard_distance) if avoid else 0.0),
            "target_distance": (setup.outer.target_margin(setup) if avoid else 0.0) or None,
            "height": world.team.height if scenario.axes == 2 else 0.0,
            "exact_within": world.mission.exact_within if SEVERAL in world.sizes else None,
            "target_radius": scenario.target.radius if scenario.target is not None else 0.0,
            "target_speed": next((m.policy.speed for m in setup.movers if m.obstacle < 0 and m.policy), None),
            "least_energy": (setup.least_energies if scenario.target is not None or setup.teams else None)
            or None,
            "commanded": setup.outside,
        },
    }


def _limits(scenario: Scenario, teammate_distance: float) -> dict[str, float]:
    """How near teammates may come [m], how fast robots are led [m/s] and how far they see [m], if at all."""
    seen = scenario.sensing.radius
    known = {
        "teammate_distance": teammate_distance, "max_speed": scenario.mission.max_speed,
        "sensing_robots": seen.robots, "sensing_obstacles": seen.obstacles,
    }  # fmt: skip
    return {name: value for name, value in known.items() if value is not None}


def _size(scenario: Scenario, world: World) -> float:
    """Distance to keep from the target; without one, how far starts and goals are from their middle [m]."""
    if scenario.target is not None:
        return scenario.mission.radius
    places = np.vstack([world.team.position, world.setup.destinations(scenario.duration)])
    middle = 0.5 * (places.min(axis=0) + places.max(axis=0))
    return float(max(np.linalg.norm(places - middle, axis=1).max(), 4.0 * world.team.radius.max()))


@cache
def _versions() -> dict[str, str]:
    """What took part in a run, asked of the installation once for a process."""
    return {
        "version_escort_mj": __version__,
        "version_mujoco": str(mujoco.__version__),
        "version_numpy": np.__version__,
        "version_numba": numba_version(),
        "version_python": platform.python_version(),
        "version_platform": platform.platform(),
        "version_processor": level().name,
    }


def _surroundings(world: World) -> dict[str, float]:
    """How strong gravity [m/s^2] and wind [m/s] are, and the mass of all robots with what they carry [kg]."""
    model = world.model
    roots = [model.body(root).name for root in model.body_rootid]
    ours = [name.startswith("robot_") for name in roots]
    return {
        "gravity": float(np.linalg.norm(model.opt.gravity)),
        "wind": float(np.linalg.norm(model.opt.wind)),
        "robots_mass": float(model.body_mass[ours].sum()),
    }
