"""The NumPy controller: its clock and its choice of intruder; formations that the compiled one reaches."""

import math
from dataclasses import replace

import numpy as np
import pytest

from escort_mj.behaviors import AvoidObstacles, Chords, Surface
from escort_mj.control.setup import Setup
from escort_mj.laws import ApdSmc
from escort_mj.numerics.formation import OCTAHEDRON, Arrangement, arrange
from escort_mj.scenario.geometry.trajectory import Trajectory
from escort_mj.sensing.sensors import Sensors
from escort_mj.sensors import Plain
from tests.control.twins import Kernel, vector
from tests.oracle.behaviors import intrusion
from tests.oracle.reference import ReferenceController

PAPER_2D = np.array([(5, 10), (-5, 5), (-5, -5), (5, -10), (5, 0)], dtype=float)
PAPER_3D = np.array(
    [(10, 1, 0), (1, 10, 0.3), (-10, 0, 1), (0, 0.5, -10), (0, -10, 0.3), (0, 0, 10)], dtype=float
)


def line(start: tuple[float, ...], rate: tuple[float, ...]) -> Trajectory:
    """A vector in uniform motion."""
    return vector(*(f"{a} + {b}*t" for a, b in zip(start, rate, strict=True)))


def mission(q: np.ndarray, start: tuple[float, ...], rate: tuple[float, ...] | None = None) -> Setup:
    """The paper's mission for robots at q, without obstacles, noise and disturbance."""
    count, axes = q.shape
    target = line(start, rate or (0.0,) * axes)
    return Setup(
        timestep=0.002,
        seed=0,
        behaviors=(AvoidObstacles(measure="center"), Chords(), Surface()),
        law=ApdSmc(),
        radius=5.0,
        target_feedforward=True,
        max_speed=math.inf,
        arrangement=arrange(q, np.array(start), 5.0) if (axes, count) in ((2, 5), (3, 6)) else None,
        obstacle_position=np.zeros((0, axes)),
        obstacle_radius=np.zeros(0),
        robot_radius=np.full(count, 0.2),
        force_limit=np.full(count, 10.0),
        sensing=Sensors(),
        target=target,
        disturbance=None,
    )


def edges(arrangement: Arrangement, q: np.ndarray) -> np.ndarray:
    return np.linalg.norm(q[arrangement.pairs[:, 0]] - q[arrangement.pairs[:, 1]], axis=1)


def distances(q: np.ndarray, center: np.ndarray) -> np.ndarray:
    return np.linalg.norm(q - center, axis=1)


