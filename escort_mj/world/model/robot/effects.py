"""What a compiled robot's actuators do to its base: classified and measured, never guessed from names."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj.errors import RobotError

Array = NDArray[np.float64]

MOTOR, POSITION_SERVO, VELOCITY_SERVO, OTHER = "motor", "position servo", "velocity servo", "other"
LARGEST_GAP = 10.0  # m
SMALL = 1e-9
FREE, BALL, SLIDE, HINGE = (int(kind) for kind in mujoco.mjtJoint.__members__.values())


def kind_of(model: mujoco.MjModel, actuator: int) -> str:
    """What an actuator is, by its compiled gain, bias and dynamics."""
    gain, bias = model.actuator_gainprm[actuator], model.actuator_biasprm[actuator]
    fixed = model.actuator_gaintype[actuator] == mujoco.mjtGain.mjGAIN_FIXED
    affine = model.actuator_biastype[actuator] == mujoco.mjtBias.mjBIAS_AFFINE
    dynamics = int(model.actuator_dyntype[actuator])
    if not fixed or gain[0] == 0.0:
        return OTHER
    if dynamics == mujoco.mjtDyn.mjDYN_INTEGRATOR:
        return VELOCITY_SERVO if affine and bias[1] < 0.0 else OTHER
    lags = (mujoco.mjtDyn.mjDYN_NONE, mujoco.mjtDyn.mjDYN_FILTER, mujoco.mjtDyn.mjDYN_FILTEREXACT)
    if dynamics not in lags:
        return OTHER
    if not affine or not bias[1:3].any():
        return MOTOR
    return POSITION_SERVO if bias[1] < 0.0 else VELOCITY_SERVO if bias[2] < 0.0 else OTHER


def control_range(model: mujoco.MjModel, actuator: int, kind: str) -> tuple[float, float]:
    """Least and largest control of an actuator; of a motor, its force's range counts too."""
    low, high = -np.inf, np.inf
    if model.actuator_ctrllimited[actuator]:
        low, high = model.actuator_ctrlrange[actuator]
    if kind == MOTOR and model.actuator_forcelimited[actuator]:
        ends = np.sort(model.actuator_forcerange[actuator] / model.actuator_gainprm[actuator, 0])
        low, high = max(low, ends[0]), min(high, ends[1])
    return float(max(low, -1e300)), float(min(high, 1e300))


