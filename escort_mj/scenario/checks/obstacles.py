"""Checks of obstacles, walls, clutter and surroundings: sizes that suit shapes, doors that are in walls."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

import numpy as np

from escort_mj.errors import ScenarioError
from escort_mj.scenario.findings import Finding, Path, listed
from escort_mj.scenario.geometry.obstacles import SIZES, fixed_obstacles, sizes
from escort_mj.scenario.geometry.shapes import hull
from escort_mj.scenario.geometry.teams import team_targets
from escort_mj.scenario.geometry.walls import LEAST
from escort_mj.scenario.mission import Mission
from escort_mj.scenario.schema.obstacle_tables import Drive, Obstacle, Wall
from escort_mj.scenario.schema.scenario import Scenario

THINNEST = 1e-3  # m, as the radius of a body
SHARPEST = math.radians(150.0)  # turn of a wall


def check_obstacles(mission: Mission) -> Iterator[Finding]:
    """Each obstacle is somewhere and has what its shape needs, and nothing else."""
    scenario = mission.scenario
    for index, obstacle in enumerate(scenario.obstacles):
        path: Path = ("obstacles", index)
        if obstacle.motion is None:
            if obstacle.position is None:
                yield Finding((*path, "position"), "is missing: center, one number per axis [m]")
            if obstacle.body is not None:
                yield Finding((*path, "body"), "moves nothing: the obstacle has no motion")
        elif obstacle.position is not None:
            yield Finding((*path, "position"), "found both position and motion; motion says where it is")
        if obstacle.body is not None:
            yield from check_drive(scenario, obstacle.body, (*path, "body"))
        if scenario.axes > 3 and (obstacle.shape != "sphere" or obstacle.motion is not None):
            yield Finding(
                (*path, "shape" if obstacle.shape != "sphere" else "motion"),
                f"found in {scenario.axes} axes; there only spheres that stand still are obstacles",
            )
        else:
            yield from _check_size(scenario, obstacle, path)


def check_drive(scenario: Scenario, drive: Drive, path: Path) -> Iterator[Finding]:
    """A drive that its timestep can follow."""
    most = 1.0 / scenario.physics.timestep
    if drive.gain > most:
        yield Finding(
            (*path, "gain"),
            f"found {drive.gain:g} 1/s; expected at most {most:g}, one over physics.timestep",
            related=(path,),
        )


def _check_size(scenario: Scenario, obstacle: Obstacle, path: Path) -> Iterator[Finding]:
    shape, found = obstacle.shape, []
    wanted = {"sphere": "radius", "mesh": "vertices"}.get(shape, "size")
    for key in ("radius", "size", "vertices"):
        if key != wanted and getattr(obstacle, key) is not None:
            found.append(Finding((*path, key), f"is not a key of a {shape}; expected {wanted}"))
    if not found and wanted != "radius" and getattr(obstacle, wanted) is None:
        found.append(Finding((*path, wanted), f"is missing: {wanted} of a {shape} [m]"))
    yield from found
    if found:
        return
    if obstacle.size is not None:
        full, planar = SIZES[shape], scenario.axes == 2 and shape != "capsule"
        allowed = [full - 1, full] if planar else [full]
        if len(obstacle.size) not in allowed:
            yield Finding(
                (*path, "size"),
                f"found {len(obstacle.size)} numbers; a {shape} has {listed([str(k) for k in allowed])}",
            )
    if obstacle.vertices is not None and all(len(corner) == scenario.axes for corner in obstacle.vertices):
        try:
            hull(tuple(map(tuple, sizes(obstacle, scenario.axes, scenario.robots.height)[1])))
        except ValueError:
            yield Finding((*path, "vertices"), "span no body: they lie in one line or plane")
            return
        corners = np.array(obstacle.vertices)
        _, _, directions = np.linalg.svd(corners - corners.mean(axis=0))
        if (thin := float(np.ptp(corners @ directions[-1]))) < THINNEST:
            words = f"span a body that is {thin:.3g} m thin; expected at least {THINNEST:g} m"
            yield Finding((*path, "vertices"), words)


def check_walls(mission: Mission) -> Iterator[Finding]:
    """Walls that go somewhere, with doors inside them."""
    scenario = mission.scenario
    for index, wall in enumerate(scenario.walls):
        path: Path = ("walls", index)
        if scenario.axes > 3:
            yield Finding(
                path, f"found in {scenario.axes} axes; there only spheres that stand still are obstacles"
            )
            continue
        if any(len(point) != scenario.axes for point in wall.points):
            continue
        points = np.array(wall.points, dtype=float)
        if scenario.axes == 3 and np.ptp(points[:, 2]) > 0.0:
            yield Finding(
                (*path, "points"), "found a foot at more than one height; expected the same z for all"
            )
        if scenario.axes == 2 and wall.height <= scenario.robots.height:
            yield Finding(
                (*path, "height"),
                f"found {wall.height:g} m, below the robots' centers; expected more than "
                f"{scenario.robots.height:g} m",
            )
        legs = np.diff(points[:, :2], axis=0)
        lengths = np.linalg.norm(legs, axis=1)
        if (lengths <= LEAST).any():
            yield Finding((*path, "points", int(np.argmin(lengths)) + 1), "is where the point before it is")
            continue
        along = legs / lengths[:, np.newaxis]
        turns = np.arccos(np.clip((along[1:] * along[:-1]).sum(axis=1), -1.0, 1.0))
        if len(turns) and turns.max() > SHARPEST:
            yield Finding(
                (*path, "points", int(np.argmax(turns)) + 1),
                f"turns by {math.degrees(turns.max()):.0f} degrees; expected at most "
                f"{math.degrees(SHARPEST):.0f}",
            )
        elif wall.corridor is not None and len(turns):
            short = 0.5 * (wall.corridor + wall.thickness) * np.tan(0.5 * turns)
            if (lengths[1:] <= short).any() or (lengths[:-1] <= short).any():
                yield Finding(
                    (*path, "corridor"), f"found {wall.corridor:g} m; its turns need longer stretches"
                )
        yield from _check_doors(scenario, wall, lengths, path)


def _check_doors(scenario: Scenario, wall: Wall, lengths: np.ndarray, path: Path) -> Iterator[Finding]:
    starts = np.concatenate([[0.0], np.cumsum(lengths)])
    taken: list[tuple[float, float, int]] = []
    for number, door in enumerate(wall.doors):
        place: Path = (*path, "doors", number)
        low, high = door.at - 0.5 * door.width, door.at + 0.5 * door.width
        leg = max(int(np.searchsorted(starts, door.at, side="right")) - 1, 0)
        if leg >= len(lengths) or low < starts[leg] - 1e-9 or high > starts[leg + 1] + 1e-9:
            stretches = listed([f"{a:g} to {b:g} m" for a, b in zip(starts, starts[1:], strict=False)])
            yield Finding(
                place, f"reaches from {low:g} to {high:g} m; expected within {stretches} of the wall"
            )
        for other_low, other_high, other in taken:
            if low < other_high and other_low < high:
                yield Finding(place, f"overlaps doors[{other}]")
        taken.append((low, high, number))
        if scenario.axes == 2 and (door.sill > 0.0 or door.height is not None):
            yield Finding(
                (*place, "sill" if door.sill > 0.0 else "height"),
                "is for axes 3; in the plane doors are open to the sky",
            )
        if door.sill + (door.height or 0.0) > wall.height:
            yield Finding(
                place, f"reaches {door.sill + (door.height or 0.0):g} m high; the wall has {wall.height:g} m"
            )


def check_environment(mission: Mission) -> Iterator[Finding]:
    """Floor and slope where there is a floor, and a medium where there is space."""
    environment, axes = mission.scenario.environment, mission.scenario.axes
    if axes != 2 and environment.slope.angle > 0.0:
        yield Finding(
            ("environment", "slope", "angle"), f"found a slope in {axes} axes; a floor takes axes 2"
        )
    medium = environment.medium
    if axes > 3 and (medium.density > 0.0 or medium.viscosity > 0.0):
        yield Finding(
            ("environment", "medium"), f"found a medium in {axes} axes; MuJoCo's drag takes axes 2 or 3"
        )
    if medium.wind is not None and any(medium.wind) and not (medium.density or medium.viscosity):
        yield Finding(
            ("environment", "medium", "wind"), "blows with no density and no viscosity: it has no force"
        )


def check_clutter(mission: Mission) -> Iterator[Finding]:
    """Clutter that robots fit through, and room for it."""
    scenario = mission.scenario
    clutter = scenario.clutter
    if clutter is None:
        return
    if scenario.axes > 3:
        yield Finding(("clutter",), f"found in {scenario.axes} axes; give single spheres")
        return
    if any(low >= high for low, high in zip(clutter.low, clutter.high, strict=True)):
        yield Finding(
            ("clutter", "high"), f"found {list(clutter.high)} m; expected more than low along each axis"
        )
        return
    if clutter.least_radius > clutter.largest_radius:
        yield Finding(
            ("clutter", "largest_radius"),
            f"found {clutter.largest_radius:g} m; expected at least least_radius, {clutter.least_radius:g} m",
            related=(("clutter", "least_radius"),),
        )
        return
    radius = scenario.robots.largest_radius
    if clutter.passage <= 2.0 * radius:
        yield Finding(
            ("clutter", "passage"),
            f"found {clutter.passage:g} m; expected more than a robot's diameter, {2.0 * radius:g} m",
            related=(("clutter",),),
        )
        return
    try:
        _ = mission.obstacles
    except ScenarioError as error:
        yield from (Finding(("clutter",), fault.message) for fault in error.faults)


def check_obstacle_names(mission: Mission) -> Iterator[Finding]:
    """No two obstacles of one name, and none with a name that the world has for something else."""
    scenario = mission.scenario
    seen: dict[str, Path] = {}
    bodies = fixed_obstacles(scenario) if scenario.clutter is None else mission.obstacles
    named: list[tuple[str, Path]] = [(body.name, body.path) for body in (*bodies, *team_targets(scenario))]
    groups = {group.name: (place, group) for place, group in reversed([*enumerate(scenario.opponents)])}
    for place, group in groups.values():  # two of one name are said elsewhere
        named += [(name, ("opponents", place)) for name in group.names]
    for name, body in named:
        path = (*body, "name")
        if name in ("target", "world", "floor", "robots", "obstacles", "walls") or re.fullmatch(
            r"robot_\d+|.*_shadow_\d+", name
        ):
            yield Finding(path, f"found {name}; robots, target and world have theirs")
        if name in seen and seen[name] != path:
            where = "".join(f"[{key}]" if isinstance(key, int) else str(key) for key in seen[name][:-1])
            yield Finding(path, f"found {name} again; {where} has it")
        seen.setdefault(name, path)
