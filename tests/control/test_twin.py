"""The compiled controller against its NumPy twin, which shares no code with it: random missions."""

import math
from dataclasses import replace

import numpy as np
import pytest

from escort_mj.control.behaviors import AvoidObstacles, Chords, Repulsion, Surface, Vertices
from escort_mj.control.controller import evaluate
from escort_mj.control.failure import Failure
from escort_mj.control.formation import arrange, chords_exist
from escort_mj.control.laws import LAWS, ApdSmc, ComputedTorque
from escort_mj.control.laws.sliding import SlidingModeLaw
from escort_mj.control.outer_loops import BarrierFilter, PotentialField
from escort_mj.control.packing import pack
from escort_mj.control.plan import State, state_size, unpack_plan, unpack_state
from escort_mj.control.program import Op
from escort_mj.control.reference import ReferenceController, ReferenceSignals
from escort_mj.control.reform import reforming
from escort_mj.control.setup import Setup
from escort_mj.control.supervisor import Condition, Phase
from escort_mj.control.thomson import figure
from escort_mj.control.trigger import Trigger
from escort_mj.kernels import kernel

TOLERANCE = 1e-10

AVOID, CHORDS, SURFACE = AvoidObstacles(safe_distance=2.5), Chords(), Surface()
VERTICES, REPULSION = Vertices(), Repulsion()
LADDERS = (
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


@kernel
def step(plan: int, state: int, axes: int) -> None:
    """Evaluates the law on packed memory; literal axes where the physics callback has them."""
    if axes == 2:
        evaluate(unpack_plan(plan, 2), unpack_state(plan, state, 2))
    elif axes == 3:
        evaluate(unpack_plan(plan, 3), unpack_state(plan, state, 3))
    else:
        evaluate(unpack_plan(plan, axes), unpack_state(plan, state, axes))


class Kernel:
    """The compiled controller with its own memory, evaluated like `ReferenceController`."""

    def __init__(self, setup: Setup) -> None:
        self.axes, self.limit = setup.axes, setup.force_limit
        self.packed = pack(setup, stride=1, coordinates=setup.count * setup.axes)
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
        step(self.packed.ctypes.data, self.memory.ctypes.data, self.axes)
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
        behaviors=LADDERS[0],
        law=ApdSmc(),
        radius=5.0,
        target_feedforward=True,
        max_speed=math.inf,
        arrangement=arrange(q, np.zeros(axes), 5.0, order) if chords_exist(count, axes) else None,
        obstacle_position=rng.normal(scale=3.0, size=(obstacles, axes)),
        obstacle_radius=rng.uniform(0.1, 0.5, obstacles),
        robot_radius=rng.uniform(0.1, 0.3, count),
        force_limit=rng.choice([10.0, 50.0, 200.0, math.inf], count),
        noise_position=0.02,
        noise_velocity=0.01,
        target=Wave(rng, axes),
        disturbance=Wave(rng, axes),
        figure=figure(q, np.zeros(axes)),
    )
    return setup, q, v


def assert_same(kernel: State, twin: ReferenceSignals, tolerance: float) -> None:
    """Every signal of both agrees, relative to the signal's own size."""
    for name, expected in twin._asdict().items():
        if name == "task_angle":  # compared where it is well conditioned
            np.testing.assert_allclose(np.cos(kernel.task_angle), np.cos(expected), atol=tolerance)
            continue
        size = twin.task_wish if name == "task_removed" else expected  # a difference of two such wishes
        atol = tolerance * max(1.0, float(np.abs(size).max()))
        np.testing.assert_allclose(getattr(kernel, name), expected, rtol=0.0, atol=atol, err_msg=name)


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


@pytest.mark.parametrize("axes", [2, 3])
@pytest.mark.parametrize("max_speed", [math.inf, 1.5])
@pytest.mark.parametrize("ladder", LADDERS, ids=lambda ladder: "-".join(b.behavior for b in ladder))
@pytest.mark.parametrize("outer", [PotentialField(), BarrierFilter(rate=3.0)])
def test_every_outer_loop(outer, ladder, max_speed: float, axes: int) -> None:
    """The filter's program is solved in two ways, which agree to what least squares can tell."""
    setup, q, v = mission(axes, seed=6)
    q = 0.5 * q  # into the crowd
    setup = replace(setup, behaviors=ladder, outer=outer, max_speed=max_speed, law=ComputedTorque())
    assert compare(setup, q, v, tolerance=1e-8).any() == (AVOID in ladder)
    if axes == 2 or CHORDS not in ladder:  # chords in space have no figure of five
        failures = (Failure(robot=2, at=0.0, notice=0.003),)
        compare(replace(setup, failures=failures, reforming=reforming(6, axes, 1)), q, v, tolerance=1e-8)


