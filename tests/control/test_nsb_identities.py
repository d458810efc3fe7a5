"""Identities of the null-space-based composition (paper eqs. 2, 3, 23, 24), on random states."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from escort_mj.behaviors import AvoidObstacles, Chords, Surface
from escort_mj.control.setup import Setup
from escort_mj.laws import ApdSmc
from escort_mj.numerics.formation import arrange
from escort_mj.sensing.sensors import Sensors
from tests.oracle.behaviors import escape_gain, intrusion, is_active, wish
from tests.oracle.failure import KnownRobots
from tests.oracle.outer_loops import spend
from tests.oracle.reference import ReferenceController, ReferenceSignals
from tests.oracle.setup import setup_now
from tests.oracle.task import Situation, distance, half_squared_distance, resolve

TARGET_VELOCITY = np.array([0.3, -0.2, 0.1])
AVOID = AvoidObstacles(measure="center", safe_distance=3.0, sidestep=0.0)
CHORDS, SURFACE = Chords(), Surface()

sizes = st.just(0.0) | st.floats(1e-6, 100.0)
depths = st.floats(1e-6, 10.0)


class Drift:
    """A target in uniform motion."""

    def __init__(self, axes: int) -> None:
        self.rate = TARGET_VELOCITY[:axes]

    def position(self, t: float) -> np.ndarray:
        return self.rate * t

    def velocity(self, t: float) -> np.ndarray:
        return self.rate


def crowded(axes: int, seed: int) -> tuple[Setup, np.ndarray, np.ndarray]:
    """A mission among so many obstacles that some robots avoid and some do not; q and v."""
    rng = np.random.default_rng(seed)
    n, m = 6, 4
    q, v = rng.normal(scale=4.0, size=(n, axes)), rng.normal(size=(n, axes))
    setup = Setup(
        timestep=0.002,
        seed=seed,
        behaviors=(AVOID, CHORDS, SURFACE),
        law=ApdSmc(),
        radius=5.0,
        target_feedforward=True,
        max_speed=math.inf,
        arrangement=arrange(q, np.zeros(axes), 5.0),
        obstacle_position=rng.normal(scale=4.0, size=(m, axes)),
        obstacle_radius=rng.uniform(0.1, 0.5, m),
        robot_radius=rng.uniform(0.1, 0.3, n),
        force_limit=np.full(n, 10.0),
        sensing=Sensors(),
        target=Drift(axes),
        disturbance=None,
    )
    return setup, q, v


def evaluate(setup: Setup, q: np.ndarray, v: np.ndarray) -> ReferenceSignals:
    """The law with a tracking error: it starts beside the robots."""
    controller = ReferenceController(setup)
    controller.reset(q + 0.05 * v)
    return controller.evaluate(0.7, q, v)


cases = pytest.mark.parametrize(("axes", "seed"), [(p, k) for p in (2, 3) for k in range(4)])


@cases
def test_projectors(axes: int, seed: int) -> None:
    setup, q, v = crowded(axes, seed)
    jacobians = [half_squared_distance(q, q[row]).jacobian for row in setup.arrangement.predecessors]
    jacobians.append(half_squared_distance(q, np.zeros(axes)).jacobian)
    depth, intruder = intrusion(AVOID, q, setup)
    jacobians.append(np.where(depth[:, None] > 0.0, distance(q, intruder).jacobian, 0.0))
    for jacobian in jacobians:
        _, projector = resolve(jacobian, np.zeros(len(q)))
        np.testing.assert_allclose(projector, projector.T, atol=1e-12)
        np.testing.assert_allclose(projector @ projector, projector, atol=1e-12)
        np.testing.assert_allclose(jacobian @ projector, 0.0, atol=1e-12)
        rank = np.linalg.matrix_rank(jacobian)
        assert np.trace(projector) == pytest.approx(q.size - rank, abs=1e-10)


@pytest.mark.parametrize("share", [0.0, 0.1, 1.0])
@cases
def test_the_highest_task_is_carried_out_exactly(axes: int, seed: int, share: float) -> None:
    """J1 v_d = lambda sigma~ wherever avoidance is active, whatever the escort asks, sidestep included."""
    setup, q, v = crowded(axes, seed)
    setup = replace(setup, behaviors=(AVOID.model_copy(update={"sidestep": share}), CHORDS, SURFACE))
    signals = evaluate(setup, q, v)
    depth, intruder = intrusion(AVOID, q, setup)
    active = depth > 0.0
    assert 0 < active.sum() < len(q) or seed % 4 != 0  # seed 0 has both kinds of robots
    np.testing.assert_array_equal(signals.avoidance_active, active)
    speed, error = np.linalg.norm(v, axis=1), np.linalg.norm(signals.e, axis=1)
    wanted = (
        speed + (math.sqrt(2.0) - 1.0) * setup.law.slope * error + AVOID.gain_margin * np.maximum(depth, 0.0)
    )
    outward = np.sum(signals.v_d * (q - intruder), axis=1) / np.linalg.norm(q - intruder, axis=1)
    np.testing.assert_allclose(outward[active], wanted[active], rtol=1e-12)


@cases
def test_sidestep_fills_up_what_is_left_along_the_sphere(axes: int, seed: int) -> None:
    setup, q, v = crowded(axes, seed)
    plain = evaluate(setup, q, v).v_d
    stepped = replace(setup, behaviors=(AVOID.model_copy(update={"sidestep": 3.0}), CHORDS, SURFACE))
    added = evaluate(stepped, q, v).v_d - plain
    escort = evaluate(replace(setup, behaviors=(CHORDS, SURFACE)), q, v).v_d
    depth, intruder = intrusion(AVOID, q, setup)
    for i in range(len(q)):
        r = (q[i] - intruder[i]) / np.linalg.norm(q[i] - intruder[i])
        left = np.linalg.norm(escort[i] - (escort[i] @ r) * r)
        missing = max(-3.0 * float(escort[i] @ r) - left, 0.0) if depth[i] > 0.0 else 0.0
        slack = 1e-11 * float(np.linalg.norm(escort[i])) + 1e-300
        assert added[i] @ r == pytest.approx(0.0, abs=slack)
        if axes == 2:  # counterclockwise around what intrudes
            counterclockwise = np.array([-r[1], r[0]])
            np.testing.assert_allclose(added[i], missing * counterclockwise, atol=slack)
        else:  # in space it turns about one axis: enough of it wherever r points
            assert math.sqrt(0.19) * missing - slack <= np.linalg.norm(added[i]) <= missing + slack


@cases
def test_avoidance_leaves_the_tangent_to_the_escort(axes: int, seed: int) -> None:
    setup, q, v = crowded(axes, seed)
    v_d = evaluate(setup, q, v).v_d
    escort = evaluate(replace(setup, behaviors=(CHORDS, SURFACE)), q, v).v_d
    depth, intruder = intrusion(AVOID, q, setup)
    for i in range(len(q)):
        if depth[i] <= 0.0:
            np.testing.assert_allclose(v_d[i], escort[i], rtol=1e-12)
            continue
        r = (q[i] - intruder[i]) / np.linalg.norm(q[i] - intruder[i])
        tangent = np.eye(axes) - np.outer(r, r)
        np.testing.assert_allclose(tangent @ v_d[i], tangent @ escort[i], atol=1e-12 * np.linalg.norm(v_d[i]))


@cases
def test_stacks_with_one_row_each(axes: int, seed: int) -> None:
    """The robot-by-robot form of eq. 2 in the plane, and for the surface alone."""
    setup, q, v = crowded(axes, seed)
    c, c_dot = setup.target.position(0.7), setup.target.velocity(0.7)
    x3 = q - c
    square3 = np.sum(x3 * x3, axis=1, keepdims=True)
    v3 = SURFACE.gain * (25.0 - square3) / 2.0 * x3 / square3
    alone = evaluate(replace(setup, behaviors=(SURFACE,)), q, v).v_d
    np.testing.assert_allclose(alone, c_dot + v3, rtol=1e-12)

    total = np.zeros_like(q)
    for row in setup.arrangement.predecessors:
        x2 = q - q[row]
        square2 = np.sum(x2 * x2, axis=1, keepdims=True)
        v2 = CHORDS.gain * (setup.arrangement.length**2 - square2) / 2.0 * x2 / square2
        total += v2 + v3 - x2 * np.sum(x2 * v3, axis=1, keepdims=True) / square2
    both = evaluate(replace(setup, behaviors=(CHORDS, SURFACE)), q, v).v_d
    np.testing.assert_allclose(both, c_dot + total, rtol=1e-11)


@cases
def test_feedforward_moves_the_whole_escort_with_the_target(axes: int, seed: int) -> None:
    setup, q, v = crowded(axes, seed)
    for behaviors in [(CHORDS,), (CHORDS, SURFACE), (SURFACE, CHORDS)]:
        stack = replace(setup, behaviors=behaviors)
        paper = evaluate(replace(stack, target_feedforward=False), q, v).v_d
        np.testing.assert_allclose(
            evaluate(stack, q, v).v_d - paper, TARGET_VELOCITY[:axes] + 0.0 * q, atol=1e-12
        )


@cases
def test_avoidance_below_the_escort_yields_to_it(axes: int, seed: int) -> None:
    """With surface first J3 (v_d - c_dot) = Lambda3 sigma~3, whether or not avoidance is active."""
    setup, q, v = crowded(axes, seed)
    signals = evaluate(replace(setup, behaviors=(SURFACE, AVOID, CHORDS)), q, v)
    assert signals.avoidance_active.any()
    x = q - signals.target_position
    rate = np.sum(x * (signals.v_d - signals.target_velocity), axis=1)
    np.testing.assert_allclose(rate, SURFACE.gain * (25.0 - np.sum(x * x, axis=1)) / 2.0, rtol=1e-10)


@given(depths, sizes, sizes)
def test_gain_solves_eq_23(depth: float, speed: float, error: float) -> None:
    """x = lambda* sigma~ makes |e_dot|^2 = gamma^2 |e|^2 + 2 gamma |e| |e_dot|, taken in norms."""
    slope = 20.0
    avoid = AvoidObstacles(gain_margin=0.0)
    x = float(escape_gain(avoid, *(np.array([value]) for value in (depth, speed, error)), slope)[0]) * depth
    g = slope * error
    assert x == pytest.approx(speed + (math.sqrt(2.0) - 1.0) * g, rel=1e-10)
    scale = (speed + g) ** 2 + 1e-300
    assert abs(x**2 - 2.0 * x * (speed - g) - (g**2 + 2.0 * g * speed - speed**2)) <= 1e-9 * scale


@given(depths, sizes, sizes)
def test_printed_gain_never_draws_a_robot_in(depth: float, speed: float, error: float) -> None:
    """The printed root solves its own quadratic where that is real, and never is negative."""
    slope, g = 20.0, 20.0 * error
    avoid = AvoidObstacles(gain="printed", gain_margin=0.0)
    x = float(escape_gain(avoid, *(np.array([value]) for value in (depth, speed, error)), slope)[0]) * depth
    half, c = speed - 2.0 * g, g**2 + 2.0 * g * speed - speed**2
    scale = (speed + g) ** 2 + 1e-300
    assert x >= -1e-12 * (speed + g)
    if half**2 + c >= 0.0:
        assert abs(x**2 - 2.0 * half * x - c) <= 1e-9 * scale
    else:
        assert x == pytest.approx(half, rel=1e-9)


def test_gain_margin_adds_to_the_gain() -> None:
    one = np.ones(1)
    without, plus = AvoidObstacles(gain_margin=0.0), AvoidObstacles(gain_margin=0.4)
    assert escape_gain(plus, one, one, one, 20.0) - escape_gain(
        without, one, one, one, 20.0
    ) == pytest.approx(0.4)


@st.composite
def stacks(draw: st.DrawFn) -> tuple[np.ndarray, float]:
    axes, count = draw(st.sampled_from([2, 3])), draw(st.integers(1, 5))
    values = st.lists(st.floats(-5.0, 5.0), min_size=axes * count, max_size=axes * count)
    return np.array(draw(values)).reshape(count, axes), draw(st.floats(0.1, 6.0))


@given(stacks())
def test_speed_is_spent_by_priority(stack: tuple[np.ndarray, float]) -> None:
    parts, limit = stack
    total = spend(parts, limit)
    assert np.linalg.norm(total) <= limit * (1.0 + 1e-12)
    sums = np.vstack([np.zeros(parts.shape[1]), np.cumsum(parts, axis=0)])
    fits = np.linalg.norm(sums, axis=1) <= limit * (1.0 - 1e-9)
    if fits.all():
        np.testing.assert_allclose(total, sums[-1], atol=1e-12)
    else:  # what comes before the first that does not fit is untouched, and that one reaches the limit
        first = int(np.argmin(fits)) - 1
        np.testing.assert_allclose(spend(parts[:first], limit), sums[first], atol=1e-12)
        assert np.linalg.norm(spend(parts[: first + 1], limit)) == pytest.approx(limit, rel=1e-8)


@pytest.mark.parametrize("sideways", [1e-3, 1.0, 1e3])
def test_nothing_sideways_once_the_speed_is_spent(sideways: float) -> None:
    np.testing.assert_array_equal(spend(np.array([[3.0, 0.0], [0.0, 0.0], [0.0, sideways]]), 2.0), [2.0, 0.0])


def test_a_lower_part_may_brake() -> None:
    np.testing.assert_allclose(spend(np.array([[3.0, 0.0], [-1.5, 0.0]]), 2.0), [0.5, 0.0])
    np.testing.assert_allclose(spend(np.array([[3.0, 0.0], [-8.0, 0.0]]), 2.0), [-2.0, 0.0])


@cases
def test_avoidance_takes_its_speed_first(axes: int, seed: int) -> None:
    setup, q, v = crowded(axes, seed)
    limit = 2.5
    signals = evaluate(replace(setup, max_speed=limit), q, v)
    assert np.all(np.linalg.norm(signals.v_d, axis=1) <= limit * (1.0 + 1e-12))
    here = np.tile(setup.target.position(0.7), (len(q), 1))
    turned = np.tile(np.eye(axes), (len(q), 1, 1))
    now = Situation(
        setup_now(setup), KnownRobots.whole(setup), turned, q, v, signals.e, here, 0.0 * here, q, v
    )
    v1, active = wish(AVOID, now), is_active(AVOID, now)
    depth, intruder = intrusion(AVOID, q, setup)
    for i in np.flatnonzero(active):
        r = (q[i] - intruder[i]) / np.linalg.norm(q[i] - intruder[i])
        assert signals.v_d[i] @ r == pytest.approx(min(np.linalg.norm(v1[i]), limit), rel=1e-10)


def test_wishes_beyond_the_speed_limit_do_not_call_for_a_sidestep() -> None:
    """Else robots go one way around outside of a safe sphere and the other way inside, and stay there."""
    changed = 0
    for seed in range(40):
        setup, q, v = crowded(2, seed)
        v = 0.0 * v  # avoidance leaves room within the limit
        limited = replace(setup, max_speed=0.5)
        stack = (AVOID.model_copy(update={"sidestep": 0.6}), CHORDS, SURFACE)
        plain, stepped = (
            evaluate(replace(limited, behaviors=each), q, v).v_d for each in (limited.behaviors, stack)
        )
        escort, wishes = (
            evaluate(replace(each, behaviors=(CHORDS, SURFACE)), q, v).v_d for each in (limited, setup)
        )
        depth, intruder = intrusion(AVOID, q, setup)
        for i in np.flatnonzero(depth > 0.0):
            r = (q[i] - intruder[i]) / np.linalg.norm(q[i] - intruder[i])
            free = [
                -0.6 * each[i] @ r <= np.linalg.norm(each[i] - (each[i] @ r) * r) for each in (escort, wishes)
            ]
            if free[0]:
                np.testing.assert_array_equal(stepped[i], plain[i])
                changed += not free[1]
    assert changed, "some robots would step aside for wishes that nobody follows"
