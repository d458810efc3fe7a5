"""The compiled controller and its NumPy twin side by side, on random missions: what tests of both share."""

import math
from dataclasses import replace

import numpy as np

from escort_mj.behaviors import AvoidObstacles, Chords, Repulsion, Surface, Vertices
from escort_mj.control.setup import Setup
from escort_mj.laws import ApdSmc
from escort_mj.memory.evaluation import evaluation_of
from escort_mj.memory.layout import State, state_size, unpack_state
from escort_mj.memory.packing import pack
from escort_mj.memory.sampling import Sampling
from escort_mj.numerics.formation import arrange, chords_exist
from escort_mj.numerics.program import Op
from escort_mj.numerics.thomson import even_figure
from escort_mj.scenario.geometry.trajectory import Trajectory
from escort_mj.scenario.schema.expressions import Expression
from escort_mj.sensing.sensors import Sensors
from escort_mj.sensors import Plain
from tests.oracle.reference import ReferenceController, ReferenceSignals

TOLERANCE = 1e-10

AVOID, CHORDS, SURFACE = AvoidObstacles(safe_distance=2.5), Chords(), Surface()
VERTICES, REPULSION = Vertices(), Repulsion()
STACKS = (
    (AVOID, CHORDS, SURFACE),
    (AVOID, SURFACE, CHORDS),
    (CHORDS, SURFACE, AVOID),
    (SURFACE, AVOID, CHORDS),
    (CHORDS, AVOID, SURFACE),
    (CHORDS, SURFACE),
    (SURFACE, CHORDS),
    (AVOID, SURFACE),
    (AVOID,),
    (CHORDS,),
    (SURFACE,),
    (AVOID, VERTICES, SURFACE),
    (AVOID, REPULSION, SURFACE),
    (SURFACE, VERTICES),
    (VERTICES, AVOID, SURFACE),
    (REPULSION, AVOID, SURFACE),
    (REPULSION,),
    (CHORDS, VERTICES, SURFACE),
)


def vector(*components: float | str) -> Trajectory:
    """A vector of numbers and expressions in t, for NumPy and as a program for the kernel."""
    return Trajectory(tuple(Expression(component) for component in components))