def with_avoidance(setup: Setup, **changes: object) -> Setup:
    """The setup with other parameters of avoid_obstacles."""
    return replace(
        setup,
        behaviors=tuple(
            b.model_copy(update=changes) if isinstance(b, AvoidObstacles) else b for b in setup.behaviors
        ),
    )


@pytest.mark.parametrize("axes", [2, 3])
@pytest.mark.parametrize("max_speed", [math.inf, 1.5])
@pytest.mark.parametrize("feedforward", [True, False])
@pytest.mark.parametrize("ladder", LADDERS, ids=lambda ladder: "-".join(b.behavior for b in ladder))
def test_every_ladder(ladder, feedforward: bool, max_speed: float, axes: int) -> None:
    setup, q, v = mission(axes, seed=1)
    setup = replace(setup, behaviors=ladder, target_feedforward=feedforward, max_speed=max_speed)
    active = compare(setup, q, v)
    if AVOID in ladder:
        assert active.any() and not active.all()


@pytest.mark.parametrize("axes", [2, 3])
@pytest.mark.parametrize("anti_windup", [True, False])
@pytest.mark.parametrize("smoothing", ["tanh", "saturation", "sign"])
@pytest.mark.parametrize("law", LAWS)
def test_every_law(law, smoothing: str, anti_windup: bool, axes: int) -> None:
    setup, q, v = mission(axes, seed=2)
    wanted = {
        "smoothing": smoothing,
        "anti_windup": anti_windup,
        "boundary_layer": 0.7,
        "slope": 13.0,
        "switching_gain": 30.0,
        "root_gain": 20.0,
        "acceleration_filter": {"tanh": 0.0, "saturation": 0.001, "sign": 0.1}[smoothing],
    }
    chosen = law(**{key: value for key, value in wanted.items() if key in law.model_fields})
    setup = replace(setup, law=chosen)
    twin = ReferenceController(setup, stride=1)
    twin.reset(q)
    tau = twin.evaluate(0.0, q, v).tau
    saturated = np.abs(tau) > setup.force_limit[:, None]
    assert saturated.any() and not saturated.all()
    compare(setup, q, v)


@pytest.mark.parametrize("axes", [2, 3])
@pytest.mark.parametrize("measure", ["center", "surface"])
@pytest.mark.parametrize("teammates", [True, False])
@pytest.mark.parametrize("gain", ["consistent", "printed"])
def test_every_avoidance(gain: str, teammates: bool, measure: str, axes: int) -> None:
    setup, q, v = mission(axes, seed=3)
    setup = with_avoidance(setup, gain=gain, teammates=teammates, measure=measure, teammate_distance=4.0)
    active = compare(setup, q, v)
    assert active.any() and not active.all()


@pytest.mark.parametrize("axes", [2, 3])
@pytest.mark.parametrize(("position", "velocity"), [(0.0, 0.0), (0.02, 0.0), (0.0, 0.01), (0.5, 0.5)])
def test_every_noise(position: float, velocity: float, axes: int) -> None:
    setup, q, v = mission(axes, seed=4)
    setup = replace(setup, noise_position=position, noise_velocity=velocity)
    kernel, twin = Kernel(setup), ReferenceController(setup, stride=1)
    twin.reset(q)
    for t in (0.0, 0.002, 1.0, 12345.678):
        signals, state = twin.evaluate(t, q, v), kernel.evaluate(t, q, v)
        np.testing.assert_allclose(state.q_measured, signals.q_measured, rtol=1e-15, atol=1e-15)
        np.testing.assert_allclose(state.v_measured, signals.v_measured, rtol=1e-15, atol=1e-15)
    compare(setup, q, v)


@pytest.mark.parametrize("seed", range(40))
def test_random_missions(seed: int) -> None:
    rng = np.random.default_rng([99, seed])
    axes = int(rng.integers(2, 4))
    count = int(rng.integers(2, 9)) if axes == 2 else 6
    setup, q, v = mission(axes, seed, count, obstacles=int(rng.integers(0, 7)))
    law = LAWS[rng.integers(len(LAWS))]
    switching = {"smoothing": str(rng.choice(["tanh", "saturation", "sign"]))}
    avoid = {
        "gain": str(rng.choice(["consistent", "printed"])),
        "measure": str(rng.choice(["center", "surface"])),
        "teammates": bool(rng.integers(2)),
        "safe_distance": float(rng.uniform(0.5, 4.0)),
        "gain_margin": float(rng.uniform(0.0, 1.0)),
        "sidestep": float(rng.choice([0.0, 0.5])),
    }
    setup = replace(
        setup,
        behaviors=LADDERS[rng.integers(len(LADDERS))],
        law=law(anti_windup=bool(rng.integers(2)), **(switching if issubclass(law, SlidingModeLaw) else {})),
        radius=float(rng.uniform(1.0, 8.0)),
        target_feedforward=bool(rng.integers(2)),
        max_speed=float(rng.choice([0.5, 3.0, math.inf])),
        disturbance=None if rng.integers(2) else setup.disturbance,
    )
    compare(with_avoidance(setup, **avoid), q, v, seed)


