"""The baselines of the outer loop: the filter's quadratic program, and the fields' repulsion."""

import math
from dataclasses import replace

import numpy as np
import pytest

import tests.oracle.set_based  # noqa: F401 (registers its velocities)
from escort_mj.behaviors import AvoidObstacles, Surface
from escort_mj.behaviors.robots import robots_at
from escort_mj.components.parameters import UNLIMITED
from escort_mj.control.nsb import avoidance_of
from escort_mj.control.outer_loops import OUTER_LOOPS, OuterLoop, PotentialField
from escort_mj.control.outer_loops.constraints import MOST
from escort_mj.control.outer_loops.nearest_velocity import (
    STIFFNESS,
    break_least,
    keep_limit,
    nearest_velocity,
)
from escort_mj.control.outer_loops.passing import Rules, approach
from escort_mj.control.outer_loops.potential_field import repulsion
from escort_mj.control.setup import Setup
from escort_mj.laws import ApdSmc
from escort_mj.memory.layout import unpack_plan, unpack_state
from escort_mj.metrics.causes import least_change
from escort_mj.mission import fly
from escort_mj.native.lanes import WIDTH, store
from escort_mj.native.vectors import Vec, set_rows
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.sensing.sensors import Sensors
from escort_mj.standalone.lost import who_may_be_lost
from tests.control.twins import Kernel, vector
from tests.oracle.constraints import constraints_of
from tests.oracle.failure import KnownRobots
from tests.oracle.nearest_velocity import broken_least, contradicting, kept_limit, nearest
from tests.oracle.outer_loops import filtered as filtered_by
from tests.oracle.outer_loops import repulsions, velocities
from tests.oracle.setup import setup_now
from tests.oracle.task import Situation


class Origin:
    def position(self, t):
        return np.zeros(2)

    velocity = position


def crowd(axes: int, seed: int) -> tuple[Setup, AvoidObstacles, np.ndarray, np.ndarray, np.ndarray]:
    """Robots and obstacles so dense that constraints contradict each other; q, nominal v, who is lost."""
    rng = np.random.default_rng([axes, seed])
    n, m = int(rng.integers(1, 7)), int(rng.integers(0, 7))
    spread = float(rng.choice([0.5, 1.5, 4.0]))
    avoid = AvoidObstacles(
        safe_distance=float(rng.uniform(0.3, 2.5)),
        teammate_distance=float(rng.uniform(0.3, 2.5)),
        measure=str(rng.choice(["center", "surface"])),
        teammates=bool(rng.integers(4)),
    )
    setup = Setup(
        timestep=0.002,
        seed=0,
        behaviors=(avoid, Surface()),
        law=ApdSmc(),
        radius=5.0,
        target_feedforward=False,
        max_speed=math.inf,
        arrangement=None,
        obstacle_position=rng.normal(scale=spread, size=(m, axes)),
        obstacle_radius=rng.uniform(0.1, 0.5, m),
        robot_radius=rng.uniform(0.1, 0.3, n),
        force_limit=np.full(n, math.inf),
        sensing=Sensors(),
        target=Origin(),
        disturbance=None,
    )
    q, v = rng.normal(scale=spread, size=(n, axes)), rng.normal(scale=2.0, size=(n, axes))
    if seed % 10 == 0 and m:
        q[0] = setup.obstacle_position[0]
    return setup, avoid, q, v, rng.random(n) < 0.2


def _repeller(axes):
    def repel_all(plan_at, state_at, gain, least_distance):
        plan, state = unpack_plan(plan_at, axes), unpack_state(plan_at, state_at, axes)
        for i in range(0, state.q.shape[0], WIDTH):
            r = robots_at(i, plan, state)
            push, moved = repulsion(avoidance_of(0, plan), gain, least_distance, r)
            set_rows(state.v_d, i, push)
            store(state.avoidance_active, i, moved)

    return repel_all


REPELLERS = {axes: _repeller(axes) for axes in (2, 3)}


def by_kernel(field, setup, avoid, q, lost):
    """What a field adds to each robot's velocity, and whose."""
    setup = replace(setup, behaviors=(avoid, Surface()), target=vector(*[0.0] * setup.axes))
    kernel = Kernel(replace(setup, failures=who_may_be_lost(setup)))
    kernel.state.q_measured[:], kernel.state.lost[:] = q, lost
    kernel.state.obstacle_position[:] = setup.obstacle_position
    addresses = kernel.packed.ctypes.data, kernel.memory.ctypes.data
    REPELLERS[setup.axes](*addresses, field.gain, field.least_distance)
    return kernel.state.v_d.copy(), kernel.state.avoidance_active != 0.0