class Wave:
    """A vector a + b t + d sin(w t), for NumPy and as a program for the kernel."""

    def __init__(self, rng: np.random.Generator, axes: int) -> None:
        self.a, self.b, self.d, self.w = rng.normal(size=(4, axes))

    def position(self, t: float) -> np.ndarray:
        return self.a + self.b * t + self.d * np.sin(self.w * t)

    def velocity(self, t: float) -> np.ndarray:
        return self.b + self.d * self.w * np.cos(self.w * t)

    def programs(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        code = [
            row
            for a, b, d, w in zip(self.a, self.b, self.d, self.w, strict=True)
            for row in (
                (Op.AFFINE, 0, w),
                (Op.SIN, 0, 0),
                (Op.SCALE, d, 0),
                (Op.AFFINE, a, b),
                (Op.ADD, 0, 0),
            )
        ]
        spans = np.array([(5 * k, 5) for k in range(len(self.a))], dtype=np.int64)
        return np.array(code, dtype=float), spans, np.zeros((0, 5))


class Kernel:
    """The compiled controller with its own memory, evaluated like `ReferenceController`."""

    def __init__(self, setup: Setup) -> None:
        self.axes, self.limit = setup.axes, setup.force_limit
        self.packed = pack(setup, Sampling(coordinates=setup.count * setup.axes))
        self.memory = np.zeros(state_size(self.packed))
        self.state: State = unpack_state(self.packed.ctypes.data, self.memory.ctypes.data, setup.axes)

    def evaluate(
        self,
        t: float,
        q: np.ndarray,
        v: np.ndarray,
        mass: np.ndarray | None = None,
        bias: np.ndarray | None = None,
    ) -> State:
        self.state.time[0], self.state.q[:], self.state.v[:] = t, q, v
        if len(self.state.model_bias):  # as the physics callback does
            self.state.model_mass[:] = np.eye(self.axes).ravel() if mass is None else mass.reshape(len(q), -1)
            self.state.model_bias[:] = 0.0 if bias is None else bias
        evaluation_of(self.axes)(self.packed.ctypes.data, self.memory.ctypes.data)
        limit = self.limit[:, None]
        self.state.force_before[:] = np.clip(self.state.command, -limit, limit)  # as the watcher does
        return self.state


def mission(axes: int, seed: int, count: int = 6, obstacles: int = 5) -> tuple[Setup, np.ndarray, np.ndarray]:
    """A random mission in a crowd of obstacles, with default options; initial q and v."""
    rng = np.random.default_rng([axes, seed])
    q, v = rng.normal(scale=4.0, size=(count, axes)), rng.normal(size=(count, axes))
    order = tuple(int(robot) + 1 for robot in rng.permutation(count))
    setup = Setup(
        timestep=0.002,
        seed=int(rng.integers(2**53)),
        behaviors=STACKS[0],
        law=ApdSmc(),
        radius=5.0,
        target_feedforward=True,
        max_speed=math.inf,
        arrangement=arrange(q, np.zeros(axes), 5.0, order) if chords_exist(count, axes) else None,
        obstacle_position=rng.normal(scale=3.0, size=(obstacles, axes)),
        obstacle_radius=rng.uniform(0.1, 0.5, obstacles),
        robot_radius=rng.uniform(0.1, 0.3, count),
        force_limit=rng.choice([10.0, 50.0, 200.0, math.inf], count),
        sensing=Sensors(Plain(noise=0.02), Plain(noise=0.01)),
        target=Wave(rng, axes),
        disturbance=Wave(rng, axes),
        figure=even_figure(q, np.zeros(axes)),
        target_radius=1.5,
    )
    return setup, q, v


def assert_same(kernel: State, twin: ReferenceSignals, tolerance: float) -> None:
    """Every signal of both agrees, relative to the signal's own size."""
    for name, expected in twin._asdict().items():
        if name == "task_angle":  # compared where it is well conditioned
            np.testing.assert_allclose(np.cos(kernel.task_angle), np.cos(expected), atol=tolerance)
            continue
        size = twin.task_wish if name == "task_removed" else expected  # a difference of two such wishes
        atol = tolerance * np.abs(size[np.isfinite(size)]).max(initial=1.0)
        found = getattr(kernel, name)
        with np.errstate(invalid="ignore"):
            same = (np.abs(found - expected) <= atol).all()
        if not same:  # a difference, or something infinite: NumPy's own test, twenty times as slow, can say
            np.testing.assert_allclose(found, expected, rtol=0.0, atol=atol, err_msg=name)


def compare(
    setup: Setup, q: np.ndarray, v: np.ndarray, seed: int = 0, steps: int = 4, tolerance: float = TOLERANCE
) -> np.ndarray:
    """Walks both through random states, each evaluated twice; how often avoidance was active, (steps, n)."""
    rng = np.random.default_rng(seed)
    kernel, twin = Kernel(setup), ReferenceController(setup, stride=1)
    twin.reset(q)
    active = []
    for count in range(steps):
        t = count * setup.timestep
        root = rng.normal(size=(*q.shape, setup.axes))
        model = root @ root.swapaxes(1, 2), rng.normal(size=q.shape)
        for _ in range(2):
            signals = twin.evaluate(t, q, v, *model)
            assert_same(kernel.evaluate(t, q, v, *model), signals, tolerance)
        active.append(signals.avoidance_active)
        q, v = q + rng.normal(scale=0.05, size=q.shape), v + rng.normal(scale=0.5, size=v.shape)
    return np.array(active)


def with_avoidance(setup: Setup, **changes: object) -> Setup:
    """The setup with other parameters of avoid_obstacles."""
    return replace(
        setup,
        behaviors=tuple(
            b.model_copy(update=changes) if isinstance(b, AvoidObstacles) else b for b in setup.behaviors
        ),
    )
