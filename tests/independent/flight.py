"""An independent watcher: flies a scenario with plain MuJoCo and finds distances and touches in NumPy.

It shares with escort_mj the world that is built and the law that moves the robots, nothing of what watches
them: every physics step is recorded, and every distance computed from the shapes of the model in float64.
What counts is written in docs/verdicts.md and docs/keys.md.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import build
from tests.independent import motions, shapes

Array = NDArray[np.float64]
Pair = tuple[int, int]
"""Two bodies as places in `Flight.names`, the smaller one first."""

BARELY = 1e-9  # of a step: rounding in a time that stands for a step [s]
GEOM = mujoco.mjtGeom


@dataclass(frozen=True)
class Touch:
    """One unbroken touch: its bodies, its first and its last physics step, and its greatest depth [m]."""

    pair: Pair
    first: int
    last: int
    depth: float


@dataclass
class Flight:
    """Every physics step of a mission.

    Attributes:
        scenario: What was flown.
        names: Of the bodies but for the floor.
        groups: Group of each.
        times: Of the physics steps, shape (k,) [s].
        centers: Of each body, shape (k, bodies, p or 3) [m]; the target's as the scenario says.
        shown: Where MuJoCo had the target, shape (k, p or 3) [m].
        touched: Depth of what MuJoCo found touching in each step, by pair [m].
        model: The model.
    """

    scenario: Scenario
    names: tuple[str, ...]
    groups: tuple[str, ...]
    times: Array
    centers: Array
    shown: Array
    touched: list[dict[Pair, float]]
    model: mujoco.MjModel = field(repr=False)
    _distances: dict[Pair, Array] = field(default_factory=dict, repr=False)

    @property
    def timestep(self) -> float:
        """Length of a physics step [s]."""
        return float(self.model.opt.timestep)

    @cached_property
    def is_led(self) -> bool:
        """Whether the target moves as told, whatever it meets."""
        return self.scenario.target.body is None

    @cached_property
    def is_fixed(self) -> list[bool]:
        """Whether each body stands still for good."""
        still = [self.model.body(name).weldid[0] == 0 for name in self.names]
        return [at_rest and group != "target" for at_rest, group in zip(still, self.groups, strict=True)]

    @cached_property
    def by_geometry(self) -> list[Pair]:
        """The pairs whose touches are a matter of geometry: MuJoCo never lets them meet."""
        found = []
        for pair in combinations(range(len(self.names)), 2):
            groups = {self.groups[one] for one in pair}
            if self.scenario.axes > 3:
                meets = groups & {"robots", "target"}
            else:
                meets = self.is_led and "target" in groups and any(self.is_fixed[one] for one in pair)
            if meets:
                found.append(pair)
        return found

    def geom(self, body: int) -> int:
        """The geom of a body's hull."""
        return int(self.model.geom(f"{self.names[body]}_body").id)

    def distance(self, pair: Pair) -> Array:
        """Return the signed distance of the surfaces of two bodies, one of them a ball, shape (k,) [m]."""
        if pair not in self._distances:
            ball, other = pair if self._kind(pair[0]) == GEOM.mjGEOM_SPHERE else pair[::-1]
            offset = self.centers[:, ball] - self.centers[:, other]
            self._distances[pair] = self._to(other, offset) - self._radius(ball)
        return self._distances[pair]

    def _kind(self, body: int) -> int:
        return int(self.model.geom_type[self.geom(body)])

    def _radius(self, body: int) -> float:
        assert self._kind(body) == GEOM.mjGEOM_SPHERE
        return float(self.model.geom_size[self.geom(body), 0])

    def _to(self, body: int, offset: Array) -> Array:
        """Return the distance of points, given relative to a body's center, to its surface.

        Nothing can leave the plane of a planar mission: there the way out of a body leads along it.
        """
        distance = self._in_space(body, offset)
        inside = distance < 0.0
        if self.scenario.axes == 2 and inside.any():
            distance[inside] = self._in_plane(body, offset[inside])
        return distance

    def _in_plane(self, body: int, offset: Array) -> Array:
        size = self.model.geom_size[self.geom(body)]
        kind, turn = self._kind(body), self._turn(body)
        if kind == GEOM.mjGEOM_MESH:
            return shapes.in_section_of_hull(offset, self._vertices(body) @ turn.T)
        assert turn[2, 2] > 1.0 - 1e-12, "a body that stands upright"
        points = (offset @ turn)[:, :2]
        if kind == GEOM.mjGEOM_BOX:
            return shapes.box(points, size[:2])
        if kind == GEOM.mjGEOM_ELLIPSOID:
            return shapes.ellipsoid(points, size[:2])
        return shapes.ball(points, size[0])

    def _in_space(self, body: int, offset: Array) -> Array:
        geom, kind = self.geom(body), self._kind(body)
        size = self.model.geom_size[geom]
        if kind == GEOM.mjGEOM_SPHERE:
            return shapes.ball(offset, size[0])
        points = offset @ self._turn(body)
        if kind == GEOM.mjGEOM_BOX:
            return shapes.box(points, size)
        if kind == GEOM.mjGEOM_CYLINDER:
            return shapes.cylinder(points, size[0], size[1])
        if kind == GEOM.mjGEOM_CAPSULE:
            return shapes.capsule(points, size[0], size[1])
        if kind == GEOM.mjGEOM_ELLIPSOID:
            return shapes.ellipsoid(points, size)
        assert kind == GEOM.mjGEOM_MESH
        return shapes.hull(points, self._vertices(body))

    def _turn(self, body: int) -> Array:
        """The shape's axes in the world's frame, as columns."""
        turn = np.empty(9)
        mujoco.mju_quat2Mat(turn, self.model.geom_quat[self.geom(body)])
        return turn.reshape(3, 3)

    def _vertices(self, body: int) -> Array:
        mesh = self.model.geom_dataid[self.geom(body)]
        first, count = self.model.mesh_vertadr[mesh], self.model.mesh_vertnum[mesh]
        return self.model.mesh_vert[first : first + count].astype(float)

    def thickness(self, body: int) -> float:
        """Least extent of a body [m]."""
        kind, size = self._kind(body), self.model.geom_size[self.geom(body)]
        if kind in (GEOM.mjGEOM_SPHERE, GEOM.mjGEOM_CAPSULE):
            return 2.0 * float(size[0])
        if kind == GEOM.mjGEOM_CYLINDER:
            return 2.0 * float(size[:2].min())
        if kind == GEOM.mjGEOM_MESH:
            return shapes.least_width(self._vertices(body))
        return 2.0 * float(size.min())

    def places(self, side: str) -> list[int]:
        """The bodies of a group, or the one of that name."""
        return [k for k, name in enumerate(self.names) if side in (name, self.groups[k])]

    def pairs(self, sides: Sequence[str] | str) -> Iterator[Pair]:
        """All pairs of two sides; `any`, `none`: of all bodies."""
        if isinstance(sides, str):
            yield from combinations(range(len(self.names)), 2)
            return
        one, other = map(self.places, sides)
        yield from {(min(a, b), max(a, b)) for a in one for b in other if a != b}

    def steps(self, after: float, before: float | None) -> Array:
        """Return which physics steps lie in a window, shape (k,)."""
        end = np.inf if before is None else before
        return (self.times >= after - BARELY) & (self.times <= end + BARELY)

    @cached_property
    def touches(self) -> list[Touch]:
        """Every touch of the mission."""
        found = []
        for pair in combinations(range(len(self.names)), 2):
            if pair in self.by_geometry:
                depth = -self.distance(pair)
                meets = depth > 0.0
            else:
                meets = np.array([pair in step for step in self.touched])
                depth = np.array([step.get(pair, 0.0) for step in self.touched])
            edges = np.flatnonzero(np.diff(np.concatenate([[0], meets.astype(int), [0]])))
            for first, end in zip(edges[::2], edges[1::2], strict=True):
                found.append(Touch(pair, int(first), int(end) - 1, float(depth[first:end].max())))
        return found

    @cached_property
    def moved(self) -> Array:
        """How far each body moves in each step, over the smallest thickness, shape (k - 1, bodies) [1]."""
        moved = np.linalg.norm(np.diff(self.centers, axis=0), axis=2)
        moved[:, self.is_fixed] = 0.0
        return moved / min(self.thickness(k) for k in range(len(self.names)))