def situation(setup, q, lost, v=None):
    """What the NumPy forms see of a team far from its target."""
    turned = np.tile(np.eye(setup.axes), (len(q), 1, 1))
    v, team = np.zeros_like(q) if v is None else v, replace(KnownRobots.whole(setup), lost=lost)
    return Situation(setup_now(setup), team, turned, q, v, 0.0 * q, 0.0 * q + 100.0, 0.0 * q, q, v)


def filtered(rules, setup, avoid, nominal, q, lost, v=None):
    """What constraints make of nominal velocities, by the NumPy form, and whose they change."""
    constraints = constraints_of(avoid, rules, situation(setup, q, lost, v))
    found = [filtered_by(one, w) for one, w in zip(constraints, nominal, strict=True)]
    return np.array([each for each, _ in found]), np.array([moved for _, moved in found])


def barrier(rate: float) -> Rules:
    return Rules(rate, UNLIMITED, 0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("axes", [2, 3])
def test_the_nearest_velocity_solves_its_program(axes: int) -> None:
    """Newton's method in the kernel against Lawson and Hanson's non-negative least squares."""
    rng, changed = np.random.default_rng(axes), 0
    for _ in range(300):
        count = int(rng.integers(1, MOST))
        rows, bounds = rng.normal(size=(count, axes)), rng.normal(scale=2.0, size=count) - 1.0
        rows /= np.linalg.norm(rows, axis=1, keepdims=True)
        nominal = rng.normal(scale=2.0, size=axes)
        moved, v = nearest_velocity(rows, bounds, count, STIFFNESS, Vec(tuple(nominal)))
        expected, must = nearest(rows, bounds, nominal)
        assert moved == must
        np.testing.assert_allclose([*v], expected, rtol=0.0, atol=1e-8 * max(1.0, np.abs(expected).max()))
        changed += must
    assert 100 < changed < 300


@pytest.mark.parametrize("axes", [2, 3])
def test_the_speed_limit_breaks_no_condition_that_can_be_kept(axes: int) -> None:
    """Slowing down along the same direction breaks those of bodies that come nearer."""
    rng, broken = np.random.default_rng(axes), 0
    for _ in range(300):
        rows = rng.normal(size=(int(rng.integers(1, 5)), axes))
        rows /= np.linalg.norm(rows, axis=1, keepdims=True)
        feasible = rng.normal(size=axes)
        bounds = rows @ feasible - rng.uniform(0.0, 2.0, size=len(rows))
        most = float(np.linalg.norm(feasible)) * 1.001
        fast = nearest(rows, bounds, rng.normal(scale=5.0, size=axes))[0]
        kept = kept_limit(rows, bounds, most, fast)
        within, by_kernel = keep_limit(rows, bounds, len(rows), most, Vec(tuple(fast)))
        assert within
        np.testing.assert_allclose([*by_kernel], kept, atol=1e-9)
        assert np.linalg.norm(kept) <= most * (1.0 + 1e-9)
        assert (rows @ kept >= bounds - 1e-2).all()
        slower = fast * min(1.0, most / np.linalg.norm(fast))
        broken += bool((rows @ slower < bounds - 1e-2).any())
    assert broken > 20


@pytest.mark.parametrize("axes", [2, 3])
def test_conditions_beyond_the_speed_limit_are_broken_least(axes: int) -> None:
    """As where bodies leave no way: all are kept as far as the limit lets them, those of near bodies most."""
    rng, most, seen = np.random.default_rng(axes), 1.0, 0
    others = rng.normal(size=(4000, axes))
    others *= most * (rng.random((4000, 1)) ** (1.0 / axes)) / np.linalg.norm(others, axis=1, keepdims=True)
    for _ in range(200):
        rows = rng.normal(size=(int(rng.integers(1, 6)), axes))
        rows /= np.linalg.norm(rows, axis=1, keepdims=True)
        bounds, gaps = rng.normal(scale=3.0, size=len(rows)), rng.uniform(-0.1, 1.0, size=len(rows))
        nominal = rng.normal(scale=0.3, size=axes)
        fast = nearest(rows, bounds, nominal)[0]
        slowest = nearest(rows, bounds, np.zeros(axes))[0]
        if np.linalg.norm(slowest) <= most and not contradicting(rows, bounds, np.zeros(axes), slowest):
            continue
        assert contradicting(rows, bounds, nominal, fast) or kept_limit(rows, bounds, most, fast) is None
        kept, wanted = broken_least(rows, bounds, gaps, 0.5, most, nominal), Vec(tuple(nominal))
        by_kernel = break_least(rows.copy(), bounds.copy(), gaps, len(rows), 0.5, most, wanted)
        np.testing.assert_allclose([*by_kernel], kept, atol=1e-8)
        assert np.linalg.norm(kept) <= most * (1.0 + 1e-9)
        weights = np.clip(0.5 / np.maximum(gaps, 1e-9), 1.0, 10.0) ** 2
        broken = [(weights * np.maximum(bounds - v @ rows.T, 0.0) ** 2).sum(axis=-1) for v in (kept, others)]
        assert broken[0] <= broken[1].min() + 1e-4
        seen += 1
    assert seen > 100


@pytest.mark.slow_cases("surface-3")
@pytest.mark.crossed
@pytest.mark.parametrize(
    "rules", [Rules(2.0, UNLIMITED, 0.0, 0.0, 0.0, 0.0), Rules(4.0, 3.0, 0.0, 1.0, 0.0, 0.0)]
)
@pytest.mark.parametrize("axes", [2, 3])
@pytest.mark.parametrize("measure", ["center", "surface"])
def test_no_distance_falls_below_the_safe_one(measure: str, axes: int, rules: Rules) -> None:
    """Robots swap places through the middle, where an obstacle stands; one of them has stopped for good."""
    rng = np.random.default_rng(3)
    setup, _, _, _, _ = crowd(axes, 1)
    avoid = AvoidObstacles(safe_distance=1.0, teammate_distance=0.7, measure=measure)
    q = 4.0 * np.vstack([np.eye(axes), -np.eye(axes)]) + rng.normal(scale=0.1, size=(2 * axes, axes))
    n = len(q)
    setup = replace(
        setup,
        behaviors=(avoid, Surface()),
        obstacle_position=np.zeros((1, axes)),
        obstacle_radius=np.array([0.4]),
        robot_radius=np.full(n, 0.2),
    )
    goal, lost = -q, np.arange(n) == 1
    q[1] *= 0.6
    bodies = measure == "surface"
    nearest = {"obstacle": math.inf, "lost": math.inf, "mate": math.inf}
    for _ in range(800):
        nominal = np.clip(goal - q, -2.0, 2.0)
        v, _ = filtered(rules, setup, avoid, nominal, q, lost)
        v[lost] = 0.0
        q = q + 0.005 * v
        gaps = np.linalg.norm(q[:, None] - q, axis=2) + 100.0 * np.eye(n) - 0.4 * bodies
        nearest["obstacle"] = min(nearest["obstacle"], np.linalg.norm(q, axis=1).min() - 0.6 * bodies)
        nearest["lost"] = min(nearest["lost"], gaps[:, lost].min())
        nearest["mate"] = min(nearest["mate"], gaps[:, ~lost][~lost].min())
    assert 0.99 < nearest["obstacle"] < 1.01
    assert nearest["lost"] > 0.99 and nearest["mate"] > 0.69


def test_one_wall_takes_the_velocity_into_it() -> None:
    """One constraint: the tangential part stays, the part toward the obstacle is what the barrier allows."""
    setup, avoid, _, _, _ = crowd(2, 0)
    setup = replace(
        setup,
        obstacle_position=np.zeros((1, 2)),
        obstacle_radius=np.array([0.5]),
        robot_radius=np.array([0.2]),
    )
    avoid = AvoidObstacles(safe_distance=1.0, measure="center")
    rules, q, lost = barrier(2.0), np.array([[1.5, 0.0]]), np.array([False])
    v, moved = filtered(rules, setup, avoid, np.array([[-3.0, 0.7]]), q, lost)
    assert moved[0]
    np.testing.assert_allclose(v, [[-2.0 * 0.5 - 2.0 / (STIFFNESS + 1.0), 0.7]], rtol=1e-12)
    for harmless in ([[3.0, 0.7]], [[-0.99, -5.0]]):
        v, moved = filtered(rules, setup, avoid, np.array(harmless), q, lost)
        assert not moved[0] and np.array_equal(v, harmless)
    inside = np.array([[0.25, 0.0]])
    v, _ = filtered(rules, setup, avoid, np.zeros((1, 2)), inside, lost)
    np.testing.assert_allclose(v, [[2.0 * 0.75, 0.0]], rtol=1e-3)
    v, _ = filtered(rules, setup, avoid, np.zeros((1, 2)), 0.0 * inside, lost)  # no way is out: any is
    np.testing.assert_allclose(v, [[2.0, 0.0]], rtol=1e-3)
    v, _ = filtered(
        rules, setup, avoid, np.full((1, 2), np.nan), q, lost
    )  # of a mission that breaks: it ends
    assert np.isnan(v).all()


def test_how_far_constraints_that_can_be_kept_are_violated() -> None:
    """A single one by 1e-4 of the change, as docs/baselines.md says; several by more."""
    random, worst = np.random.default_rng(0), {1: 0.0, 8: 0.0}
    for _ in range(500):
        for count in worst:
            rows = random.normal(size=(count, 2))
            rows /= np.linalg.norm(rows, axis=1, keepdims=True)
            inside = random.normal(size=2)
            bounds = rows @ inside - random.exponential(0.3, count)
            wanted = inside + 2.0 * random.normal(size=2)
            v, moved = nearest(rows, bounds, wanted)
            if moved:
                share = float((bounds - rows @ v).max() / np.linalg.norm(v - wanted))
                worst[count] = max(worst[count], share)
    assert worst[1] == pytest.approx(1e-4, rel=1e-3)
    assert 1e-4 < worst[8] < 2e-3


def test_contradictions_end_in_the_least_violation() -> None:
    """Between two obstacles too close to each other a robot goes to the middle."""
    setup, _, _, _, _ = crowd(2, 0)
    setup = replace(
        setup,
        obstacle_position=np.array([[-1.0, 0.0], [1.0, 0.0]]),
        obstacle_radius=np.full(2, 0.1),
        robot_radius=np.array([0.2]),
    )
    avoid = AvoidObstacles(safe_distance=2.0, measure="center")
    q, lost = np.array([[0.3, 0.0]]), np.array([False])
    v, _ = filtered(barrier(1.0), setup, avoid, np.array([[5.0, 0.3]]), q, lost)
    # r = (1, 0) asks for at least 0.7, r = (-1, 0) for at least 1.3: halfway is -0.3.
    np.testing.assert_allclose(v, [[-0.3, 0.3]], atol=1e-3)


@pytest.mark.parametrize("axes", [2, 3])
def test_repulsion_is_khatibs(axes: int) -> None:
    for seed in range(40):
        setup, avoid, q, _, lost = crowd(axes, seed)
        field = PotentialField(gain=0.7, least_distance=0.15)
        v, repelled = by_kernel(field, setup, avoid, q, lost)
        push, near = repulsions(field, avoid, situation(setup, q, lost))
        np.testing.assert_array_equal(repelled, near)
        np.testing.assert_allclose(v, push, rtol=0.0, atol=1e-10 * max(1.0, np.abs(push).max()))


def test_repulsion_is_the_gradient_of_its_potential() -> None:
    """gain / 2 (1/d - 1/d_0)^2, by differences."""
    setup, _, _, _, _ = crowd(3, 1)
    setup = replace(
        setup,
        obstacle_position=np.array([[0.2, -0.1, 0.4]]),
        obstacle_radius=np.array([0.3]),
        robot_radius=np.array([0.2]),
        force_limit=np.array([math.inf]),
    )
    avoid, field = AvoidObstacles(safe_distance=1.5, measure="surface"), PotentialField(gain=0.4)

    def potential(q: np.ndarray) -> float:
        d = float(np.linalg.norm(q - setup.obstacle_position[0])) - 0.5
        return 0.2 * (1.0 / d - 1.0 / 1.5) ** 2 if d < 1.5 else 0.0

    for q in np.array([[1.0, 0.5, 0.9], [1.2, -0.4, 0.0], [3.0, 0.0, 0.0]]):
        push, repelled = by_kernel(field, setup, avoid, q[None], np.array([False]))
        steps = 1e-6 * np.eye(3)
        gradient = [(potential(q + step) - potential(q - step)) / 2e-6 for step in steps]
        np.testing.assert_allclose(push[0], -np.array(gradient), rtol=1e-6, atol=1e-9)
        assert repelled[0] == (potential(q) > 0.0)


def test_the_least_change_is_the_least() -> None:
    """No neighbor of the solution costs less."""
    rng = np.random.default_rng(5)
    for _ in range(50):
        rows = rng.normal(size=(4, 3))
        rows /= np.linalg.norm(rows, axis=1, keepdims=True)
        missing = rng.normal(size=4)
        missing[0] = 1.0

        def cost(x: np.ndarray, rows=rows, missing=missing) -> float:
            return float(x @ x + STIFFNESS * np.sum(np.maximum(missing - rows @ x, 0.0) ** 2))

        x = least_change(rows, missing, STIFFNESS)
        assert all(cost(x) <= cost(x + 1e-4 * rng.normal(size=3)) for _ in range(50))


@pytest.mark.parametrize("loop", OUTER_LOOPS, ids=lambda loop: loop.__name__)
def test_a_file_of_an_outer_loop_says_all_of_it(loop: type[OuterLoop]) -> None:
    name = loop.model_fields["loop"].default
    assert loop.__module__ == f"escort_mj.control.outer_loops.{name}"
    assert loop.title and loop.__doc__
    assert [other for other in OUTER_LOOPS if name == other.model_fields["loop"].default] == [loop]
    assert velocities.dispatch(loop) is not velocities.dispatch(OuterLoop), "the oracle has it"
    assert set(loop.numbers()) >= set(loop.model_fields) - {"loop"}, "what its kernel reads"
    assert loop.composes or "velocity_lanes" in vars(loop), "something writes the velocities"
    assert not loop.avoids or "velocity_lanes" in vars(loop), "something avoids"


def test_a_scenario_may_name_every_outer_loop() -> None:
    for loop in OUTER_LOOPS:
        named = Scenario.model_validate({"mission": {"outer": loop.model_fields["loop"].default}})
        assert named.mission.outer == loop.model_validate({})


@pytest.mark.parametrize("coming", [-1.0, -0.2, 0.0, 0.3, 2.0])
def test_a_teammate_that_does_not_do_its_half_is_left_to_come_no_nearer(coming: float) -> None:
    """Two teammates within their safe distance: the second one moves toward the first."""
    setup, avoid, *_ = crowd(2, 1)
    setup = replace(setup, obstacle_position=np.zeros((0, 2)), obstacle_radius=np.zeros(0))
    avoid = avoid.model_copy(update={"teammates": True, "teammate_distance": 1.0, "measure": "center"})
    n = setup.count
    q, v = np.arange(n)[:, None] * [50.0, 0.0], np.zeros((n, 2))
    q[1] = q[0] + [0.8, 0.0]
    v[1] = [-coming, 0.0]
    rules = Rules(2.0, UNLIMITED, 0.0, 1.0, 0.0, 1.0)
    turned = np.tile(np.eye(2), (n, 1, 1))
    team = KnownRobots.whole(setup)
    now = Situation(setup_now(setup), team, turned, q, v, 0.0 * q, 0.0 * q + 1e4, 0.0 * q, q, v)
    first, second = (constraints_of(avoid, rules, now)[robot].bounds[0] for robot in (0, 1))
    half = -0.5 * approach(-0.2, rules)
    assert first == pytest.approx(max(half, coming + 2.0 * half)), "away at least as fast as it comes"
    assert second == pytest.approx(2.0 * half), "the first one stands, and does not do its half"


@pytest.mark.parametrize("outer", ["nsb", "set_based", "barrier_filter", "potential_field"])
def test_in_every_outer_loop_robots_go_to_their_goals(compiled: None, outer: str) -> None:
    """Goals are in the world's frame, as avoidance is, which a loop may do in its own way."""
    goals = {"behavior": "goal", "goals": [[2.0, 0.5], [-2.0, -0.5]]}
    mission = {"outer": outer, "behaviors": [{"behavior": "avoid_obstacles", "safe_distance": 0.3}, goals]}
    robots = {"positions": [[0.0, 1.0], [0.0, -1.0]]}
    run = fly(Scenario(duration=12.0, target=None, robots=robots, mission=mission))
    assert run.measures["arrived"].value == 1.0 and run.message == "completed 12 s"
    slots = {"behavior": "formation", "offsets": [[0.0, 1.0], [0.0, -1.0]]}
    along = {"position": ["0.3*t", 0.0]}
    following = Scenario(
        duration=12.0, target=along, robots=robots, mission={"outer": outer, "behaviors": [slots]}
    )
    assert fly(following).measures["goal_distance_max"].value < 0.01
