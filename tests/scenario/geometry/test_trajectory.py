import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from escort_mj.scenario import Scenario, Trajectory, disturbance_trajectory, parse_scenario, target_trajectory
from tests.scenario.machine import evaluated


def by_machine(trajectory: Trajectory, t: float) -> tuple[np.ndarray, np.ndarray]:
    """Position and velocity from the compiled stack machine."""
    code, spans, table = trajectory.programs()
    pairs = [evaluated(code, table, t, first, count) for first, count in spans.tolist()]
    return np.array(pairs)[:, 0], np.array(pairs)[:, 1]


def through(points: list[tuple[float, list[float]]], interpolation: str) -> Trajectory:
    waypoints = [{"time": time, "position": position} for time, position in points]
    target = {"waypoints": waypoints, "interpolation": interpolation}
    return target_trajectory(Scenario.model_validate({"axes": len(points[0][1]), "target": target}))


POINTS = [(1.0, [0.0, 1.0]), (3.0, [4.0, 1.0]), (4.0, [4.0, -2.0]), (9.0, [-1.0, 0.5])]


def test_rests_at_the_origin_by_default():
    trajectory = target_trajectory(parse_scenario("axes: 3"))
    assert trajectory.position(5.0).tolist() == [0.0, 0.0, 0.0]
    assert trajectory.velocity(np.arange(4.0)).shape == (4, 3)
    np.testing.assert_array_equal(by_machine(trajectory, 1.0), np.zeros((2, 3)))


def test_follows_expressions():
    trajectory = target_trajectory(parse_scenario("target: {position: [3 + 0.1*t, sin(0.1*t)]}"))
    t = np.linspace(0.0, 100.0, 7)
    np.testing.assert_allclose(trajectory.position(t), np.column_stack([3 + 0.1 * t, np.sin(0.1 * t)]))
    np.testing.assert_allclose(
        trajectory.velocity(t), np.column_stack([np.full(7, 0.1), 0.1 * np.cos(0.1 * t)])
    )
    assert trajectory.position(2.0).shape == trajectory.velocity(2.0).shape == (2,)


def test_disturbance():
    assert disturbance_trajectory(parse_scenario("axes: 2")) is None
    force = disturbance_trajectory(parse_scenario("uncertainty: {disturbance: [0.5*sin(0.5*t), 2]}"))
    assert force is not None
    np.testing.assert_allclose(force.position(3.0), [0.5 * np.sin(1.5), 2.0])


def test_linear_waypoints():
    trajectory = through(POINTS, "linear")
    t = np.array([0.0, 1.0, 2.0, 3.5, 9.0, 20.0])
    np.testing.assert_allclose(
        trajectory.position(t), [[0, 1], [0, 1], [2, 1], [4, -0.5], [-1, 0.5], [-1, 0.5]]
    )
    np.testing.assert_allclose(trajectory.velocity(t), [[0, 0], [2, 0], [2, 0], [0, -3], [0, 0], [0, 0]])


def test_smooth_waypoints_start_and_end_at_rest_without_a_jump_in_velocity():
    trajectory = through(POINTS, "smooth")
    times, positions = zip(*POINTS, strict=True)
    np.testing.assert_allclose(trajectory.position(np.array(times)), positions, atol=1e-12)
    for time in times:
        around = trajectory.velocity(np.array([time - 1e-7, time + 1e-7]))
        np.testing.assert_allclose(around[0], around[1], atol=1e-5)
    np.testing.assert_allclose(trajectory.velocity(np.array([0.0, 1.0, 9.0, 20.0])), 0.0, atol=1e-12)


def test_one_waypoint_is_a_place_to_rest():
    for interpolation in ("linear", "smooth"):
        trajectory = through([(2.0, [1.0, 2.0, 3.0])], interpolation)
        for t in (0.0, 2.0, 5.0):
            np.testing.assert_array_equal(trajectory.position(t), [1.0, 2.0, 3.0])
            np.testing.assert_array_equal(trajectory.velocity(t), 0.0)


coordinates = st.floats(-100.0, 100.0)


@given(
    st.lists(st.tuples(st.floats(0.01, 10.0), coordinates, coordinates), min_size=1, max_size=6),
    st.sampled_from(["linear", "smooth"]),
    st.floats(0.0, 70.0),
)
def test_stack_machine_agrees_with_numpy(steps, interpolation: str, t: float):
    times = np.cumsum([step[0] for step in steps])
    points = [(float(time), [x, y]) for time, (_, x, y) in zip(times, steps, strict=True)]
    trajectory = through(points, interpolation)
    for instant in (t, *times.tolist()):
        position, velocity = by_machine(trajectory, instant)
        scale = 1.0 + np.abs(trajectory.velocity(times)).max()
        np.testing.assert_allclose(position, trajectory.position(instant), rtol=1e-12, atol=1e-12 * scale)
        np.testing.assert_allclose(velocity, trajectory.velocity(instant), rtol=1e-12, atol=1e-12 * scale)


def test_velocity_is_the_derivative_of_the_position():
    for interpolation in ("linear", "smooth"):
        trajectory = through(POINTS, interpolation)
        t = np.linspace(0.05, 9.95, 300)
        t = t[np.abs(t[:, np.newaxis] - [time for time, _ in POINTS]).min(axis=1) > 1e-3]
        difference = (trajectory.position(t + 1e-6) - trajectory.position(t - 1e-6)) / 2e-6
        assert trajectory.velocity(t) == pytest.approx(difference, abs=1e-6)