def fly(scenario: Scenario) -> Flight:
    """Fly a scenario one physics step at a time, from time 0 to its duration."""
    world = build(scenario)
    model = mujoco.MjModel.from_xml_string(world.xml)
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    names, groups = world.bodies.names[:-1], world.bodies.groups[:-1]
    steps = int(np.floor(scenario.duration / scenario.physics.timestep + BARELY)) + 1
    times = np.arange(steps) * scenario.physics.timestep
    centers = np.empty((steps, len(names), max(scenario.axes, 3)))
    touched = []
    with native_loop(world):
        mujoco.set_mjcb_sensor(None)
        for step in range(steps):
            assert abs(data.time - times[step]) < 1e-6 * scenario.physics.timestep + 1e-9
            state = data.qpos.copy()
            mujoco.mj_step(model, data)  # leaves geometry and contacts of before the step
            centers[step] = _centers(scenario, data, names, state)
            touched.append(_contacts(model, data, names))
    target = names.index("target")
    shown = centers[:, target].copy()
    if scenario.target.body is None:
        keys = scenario.target.model_dump()
        centers[:, target, : scenario.axes] = motions.positions(keys, scenario.axes, times)
    return Flight(scenario, names, groups, times, centers, shown, touched, model)


def _centers(scenario: Scenario, data: mujoco.MjData, names: Sequence[str], state: Array) -> Array:
    """Return the center of each body's hull, shape (bodies, max(p, 3)) [m]."""
    axes = scenario.axes
    if axes <= 3:
        return np.array([data.geom(f"{name}_body").xpos for name in names])
    robots = len(names) - 1 - len(scenario.obstacles)
    fixed = [each.position for each in scenario.obstacles]
    return np.array([*state[: robots * axes].reshape(robots, axes), np.full(axes, np.nan), *fixed])


def _contacts(model: mujoco.MjModel, data: mujoco.MjData, names: Sequence[str]) -> dict[Pair, float]:
    """Return the depth of each pair of bodies that MuJoCo found touching [m]."""
    found: dict[Pair, float] = {}
    for k in range(data.ncon):
        contact = data.contact[k]
        roots = [model.body(model.body_rootid[model.geom_bodyid[geom]]).name for geom in contact.geom]
        if "world" in roots or contact.dist >= 0.0:
            continue
        one, other = sorted(names.index(name) for name in roots)
        found[one, other] = max(found.get((one, other), 0.0), -float(contact.dist))
    return found