PHASES = (
    Phase("late", (SURFACE, AVOID), after=0.004, before=0.012),
    Phase("near", (AVOID, SURFACE), when=Condition(quantity="obstacle_distance", below=1.5, release=2.0)),
    Phase("crowd", (Surface(gain=2.0), VERTICES), when=Condition(quantity="robot_distance", below=2.5)),
    Phase("far", (REPULSION,), when=Condition(quantity="target_distance", above=7.0, release=6.5)),
    Phase("gate", (AVOID, CHORDS, SURFACE), 0.008, when=Condition(
        quantity="target_obstacle_distance", below=2.5, scope="team"
    )),
    Phase("all", (AVOID, SURFACE), 0.014, when=Condition(
        quantity="robot_distance", below=0.6, scope="team"
    )),
)  # fmt: skip


@pytest.mark.parametrize("axes", [2, 3])
@pytest.mark.parametrize("trigger", [None, Trigger(distance=0.2, share=0.05, dwell=0.004, longest=0.01)])
def test_every_phase_and_the_trigger(trigger: Trigger | None, axes: int) -> None:
    seen: set[float] = set()
    for seed in range(4):
        setup, q, v = mission(axes, seed=20 + seed)
        setup = replace(setup, phases=PHASES, trigger=trigger)
        rng = np.random.default_rng(seed)
        kernel, twin = Kernel(setup), ReferenceController(setup, stride=1)
        twin.reset(q)
        for count in range(12):
            t = count * setup.timestep
            for _ in range(2):
                signals = twin.evaluate(t, q, v)
                assert_same(kernel.evaluate(t, q, v), signals, TOLERANCE)
            seen |= set(signals.phase)
            q, v = q + rng.normal(scale=0.3, size=q.shape), v + rng.normal(scale=0.5, size=v.shape)
        if trigger is not None:
            assert 1 < signals.outer_updates.min() < signals.outer_updates.max() <= 12
    assert seen >= {0.0, 1.0, 2.0, 3.0, 4.0, 5.0}


@pytest.mark.parametrize("axes", [2, 3])
@pytest.mark.parametrize("ladder", LADDERS, ids=lambda ladder: "-".join(b.behavior for b in ladder))
def test_failures_on_every_ladder(ladder, axes: int) -> None:
    """Every kind, one after another and two at once, with and without the team's knowing."""
    if axes == 3 and CHORDS in ladder:
        pytest.skip("chords has no formation in space for fewer than six")
    setup, q, v = mission(axes, seed=10)
    failures = (
        Failure(robot=2, at=0.002, kind="dead", notice=0.002),
        Failure(robot=1, at=0.004, kind="stuck", notice=0.0),
        Failure(robot=6, at=0.0, kind="mad", notice=0.008, force=3.0),
        Failure(robot=4, at=0.006, kind="mad", notice=0.002, force=40.0),
        Failure(robot=3, at=0.008, kind="stuck", notice=0.01),
    )
    setup = replace(setup, behaviors=ladder, failures=failures, reforming=reforming(6, axes, len(failures)))
    compare(setup, q, v, steps=12)


def crowded(axes: int, seed: int, count: int) -> tuple[Setup, np.ndarray, np.ndarray]:
    """A mission with obstacles at two of its robots: room grows with the axes, and they would be alone."""
    setup, q, v = mission(axes, seed, count)
    setup.obstacle_position[:2] = q[:2] + 1.0 / math.sqrt(axes)
    return setup, q, v


MANY = [ladder for ladder in LADDERS if CHORDS not in ladder]  # which has no formation in so many axes


@pytest.mark.parametrize("axes", [4, 5, 9])
@pytest.mark.parametrize("ladder", MANY, ids=lambda ladder: "-".join(b.behavior for b in ladder))
def test_more_than_three_axes(ladder, axes: int) -> None:
    setup, q, v = crowded(axes, seed=11, count=7)
    setup = replace(setup, behaviors=ladder)
    active = compare(setup, q, v)
    if AVOID in ladder:
        assert active.any() and not active.all()
    compare(replace(setup, max_speed=1.5, target_feedforward=False), q, v)
    failures = (Failure(robot=2, at=0.002, notice=0.002), Failure(robot=5, at=0.004, kind="stuck"))
    compare(replace(setup, failures=failures, reforming=reforming(7, axes, 2)), q, v, steps=6)


