"""The compiled controller against its NumPy twin, which shares no code with it: random missions."""

import math
from dataclasses import replace

import numpy as np
import pytest

from escort_mj.behaviors import AvoidObstacles
from escort_mj.control.outer_loops import BarrierFilter, PotentialField, SetBased
from escort_mj.control.setup import Setup
from escort_mj.failures.motors import Dead, Mad, Stuck
from escort_mj.laws import LAWS, ComputedTorque
from escort_mj.laws.sliding import SlidingModeLaw
from escort_mj.numerics.neighbors import LISTED
from escort_mj.numerics.reform import reforming
from escort_mj.sensing.sensors import Sensors
from escort_mj.sensors import Plain
from tests.control.twins import (
    AVOID,
    CHORDS,
    STACKS,
    SURFACE,
    VERTICES,
    Kernel,
    compare,
    mission,
    with_avoidance,
)
from tests.oracle.reference import ReferenceController


@pytest.mark.crossed
@pytest.mark.parametrize(
    ("outer", "max_speed", "axes"),
    [
        (PotentialField(), math.inf, 2),
        (PotentialField(), 1.5, 3),
        (BarrierFilter(rate=3.0), 1.5, 2),
        (BarrierFilter(rate=3.0), math.inf, 3),
        (SetBased(rate=3.0, patience=0.003, turn_back=0.003), 1.5, 2),
        (SetBased(activation="tangent_cone", braking=2.0, patience=0.003), math.inf, 3),
    ],
)
@pytest.mark.parametrize("stack", STACKS, ids=lambda stack: "-".join(b.behavior for b in stack))
def test_every_outer_loop(outer, stack, max_speed: float, axes: int) -> None:
    """The filter's program is solved in two ways, which agree to what least squares can tell.

    On every priority stack, every pair of the other three.
    """
    setup, q, v = mission(axes, seed=6)
    q = 0.5 * q  # into the crowd
    setup = replace(setup, behaviors=stack, outer=outer, max_speed=max_speed, law=ComputedTorque())
    assert compare(setup, q, v, tolerance=1e-8).any() == (AVOID in stack)
    if axes == 2 or CHORDS not in stack:  # chords in space have no figure of five
        failures = (Dead(robot=2, at=0.0, notice=0.003),)
        compare(replace(setup, failures=failures, reforming=reforming(6, axes, 1)), q, v, tolerance=1e-8)


@pytest.mark.crossed
@pytest.mark.parametrize(
    ("feedforward", "max_speed", "axes"),
    [(True, math.inf, 2), (True, 1.5, 3), (False, 1.5, 2), (False, math.inf, 3)],
)
@pytest.mark.parametrize("stack", STACKS, ids=lambda stack: "-".join(b.behavior for b in stack))
def test_every_stack(stack, feedforward: bool, max_speed: float, axes: int) -> None:
    """Every pair of the other three on each."""
    setup, q, v = mission(axes, seed=1)
    setup = replace(setup, behaviors=stack, target_feedforward=feedforward, max_speed=max_speed)
    active = compare(setup, q, v)
    if AVOID in stack:
        assert active.any() and not active.all()


@pytest.mark.crossed
@pytest.mark.parametrize(
    ("smoothing", "anti_windup", "axes"),
    [
        ("tanh", True, 2),
        ("tanh", False, 3),
        ("saturation", False, 2),
        ("saturation", True, 3),
        ("sign", True, 2),
        ("sign", False, 3),
    ],
)
@pytest.mark.parametrize("law", LAWS)
def test_every_law(law, smoothing: str, anti_windup: bool, axes: int) -> None:
    """Every pair of the other three with each."""
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
    setup = replace(setup, sensing=Sensors(Plain(noise=position), Plain(noise=velocity)))
    kernel, twin = Kernel(setup), ReferenceController(setup, stride=1)
    twin.reset(q)
    for t in (0.0, 0.002, 1.0, 12345.678):
        signals, state = twin.evaluate(t, q, v), kernel.evaluate(t, q, v)
        np.testing.assert_allclose(state.q_measured, signals.q_measured, rtol=1e-15, atol=1e-15)
        np.testing.assert_allclose(state.v_measured, signals.v_measured, rtol=1e-15, atol=1e-15)
    compare(setup, q, v)


@pytest.mark.parametrize(
    "seed", [*range(12), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(12, 40))]
)
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
        behaviors=STACKS[rng.integers(len(STACKS))],
        law=law(anti_windup=bool(rng.integers(2)), **(switching if issubclass(law, SlidingModeLaw) else {})),
        radius=float(rng.uniform(1.0, 8.0)),
        target_feedforward=bool(rng.integers(2)),
        max_speed=float(rng.choice([0.5, 3.0, math.inf])),
        disturbance=None if rng.integers(2) else setup.disturbance,
    )
    compare(with_avoidance(setup, **avoid), q, v, seed)


@pytest.mark.crossed
@pytest.mark.parametrize(
    ("stack", "axes"),  # chords has no formation in space for fewer than six
    [(stack, axes) for stack in STACKS for axes in (2, 3) if axes == 2 or CHORDS not in stack],
)
def test_failures_on_every_stack(stack, axes: int) -> None:
    """Every kind, one after another and two at once, with and without the team's knowing."""
    setup, q, v = mission(axes, seed=10)
    failures = (
        Dead(robot=2, at=0.002, notice=0.002),
        Stuck(robot=1, at=0.004, notice=0.0),
        Mad(robot=6, at=0.0, notice=0.008, force=3.0),
        Mad(robot=4, at=0.006, notice=0.002, force=40.0),
        Stuck(robot=3, at=0.008, notice=0.01),
    )
    setup = replace(setup, behaviors=stack, failures=failures, reforming=reforming(6, axes, len(failures)))
    compare(setup, q, v, steps=12)