def fly(setup: Setup, q: np.ndarray, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Kinematic closed loop: the robots move exactly as the outer loop asks; last q and target position."""
    setup = replace(setup, timestep=0.04)
    kernel = Kernel(setup)
    v = np.zeros_like(q)
    for step in range(round(seconds / setup.timestep)):
        v = kernel.evaluate(step * setup.timestep, q, v).v_d.copy()
        q = q + setup.timestep * v
    return q, setup.target.position(seconds)


KEPT = ("q_measured", "q_d", "v_d", "avoidance_active")


def drive(setup: Setup, q: np.ndarray, seconds: float) -> dict[str, np.ndarray]:
    """Dynamic closed loop: point masses of 1 kg under the law, with the force limit; signals over time."""
    kernel = Kernel(setup)
    v, history = np.zeros_like(q), []
    for step in range(round(seconds / setup.timestep)):
        state = kernel.evaluate(step * setup.timestep, q, v)
        force = np.clip(state.tau, -setup.force_limit[:, None], setup.force_limit[:, None])
        v = v + setup.timestep * (force + state.disturbance)
        q = q + setup.timestep * v
        history.append([getattr(state, name).copy() for name in KEPT])
    return {name: np.array(rows) for name, rows in zip(KEPT, zip(*history, strict=True), strict=True)}


@pytest.mark.parametrize(
    ("q", "start", "edge"),
    [(PAPER_2D, (3.0, 0.0), 5.878), (PAPER_3D, (0.0, 0.0, 0.0), 7.071)],
    ids=["pentagon", "octahedron"],
)
def test_robots_reach_the_even_figure(q: np.ndarray, start: tuple[float, ...], edge: float) -> None:
    setup = mission(q, start)
    q, c = fly(setup, q, 40.0)
    np.testing.assert_allclose(distances(q, c), 5.0, atol=1e-3)
    np.testing.assert_allclose(edges(setup.arrangement, q), edge, atol=1e-3)


@pytest.mark.parametrize(("feedforward", "lag"), [(True, (0.0, 1e-3)), (False, (0.05, 0.2))])
def test_feedforward_removes_the_lag(feedforward: bool, lag: tuple[float, float]) -> None:
    setup = replace(mission(PAPER_2D, (3.0, 0.0), (0.1, 0.0)), target_feedforward=feedforward)
    q, c = fly(setup, PAPER_2D, 40.0)
    assert lag[0] <= np.abs(distances(q, c) - 5.0).max() <= lag[1]


@pytest.mark.parametrize("speed", [math.inf, 1.5])
def test_the_law_brings_real_masses_there(speed: float) -> None:
    """The octahedron from nearby, with noise and disturbance: within 5 mm over the last second."""
    q = 6.0 * OCTAHEDRON
    setup = replace(
        mission(q, (0.0, 0.0, 0.0)),
        max_speed=speed,
        sensing=Sensors(Plain(noise=0.02), Plain(noise=0.01)),
        disturbance=line((0.3, -0.2, 0.4), (0.0, 0.0, 0.0)),
    )
    history = drive(setup, q, 7.0)
    q = history["q_measured"][-500:].mean(axis=0)
    np.testing.assert_allclose(distances(q, np.zeros(3)), 5.0, atol=5e-3)
    np.testing.assert_allclose(edges(setup.arrangement, q), 7.071, atol=5e-3)
    assert np.linalg.norm(history["v_d"], axis=2).max() <= speed * (1.0 + 1e-9)


def test_robots_pass_an_obstacle_at_the_safe_distance() -> None:
    q = np.array([[5.0, 0.3]])
    setup = replace(
        mission(q, (0.0, 0.0), (0.5, 0.0)),
        behaviors=(AvoidObstacles(measure="center", safe_distance=2.0), Surface()),
        obstacle_position=np.array([[8.0, 0.0]]),
        obstacle_radius=np.array([0.5]),
        sensing=Sensors(Plain(noise=0.02), Plain(noise=0.01)),
        max_speed=2.0,
    )
    history = drive(replace(setup, timestep=0.01), q, 14.0)
    gap = np.linalg.norm(history["q_d"][:, 0] - setup.obstacle_position, axis=1)
    assert history["avoidance_active"].any() and not history["avoidance_active"][-1].any()
    assert 1.9 < gap.min() < 2.1


def test_first_evaluation_starts_at_the_robots() -> None:
    controller = ReferenceController(mission(PAPER_2D, (3.0, 0.0)))
    controller.reset(PAPER_2D)
    signals = controller.evaluate(5.0, PAPER_2D, 0.0 * PAPER_2D)
    np.testing.assert_array_equal(signals.q_d, PAPER_2D)
    np.testing.assert_array_equal(signals.e, 0.0)
    np.testing.assert_array_equal(signals.rho_hat, 0.1)


def test_state_moves_once_per_step_by_the_last_rates() -> None:
    setup = replace(mission(PAPER_2D, (3.0, 0.0), (0.1, 0.0)), force_limit=np.full(5, math.inf))
    controller = ReferenceController(setup)
    controller.reset(PAPER_2D)
    v = 0.1 * PAPER_2D
    controller.evaluate(0.0, PAPER_2D, 0.0 * v)
    last = controller.evaluate(0.0, PAPER_2D, v)  # at one time the last evaluation counts
    np.testing.assert_array_equal(last.q_d, PAPER_2D)
    after = controller.evaluate(setup.timestep, PAPER_2D, v)
    again = controller.evaluate(setup.timestep, PAPER_2D, v)
    np.testing.assert_allclose(after.q_d, last.q_d + setup.timestep * last.v_d, atol=1e-14)
    np.testing.assert_allclose(after.rho_hat, last.rho_hat + setup.timestep * 20.0 * last.s, atol=1e-14)
    for one, other in zip(after, again, strict=True):
        np.testing.assert_array_equal(one, other)


ROW = np.array([[0.0, 0.0], [1.5, 0.0], [9.0, 0.0]])
NEAR = replace(
    mission(ROW, (0.0, 0.0)),
    obstacle_position=np.array([[-2.0, 0.0], [0.0, 3.0]]),
    obstacle_radius=np.array([0.1, 1.5]),
    robot_radius=np.array([0.2, 0.4, 0.3]),
)


@pytest.mark.parametrize(
    ("avoid", "depth", "intruder"),
    [
        # Center to center the teammate at 1.5 m is nearest; its safe distance may be another.
        (AvoidObstacles(measure="center", safe_distance=2.2), 0.7, (1.5, 0.0)),
        (AvoidObstacles(measure="center", safe_distance=2.2, teammate_distance=1.6), 0.2, (-2.0, 0.0)),
        (AvoidObstacles(measure="center", safe_distance=2.2, teammate_distance=1.71), 0.21, (1.5, 0.0)),
        (AvoidObstacles(measure="center", safe_distance=2.2, teammates=False), 0.2, (-2.0, 0.0)),
        # Surface to surface the large obstacle is nearer (3 - 0.2 - 1.5) than the small one (2 - 0.2 - 0.1).
        (AvoidObstacles(measure="surface", safe_distance=2.2, teammates=False), 0.9, (0.0, 3.0)),
        (AvoidObstacles(measure="surface", safe_distance=2.2), 1.3, (1.5, 0.0)),
    ],
)
def test_the_deepest_intruder_rules(avoid: AvoidObstacles, depth: float, intruder: tuple) -> None:
    found, position = intrusion(avoid, ROW, NEAR)
    assert found[0] == pytest.approx(depth)
    np.testing.assert_array_equal(position[0], intruder)


def test_obstacles_come_before_robots_and_the_first_wins() -> None:
    q = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    setup = replace(NEAR, obstacle_position=np.array([[0.0, -1.0], [-1.0, 0.0]]))
    avoid = AvoidObstacles(measure="center")
    np.testing.assert_array_equal(intrusion(avoid, q, setup)[1][0], [0.0, -1.0])
    alone = replace(setup, obstacle_position=np.zeros((0, 2)), obstacle_radius=np.zeros(0))
    np.testing.assert_array_equal(intrusion(avoid, q, alone)[1][0], [1.0, 0.0])


def test_nobody_intrudes_on_a_lone_robot() -> None:
    setup = mission(np.zeros((1, 3)), (0.0, 0.0, 0.0))
    depth, _ = intrusion(AvoidObstacles(), np.zeros((1, 3)), setup)
    assert depth[0] == -math.inf
    controller = ReferenceController(replace(setup, behaviors=(AvoidObstacles(), Surface())))
    controller.reset(np.zeros((1, 3)))
    signals = controller.evaluate(0.0, np.zeros((1, 3)), np.zeros((1, 3)))
    assert not signals.avoidance_active.any()
    np.testing.assert_array_equal(signals.v_d, 0.0)  # on the target no direction leads to the surface


def test_avoidance_is_off_exactly_at_the_safe_distance() -> None:
    setup = replace(NEAR, behaviors=(AvoidObstacles(measure="center", safe_distance=2.0, teammates=False),))
    controller = ReferenceController(setup)
    controller.reset(ROW)
    assert not controller.evaluate(0.0, ROW, 0.0 * ROW).avoidance_active[0]
    assert controller.evaluate(0.0, ROW - [[1e-9, 0.0]], 0.0 * ROW).avoidance_active[0]


def test_robot_on_an_obstacle_leaves_along_the_first_axis() -> None:
    setup = replace(NEAR, behaviors=(AvoidObstacles(measure="center", safe_distance=1.0),))
    q = ROW.copy()
    q[2] = NEAR.obstacle_position[1]
    controller = ReferenceController(setup)
    controller.reset(q)
    signals = controller.evaluate(0.0, q, np.array([[0.0, 0.0], [0.0, 0.0], [0.0, 0.3]]))
    np.testing.assert_allclose(signals.v_d[2], [0.3 + 0.1 * 1.0, 0.0])