@pytest.mark.parametrize("axes", [4, 9])
@pytest.mark.parametrize("law", LAWS)
def test_every_law_in_more_than_three_axes(law, axes: int) -> None:
    setup, q, v = crowded(axes, seed=12, count=5)
    compare(replace(setup, behaviors=(AVOID, VERTICES, SURFACE), law=law()), q, v)


@pytest.mark.parametrize("axes", [4, 9])
@pytest.mark.parametrize("outer", [PotentialField(), BarrierFilter(rate=3.0)])
def test_every_outer_loop_in_more_than_three_axes(outer, axes: int) -> None:
    setup, q, v = crowded(axes, seed=13, count=5)
    setup = replace(setup, behaviors=(AVOID, VERTICES, SURFACE), outer=outer, max_speed=1.5)
    assert compare(setup, q, v, tolerance=1e-8).any()


@pytest.mark.parametrize("axes", [2, 3])
def test_robots_in_impossible_places(axes: int) -> None:
    """On an obstacle, on its teammate and predecessor, and on the target, without noise to part them."""
    setup, q, v = mission(axes, seed=5)
    setup = replace(setup, noise_position=0.0, noise_velocity=0.0)
    q[0] = setup.obstacle_position[2]
    q[1] = q[setup.arrangement.predecessors[0, 1]]
    q[3] = setup.target.position(0.0)
    for ladder in LADDERS:
        for max_speed in (math.inf, 1.0):
            compare(replace(setup, behaviors=ladder, max_speed=max_speed), q, v, steps=2)


@pytest.mark.parametrize("axes", [2, 3])
@pytest.mark.parametrize("gain", ["consistent", "printed"])
def test_gain_without_tracking_error(gain: str, axes: int) -> None:
    """At e = 0, the first step of every run without noise, eq. 24 has a double root."""
    for seed in range(5):
        setup, q, v = mission(axes, seed)
        setup = replace(setup, noise_position=0.0, noise_velocity=0.0)
        compare(with_avoidance(setup, gain=gain), q, v, steps=2)


def test_two_obstacles_equally_near() -> None:
    """The first rules, and an obstacle comes before a teammate."""
    setup, q, v = mission(2, seed=6, count=2, obstacles=3)
    setup = replace(
        setup,
        behaviors=(AvoidObstacles(measure="center", teammate_distance=2.0),),
        obstacle_position=np.array([[3.0, 0.0], [1.0, 0.0], [-1.0, 0.0]]),
        noise_position=0.0,
        noise_velocity=0.0,
        target_feedforward=False,
    )
    q = np.array([[0.0, 0.0], [0.0, 1.0]])
    assert compare(setup, q, v, steps=1)[0, 0]
    state = Kernel(setup).evaluate(0.0, q, v)
    assert state.v_d[0, 0] < 0.0 and state.v_d[0, 1] == 0.0


def test_a_lone_robot_in_free_space() -> None:
    setup, q, v = mission(3, seed=7, count=1, obstacles=0)
    for ladder in ((AVOID, SURFACE), (AVOID,), (SURFACE,)):
        assert not compare(replace(setup, behaviors=ladder), q, v).any()


def test_teammates_that_do_not_count_may_overlap() -> None:
    setup, q, v = mission(2, seed=8, obstacles=0)
    setup = with_avoidance(replace(setup, robot_radius=np.full(6, 3.0)), teammates=False)
    assert not compare(setup, q, v).any()


@pytest.mark.parametrize("axes", [2, 3])
def test_a_long_run_stays_together(axes: int) -> None:
    """Each controller drives robots of its own, of unit mass, for 5000 steps past obstacles."""
    setup, q, _ = mission(axes, seed=9)
    setup = replace(setup, force_limit=np.full(6, 10.0), max_speed=2.0, radius=4.0)
    kernel, twin = Kernel(setup), ReferenceController(setup)
    twin.reset(q)
    states = {"kernel": (q, np.zeros_like(q)), "twin": (q, np.zeros_like(q))}
    avoided = False
    for count in range(5000):
        t = count * setup.timestep
        signals = twin.evaluate(t, *states["twin"])
        taus = {"kernel": kernel.evaluate(t, *states["kernel"]).tau, "twin": signals.tau}
        avoided |= bool(signals.avoidance_active.any())
        for name, tau in taus.items():
            q, v = states[name]
            v = v + setup.timestep * (np.clip(tau, -10.0, 10.0) + signals.disturbance)
            states[name] = q + setup.timestep * v, v
    assert avoided
    np.testing.assert_allclose(states["kernel"], states["twin"], rtol=0.0, atol=1e-6)