def crowded(axes: int, seed: int, count: int) -> tuple[Setup, np.ndarray, np.ndarray]:
    """A mission with obstacles at two of its robots: room grows with the axes, and they would be alone."""
    setup, q, v = mission(axes, seed, count)
    setup.obstacle_position[:2] = q[:2] + 1.0 / math.sqrt(axes)
    return setup, q, v


MANY = [stack for stack in STACKS if CHORDS not in stack]  # which has no formation in so many axes


@pytest.mark.crossed
@pytest.mark.parametrize("axes", [4, pytest.param(5, marks=pytest.mark.slow), 9])
@pytest.mark.parametrize("stack", MANY, ids=lambda stack: "-".join(b.behavior for b in stack))
def test_more_than_three_axes(stack, axes: int) -> None:
    setup, q, v = crowded(axes, seed=11, count=7)
    setup = replace(setup, behaviors=stack)
    active = compare(setup, q, v)
    if AVOID in stack:
        assert active.any() and not active.all()
    compare(replace(setup, max_speed=1.5, target_feedforward=False), q, v)
    failures = (Dead(robot=2, at=0.002, notice=0.002), Stuck(robot=5, at=0.004))
    compare(replace(setup, failures=failures, reforming=reforming(7, axes, 2)), q, v, steps=6)


@pytest.mark.crossed
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
    setup = replace(setup, sensing=Sensors())
    q[0] = setup.obstacle_position[2]
    q[1] = q[setup.arrangement.predecessors[0, 1]]
    q[3] = setup.target.position(0.0)
    for stack in STACKS:
        for max_speed in (math.inf, 1.0):
            compare(replace(setup, behaviors=stack, max_speed=max_speed), q, v, steps=2)


@pytest.mark.parametrize("axes", [2, 3])
@pytest.mark.parametrize("gain", ["consistent", "printed"])
def test_gain_without_tracking_error(gain: str, axes: int) -> None:
    """At e = 0, the first step of every run without noise, eq. 24 has a double root."""
    for seed in range(5):
        setup, q, v = mission(axes, seed)
        setup = replace(setup, sensing=Sensors())
        compare(with_avoidance(setup, gain=gain), q, v, steps=2)


def test_two_obstacles_equally_near() -> None:
    """The first rules, and an obstacle comes before a teammate."""
    setup, q, v = mission(2, seed=6, count=2, obstacles=3)
    setup = replace(
        setup,
        behaviors=(AvoidObstacles(measure="center", teammate_distance=2.0),),
        obstacle_position=np.array([[3.0, 0.0], [1.0, 0.0], [-1.0, 0.0]]),
        sensing=Sensors(),
        target_feedforward=False,
    )
    q = np.array([[0.0, 0.0], [0.0, 1.0]])
    assert compare(setup, q, v, steps=1)[0, 0]
    state = Kernel(setup).evaluate(0.0, q, v)
    assert state.v_d[0, 0] < 0.0 and state.v_d[0, 1] == 0.0


def test_a_lone_robot_in_free_space() -> None:
    setup, q, v = mission(3, seed=7, count=1, obstacles=0)
    for stack in ((AVOID, SURFACE), (AVOID,), (SURFACE,)):
        assert not compare(replace(setup, behaviors=stack), q, v).any()


def test_teammates_that_do_not_count_may_overlap() -> None:
    setup, q, v = mission(2, seed=8, obstacles=0)
    setup = with_avoidance(replace(setup, robot_radius=np.full(6, 3.0)), teammates=False)
    assert not compare(setup, q, v).any()


@pytest.mark.slow
@pytest.mark.parametrize("steps", [200, pytest.param(5000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("axes", [2, 3])
def test_a_long_run_stays_together(axes: int, steps: int) -> None:
    """Each controller drives robots of its own, of unit mass, past obstacles."""
    setup, q, _ = mission(axes, seed=9)
    setup = replace(setup, force_limit=np.full(6, 10.0), max_speed=2.0, radius=4.0)
    kernel, twin = Kernel(setup), ReferenceController(setup)
    twin.reset(q)
    states = {"kernel": (q, np.zeros_like(q)), "twin": (q, np.zeros_like(q))}
    avoided = False
    for count in range(steps):
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


@pytest.mark.slow_cases("3-surface")
@pytest.mark.crossed
@pytest.mark.parametrize("noise", [0.0, 0.05])
@pytest.mark.parametrize("measure", ["center", "surface"])
@pytest.mark.parametrize("axes", [2, 3])
def test_a_crowd_that_keeps_lists_of_neighbors(noise: float, measure: str, axes: int) -> None:
    """Lists of true and of measured positions, made anew where robots jump."""
    setup, q, v = mission(axes, seed=7, count=LISTED + 12)
    setup = with_avoidance(setup, measure=measure, teammate_distance=1.0)
    setup = replace(setup, sensing=Sensors(Plain(noise=noise), Plain(noise=noise)))
    setup = replace(setup, behaviors=(setup.behaviors[0], VERTICES, SURFACE))
    failures = tuple(Dead(robot=robot, at=0.0, notice=0.003) for robot in (2, 40))
    for each in (setup, replace(setup, failures=failures, behaviors=(setup.behaviors[0], SURFACE))):
        active = compare(each, q, v, steps=3)
        assert active.any() and not active.all()
    setup = replace(setup, law=ComputedTorque(), target_feedforward=noise > 0.0, max_speed=1.5)
    for outer in (SetBased(rate=3.0), BarrierFilter()):
        active = compare(replace(setup, outer=outer), q, v, steps=3, tolerance=1e-8)
        assert active.any() and not active.all()
