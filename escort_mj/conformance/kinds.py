"""What is asked of a kind of robots."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np

from escort_mj.conformance.missions import AXES, mission_with
from escort_mj.conformance.stand import ROUNDING, Row
from escort_mj.scenario.schema.kinds import RobotKind
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.world.model.build import World, build


def check_kind(member: type[RobotKind], kind: type[Scenario]) -> Iterator[Row]:
    """Checks a kind of robots: its body, where it is, and what it weighs.

    Args:
        member: The kind.
        kind: The type of scenarios that knows it.
    """
    axes = [each for each in AXES if each <= member.most_axes]
    worlds = [build(mission_with(member, kind, each)) for each in axes]
    yield Row("builds", True, f"in {' and '.join(map(str, axes))} axes")
    yield from _stands(worlds)
    yield _weighs(worlds)
    yield _clear_of_floor(worlds)


def _stands(worlds: list[World]) -> Iterator[Row]:
    """Hulls are where robots are told to be, and motors push them along their axes."""
    for world in worlds:
        axes, data = world.setup.axes, mujoco.MjData(world.model)
        mujoco.mj_forward(world.model, data)
        for i, position in enumerate(world.team.position):
            off = float(np.abs(data.body(f"robot_{i + 1}").xpos[:axes] - position).max())
            if off > ROUNDING:
                yield Row("place", False, f"robot {i + 1} is {off:.3g} m off where it is told to be")
                return
        data.ctrl[:] = 0.0
        data.ctrl[0] = 1.0
        free = data.qacc.copy()
        mujoco.mj_forward(world.model, data)
        if not data.qacc[0] - free[0] > 0.0:
            yield Row("pushes", False, "the motor x does not push the robot along x")
            return
    yield Row("place", True, "hulls are where they are told to be")
    yield Row("pushes", True, "motors push along their axes")


def _weighs(worlds: list[World]) -> Row:
    """All of a robot has its mass, and what `burden` says it carries."""
    for world in worlds:
        for i, (mass, kind) in enumerate(zip(world.team.mass, world.team.kind, strict=True)):
            body = world.model.body(f"robot_{i + 1}").id
            found = float(world.model.body_subtreemass[body])
            if abs(found - mass - kind.burden()) > 1e-6 * found:
                told = f"{mass:g} kg and a burden of {kind.burden():g} kg"
                return Row("mass", False, f"weighs {found:.4g} kg; told are {told}")
    return Row("mass", True, f"its mass, and a burden of {worlds[0].team.kind[0].burden():g} kg")


def _clear_of_floor(worlds: list[World]) -> Row:
    """In planar missions nothing of it is in the floor."""
    for world in worlds:
        if world.setup.axes != 2:
            continue
        data = mujoco.MjData(world.model)
        mujoco.mj_forward(world.model, data)
        floor = world.model.geom("floor").id
        for geom, body in enumerate(world.model.geom_bodyid):
            if world.model.body(world.model.body_rootid[body]).name == "robot_1":
                gap = mujoco.mj_geomDistance(world.model, data, geom, floor, 10.0, None)
                if gap < -ROUNDING:
                    name = world.model.geom(geom).name
                    return Row("clear of the floor", False, f"{name} is {-gap:.3g} m in it: see height()")
    return Row("clear of the floor", True, "nothing of it is in the floor of planar missions")
