"""What is asked of a kind of robots."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj.components.mission import axis_names
from escort_mj.conformance.missions import AXES, mission_with
from escort_mj.conformance.stand import ROUNDING, CheckResult
from escort_mj.robots import RobotKind
from escort_mj.scenario.mission import Mission
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import World, build
from escort_mj.world.plant import Plant

Array = NDArray[np.float64]

PUSHED = 0.5  # s, enough for a robot that has to turn its thrust first


def check_kind(member: type[RobotKind], kind: type[Scenario]) -> Iterator[CheckResult]:
    """Check a kind of robots: its body, where it is, and what it weighs.

    Args:
        member: The kind.
        kind: The type of scenarios that knows it.
    """
    axes = [each for each in AXES if each <= member.most_axes]
    worlds = [build(Mission(mission_with(member, kind, each), outside="force")) for each in axes]
    yield CheckResult("builds", True, f"in {' and '.join(map(str, axes))} axes")
    yield _stands(worlds)
    yield _obeys(worlds)
    yield _weighs(worlds)
    yield _clear_of_floor(worlds)


def _stands(worlds: list[World]) -> CheckResult:
    """Hulls are where robots are told to be."""
    for world in worlds:
        axes, data = world.setup.axes, mujoco.MjData(world.model)
        mujoco.mj_forward(world.model, data)
        for i, position in enumerate(world.team.position):
            off = float(np.abs(data.body(f"robot_{i + 1}").xpos[:axes] - position).max())
            if off > ROUNDING:
                return CheckResult("place", False, f"robot {i + 1} is {off:.3g} m off where it is told to be")
    return CheckResult("place", True, "hulls are where they are told to be")


def _obeys(worlds: list[World]) -> CheckResult:
    """A force along an axis, given in place of the law's, moves robots along that axis."""
    for world in worlds:
        axes = world.setup.axes
        free = _after(world, np.zeros(axes))
        for axis, force in enumerate(np.eye(axes)):
            moved = (_after(world, force) - free)[:, axis]
            if not (moved > 0.0).all():
                name = axis_names(axes)[axis]
                return CheckResult(
                    "pushes",
                    False,
                    f"in {axes} axes, a force along {name} does not push it along {name}",
                )
    return CheckResult("pushes", True, "motors push along their axes")


def _after(world: World, force: Array) -> Array:
    """Positions of hulls a while after the start under one force on each robot, shape (n, p) [m].

    Args:
        world: Built for forces from outside.
        force: Shape (p,) [N].
    """
    plant = Plant(world)
    plant.state.tau[:] = force
    with native_loop(world):
        plant.step(round(PUSHED / world.setup.timestep))
    return plant.state.q.copy()


def _weighs(worlds: list[World]) -> CheckResult:
    """All of a robot has its mass, and what `burden` says it carries."""
    for world in worlds:
        for i, (mass, kind) in enumerate(zip(world.team.mass, world.team.kind, strict=True)):
            body = world.model.body(f"robot_{i + 1}").id
            found = float(world.model.body_subtreemass[body])
            if abs(found - mass - kind.burden()) > 1e-6 * found:
                told = f"{mass:g} kg and a burden of {kind.burden():g} kg"
                return CheckResult("mass", False, f"weighs {found:.4g} kg; told are {told}")
    return CheckResult("mass", True, f"its mass, and a burden of {worlds[0].team.kind[0].burden():g} kg")


def _clear_of_floor(worlds: list[World]) -> CheckResult:
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
                    return CheckResult(
                        "clear of the floor", False, f"{name} is {-gap:.3g} m in it: see height()"
                    )
    return CheckResult("clear of the floor", True, "nothing of it is in the floor of planar missions")
