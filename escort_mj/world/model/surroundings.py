"""What surrounds the robots in MuJoCo: obstacles and walls, the target, the floor and the medium."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from xml.etree.ElementTree import Element, SubElement

import numpy as np
from numpy.typing import NDArray

from escort_mj import palette
from escort_mj.mjcf import child_named, copied, section, set_attributes
from escort_mj.policies import Policy
from escort_mj.scenario.geometry.obstacle_body import Body
from escort_mj.scenario.schema.environment import Environment
from escort_mj.scenario.schema.obstacle_tables import Drive
from escort_mj.scenario.schema.robots import Tether
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.world.model.parts import load_part
from escort_mj.world.stages import THIN, Stage

Array = NDArray[np.float64]

TETHER = 0.015  # radius to draw [m]
HIDDEN = 5  # group of what is not drawn
AXIS = {"x": [1.0, 0.0, 0.0], "y": [0.0, 1.0, 0.0], "z": [0.0, 0.0, 1.0]}


def add_obstacles(
    tree: Element, bodies: Sequence[Body], stages: Sequence[Stage], count: int, radius: float
) -> None:
    """The bodies of obstacles and walls, one of each for each stage.

    Args:
        tree: MJCF tree.
        bodies: What stands in the way.
        stages: Where the axes of the mission are.
        count: Number of robots.
        radius: Distance to keep from the target [m].
    """
    part, world = child_named(load_part("obstacle"), "body", "obstacle"), section(tree, "worldbody")
    for body in bodies:
        rgba = [*(palette.NAMED[body.color] if body.color else palette.OBSTACLE), 1.0]
        for stage in stages:
            name = body.name + stage.suffix
            copy = copied(part, name)
            world.append(copy)
            set_attributes(copy, pos=stage.place(body.position) + [0.0, 0.0, body.lift])
            geom = child_named(copy, "geom", f"{name}_body")
            set_attributes(geom, rgba=rgba, group=stage.number)
            if stage.is_abacus:  # a band across all columns: this far the obstacle reaches along the axis
                size = [stage.width(count) / 2, THIN * radius, body.bounding_radius]
                set_attributes(geom, type="box", size=size, rgba=[*rgba[:3], 0.3])
            elif body.shape == "mesh":
                mesh = SubElement(section(tree, "asset"), "mesh", name=name, inertia="exact")
                set_attributes(mesh, vertex=body.vertices.ravel())
                del geom.attrib["size"]
                set_attributes(geom, type="mesh", mesh=name, quat=body.orientation)
            else:
                set_attributes(geom, type=body.shape, size=body.size, quat=body.orientation)
            if body.drive is not None:
                _set_free(copy, geom, name, body.drive, body.policy, stage, body.position)


def add_target(tree: Element, scenario: Scenario, start: Array, stages: Sequence[Stage], count: int) -> None:
    """The bodies of the target, one for each stage; without a target, places for cameras that touch nothing.

    Args:
        tree: MJCF tree.
        scenario: Gives its size and drive, and the mission's radius.
        start: Its position at the start, shape (p,) [m].
        stages: Where the axes of the mission are.
        count: Number of robots.
    """
    part, world = child_named(load_part("target"), "body", "target"), section(tree, "worldbody")
    radius = scenario.mission.radius
    for stage in stages:
        name = f"target{stage.suffix}"
        body = copied(part, name, skip=("follow",) if stage.suffix else ())
        world.append(body)
        set_attributes(body, pos=stage.place(start))
        geom = child_named(body, "geom", f"{name}_body")
        if scenario.target is None:
            body.remove(geom)
            continue
        set_attributes(geom, size=scenario.target.radius, rgba=[*palette.TARGET, 1.0], group=stage.number)
        if scenario.target.drive is not None:
            del body.attrib["mocap"]
            will = scenario.target.policy
            _set_free(body, geom, name, scenario.target.drive, will, stage, start)
        if stage.is_abacus:  # bars across all columns: at the target, and as far from it as robots can be
            half = stage.width(count) / 2
            set_attributes(geom, type="box", size=[half, THIN * radius, THIN * radius])
            for side in (-1.0, 1.0):
                set_attributes(
                    SubElement(body, "geom"), type="box", pos=[0.0, 0.0, side * radius],
                    rgba=[*palette.LIMIT, 0.6], size=[half, THIN * radius / 2, THIN * radius / 2],
                    group=stage.number,
                )  # fmt: skip
        elif stage.suffix:
            rgba = [*palette.LIMIT, 0.08]
            set_attributes(
                SubElement(body, "geom"), type="sphere", size=radius, rgba=rgba, group=stage.number
            )


def _set_free(
    body: Element, geom: Element, name: str, drive: Drive, policy: Policy | None, stage: Stage, start: Array
) -> None:
    """Let a body slide along the mission's axes, with its mass; its weight is borne."""
    set_attributes(geom, mass=drive.mass_of(policy))
    set_attributes(body, gravcomp=1.0)
    for axis, value in zip(stage.directions, start[stage.axes], strict=True):
        joint = SubElement(body, "joint", name=f"{name}_{axis}")
        set_attributes(joint, type="slide", axis=AXIS[axis], ref=value)
        if drive.drag > 0.0:
            set_attributes(joint, damping=drive.drag)


def set_floor(tree: Element, environment: Environment) -> None:
    """The floor and its friction, which rules whatever touches it."""
    floor = environment.floor
    geom = copied(child_named(load_part("floor"), "geom", "floor"), "floor")
    section(tree, "worldbody").append(geom)
    set_attributes(geom, friction=[floor.friction, 0.005, floor.rolling_friction], priority=1)
    if floor.rolling_friction > 0.0:
        set_attributes(geom, condim=6)


def set_medium(tree: Element, environment: Environment, own: Collection[Element] = ()) -> None:
    """The medium, whose drag acts on every geom as on the ellipsoid that is as large.

    Args:
        tree: MJCF tree.
        environment: Says what it is.
        own: Geoms of robots that are models: drag acts on the boxes that are as heavy as their bodies.
    """
    medium = environment.medium
    if medium.density == 0.0 and medium.viscosity == 0.0:
        return
    wind = np.zeros(3)
    wind[: len(medium.wind or ())] = medium.wind or ()
    set_attributes(section(tree, "option"), density=medium.density, viscosity=medium.viscosity, wind=wind)
    for body in tree.iter("body"):
        for geom in body.findall("geom"):
            if geom not in own:
                geom.set("fluidshape", "ellipsoid")


def add_tethers(tree: Element, tethers: Sequence[Tether]) -> None:
    """Tendons between the centers of bodies: cables pull where they are stretched, springs push as well."""
    world = section(tree, "worldbody")
    for number, tether in enumerate(tethers, 1):
        tendon = SubElement(section(tree, "tendon"), "spatial", name=f"tether_{number}")
        set_attributes(tendon, width=TETHER, rgba=[*palette.OBSTACLE, 1.0], damping=tether.damping)
        rest = [tether.length] * 2 if tether.pushes else [0.0, tether.length]
        if tether.stiffness is None:
            set_attributes(tendon, limited="true", range=rest)
        else:
            set_attributes(tendon, springlength=rest, stiffness=tether.stiffness)
        for end in tether.between:
            name = end if end == "target" else f"robot_{end}"
            hull = child_named(world, "geom", f"{name}_body")
            body = next(each for each in world.iter("body") if hull in each)
            site = SubElement(body, "site", name=f"tether_{number}_{name}", pos=hull.get("pos", "0 0 0"))
            set_attributes(site, size=TETHER, group=HIDDEN)
            SubElement(tendon, "site", site=site.attrib["name"])