@dataclass
class Machine:
    """A compiled robot in its start pose.

    Attributes:
        model: The compiled file.
        data: Its start pose, forward.
        base: Number of the base's body.
        name: Of the robot, for messages.
    """

    model: mujoco.MjModel
    data: mujoco.MjData
    base: int
    name: str

    @property
    def root(self) -> int:
        """The body that everything of the robot hangs on."""
        return int(self.model.body_rootid[self.base])

    @cached_property
    def bodies(self) -> NDArray[np.int64]:
        """All bodies of the robot."""
        return np.flatnonzero(self.model.body_rootid == self.root)

    @cached_property
    def base_freedoms(self) -> list[int]:
        """The velocity coordinates that move the base."""
        found: list[int] = []
        body = self.base
        while body:
            first, count = self.model.body_dofadr[body], self.model.body_dofnum[body]
            found = [*range(first, first + count), *found]
            body = int(self.model.body_parentid[body])
        return found

    @property
    def rotation(self) -> Array:
        """Of the base, shape (3, 3)."""
        return self.data.xmat[self.base].reshape(3, 3).copy()

    @property
    def center(self) -> Array:
        """Center of mass of the robot in the base's frame, shape (3,) [m]."""
        return np.asarray(self.rotation.T @ (self.data.subtree_com[self.root] - self.data.xpos[self.base]))

    @property
    def mass(self) -> float:
        """Of all of the robot [kg]."""
        return float(self.model.body_mass[self.bodies].sum())

    @property
    def inertia(self) -> Array:
        """About the center of mass, along the base's axes, shape (3, 3) [kg m^2]."""
        total, center = np.zeros((3, 3)), self.data.subtree_com[self.root]
        for body in self.bodies:
            turn = self.data.ximat[body].reshape(3, 3)
            way = self.data.xipos[body] - center
            total += turn @ np.diag(self.model.body_inertia[body]) @ turn.T
            total += self.model.body_mass[body] * (way @ way * np.eye(3) - np.outer(way, way))
        return np.asarray(self.rotation.T @ total @ self.rotation)

    @property
    def moments(self) -> Array:
        """Generalized force for an actuator force of 1, shape (actuators, nv)."""
        data, found = self.data, np.zeros((self.model.nu, self.model.nv))
        mujoco.mju_sparse2dense(
            found, data.actuator_moment, data.moment_rownnz, data.moment_rowadr, data.moment_colind
        )
        return found

    @property
    def mass_matrix(self) -> Array:
        """Shape (nv, nv)."""
        found = np.zeros((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, self.data, found)
        return found

    def jacobian(self, point: Array) -> Array:
        """Of velocity and angular velocity of the base, in its own frame, shape (6, nv).

        Args:
            point: In the base's frame, shape (3,) [m].
        """
        straight, turning = np.zeros((3, self.model.nv)), np.zeros((3, self.model.nv))
        place = self.data.xpos[self.base] + self.rotation @ point
        mujoco.mj_jac(self.model, self.data, straight, turning, place, self.base)
        return np.vstack([self.rotation.T @ straight, self.rotation.T @ turning])

    def on_base(self, point: Array) -> tuple[Array, Array]:
        """What actuators do to the base directly, in its own frame.

        Args:
            point: In the base's frame, shape (3,) [m].

        Returns:
            Force and torque for an actuator force of 1, shape (6, actuators), and the rate of each
            transmission for a velocity and angular velocity of 1, shape (actuators, 6).
        """
        inverse = np.linalg.pinv(self.jacobian(point)[:, self.base_freedoms], rcond=1e-9)
        moments = self.moments[:, self.base_freedoms]
        return _clean(inverse.T @ moments.T), _clean(moments @ inverse)

    def turned(self) -> Machine:
        """The same robot with another heading; itself where it cannot turn."""
        data = mujoco.MjData(self.model)
        data.qpos[:] = self.data.qpos
        for body in self._chain():
            for joint in range(
                self.model.body_jntadr[body], self.model.body_jntadr[body] + self.model.body_jntnum[body]
            ):
                place = self.model.jnt_qposadr[joint]
                if self.model.jnt_type[joint] == HINGE:
                    data.qpos[place] += 0.7
                elif self.model.jnt_type[joint] == FREE:
                    turn, before = np.array([np.cos(0.35), 0.0, 0.0, np.sin(0.35)]), np.empty(4)
                    mujoco.mju_mulQuat(before, turn, self.data.qpos[place + 3 : place + 7])
                    data.qpos[place + 3 : place + 7] = before
        mujoco.mj_forward(self.model, data)
        return Machine(self.model, data, self.base, self.name)

    def frame_of(self, point: Array, actuators: NDArray[np.int64]) -> bool:
        """Whether what actuators do to the base is constant along the world's axes, rather than the base's.

        Raises:
            RobotError: If it is neither.
        """
        other = self.turned()
        here, there = self.on_base(point)[0][:, actuators], other.on_base(point)[0][:, actuators]
        scale = max(np.abs(here).max(), SMALL)
        if np.abs(here - there).max() < 1e-6 * scale:
            return False
        both = [each.rotation @ force[:3] for each, force in ((self, here), (other, there))]
        if np.abs(both[0] - both[1]).max() < 1e-6 * scale:
            return True
        raise RobotError(
            f"{self.name}: its actuators push neither along the axes of its base nor along the world's"
        )

    def _chain(self) -> list[int]:
        """The base and what it hangs on."""
        found, body = [], self.base
        while body:
            found.append(body)
            body = int(self.model.body_parentid[body])
        return found

    @property
    def rises(self) -> bool:
        """Whether the base can move upward."""
        straight = self.jacobian(np.zeros(3))[:3, self.base_freedoms]
        return bool(np.abs(self.rotation[2] @ straight).max(initial=0.0) > 1e-6)


def _clean(values: Array) -> Array:
    """Values without what rounding left."""
    scale = np.abs(values).max(initial=0.0)
    return np.where(np.abs(values) < 1e-12 * scale, 0.0, values)


def geom_outline(machine: Machine, geom: int) -> Array:
    """Points of which the hull contains a geom, world frame, shape (k, 3) [m]; curved ones are boxed in."""
    model, data = machine.model, machine.data
    turn, place = data.geom_xmat[geom].reshape(3, 3), data.geom_xpos[geom]
    if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = model.geom_dataid[geom]
        first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        return np.asarray(model.mesh_vert[first : first + count] @ turn.T + place)
    if int(model.geom_type[geom]) in (mujoco.mjtGeom.mjGEOM_SPHERE, mujoco.mjtGeom.mjGEOM_CAPSULE):
        radius = model.geom_size[geom, 0]
        half = model.geom_size[geom, 1] if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_CAPSULE else 0.0
        ends = [place + side * half * turn[:, 2] for side in (-1.0, 1.0)]
        ways = radius * np.vstack([np.eye(3), -np.eye(3), _ring(24)])
        return np.vstack([end + ways for end in ends])
    if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_CYLINDER:
        radius, half = model.geom_size[geom, :2]
        lowest = np.array([*turn[2, :2], 0.0]) / max(np.hypot(*turn[2, :2]), SMALL)
        ring = radius * np.vstack([_ring(48), -lowest, lowest]) @ turn.T
        return np.vstack([place + side * half * turn[:, 2] + ring for side in (-1.0, 1.0)])
    box = model.geom_aabb[geom]
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    return np.asarray((box[:3] + signs * box[3:]) @ turn.T + place)


def _ring(count: int) -> Array:
    """Unit vectors around the z axis."""
    angles = 2.0 * np.pi * np.arange(count) / count
    return np.column_stack([np.cos(angles), np.sin(angles), np.zeros(count)])


def solid_geoms(machine: Machine) -> list[int]:
    """The geoms of a robot that can touch something.

    Raises:
        RobotError: If none can: nothing would ever meet the robot. Or if one touches something long before
            that pushes back, is inside it before that is found, or stands, so that MuJoCo lets it touch
            nothing else that stands or is led.
    """
    model = machine.model
    ours = [geom for geom in range(model.ngeom) if model.geom_bodyid[geom] in machine.bodies]
    solid = [geom for geom in ours if model.geom_contype[geom] or model.geom_conaffinity[geom]]
    if not solid:
        found = f"contype and conaffinity of all {len(ours)} are 0" if ours else "it has none"
        raise RobotError(f"{machine.name}: none of its geoms can touch anything: {found}")
    for geom in solid:
        if deep := found_too_deep(model, geom):
            raise RobotError(f"{machine.name}: {deep}")
        if model.body_weldid[model.geom_bodyid[geom]] == 0:
            raise RobotError(
                f"{machine.name}: {_called(model, geom)} can touch something, and no joint moves it; make "
                "what stands an obstacle of the scenario, or give it contype 0 and conaffinity 0"
            )
    return solid


def found_too_deep(model: mujoco.MjModel, geom: int) -> str:
    """How bodies would be inside a geom before that is found or pushes back, in words; else nothing."""
    called, margin, gap = _called(model, geom), model.geom_margin[geom], model.geom_gap[geom]
    if gap > LARGEST_GAP:
        return (
            f"{called}: found a gap of {gap:g} m; allowed is at most {LARGEST_GAP:g} m: "
            "what it touches would be so far inside it before anything pushes back"
        )
    if (least := margin + min(gap, 0.0)) < 0.0:
        return (
            f"{called}: found margin {margin:g} m and gap {gap:g} m; both together are "
            f"at least 0 m, or bodies would be {-least:g} m inside it before a touch is found"
        )
    return ""


def _called(model: mujoco.MjModel, geom: int) -> str:
    """What messages call a geom, which need not have a name."""
    body = model.body(model.geom_bodyid[geom]).name
    return f"the geom {name}" if (name := model.geom(geom).name) else f"a geom of {body}"


def is_rigid(machine: Machine) -> bool:
    """Whether no joint moves what can touch something against the base."""
    model = machine.model
    bodies = model.geom_bodyid[solid_geoms(machine)]
    return bool((model.body_weldid[bodies] == model.body_weldid[machine.base]).all())


def vertical(machine: Machine, geom: int) -> tuple[float, float]:
    """Height of the lowest and of the highest point of a geom [m]."""
    model, data = machine.model, machine.data
    if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_ELLIPSOID:
        middle = float(data.geom_xpos[geom][2])
        half = float(np.linalg.norm(data.geom_xmat[geom].reshape(3, 3)[2] * model.geom_size[geom]))
        return middle - half, middle + half
    heights = geom_outline(machine, geom)[:, 2]
    return float(heights.min()), float(heights.max())


def farthest(machine: Machine, geom: int, point: Array) -> float:
    """How far a geom reaches from a point of the world, shape (3,), at most [m]."""
    model, data = machine.model, machine.data
    kind, size = int(model.geom_type[geom]), model.geom_size[geom]
    way, axis = data.geom_xpos[geom] - point, data.geom_xmat[geom].reshape(3, 3)[:, 2]
    along = float(way @ axis)
    across = float(np.linalg.norm(way - along * axis))
    if kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        return float(np.hypot(abs(along) + size[1], across + size[0]))
    if kind in (mujoco.mjtGeom.mjGEOM_SPHERE, mujoco.mjtGeom.mjGEOM_CAPSULE):
        half = size[1] if kind == mujoco.mjtGeom.mjGEOM_CAPSULE else 0.0
        return float(np.hypot(abs(along) + half, across) + size[0])
    return float(np.linalg.norm(geom_outline(machine, geom) - point, axis=1).max())
