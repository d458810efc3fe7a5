"""A differential drive on its wheels: rolling, acceleration, turning, and the limits of motors and tires."""

import numpy as np
import pytest

G = 9.81
MASS, RADIUS = 1.2, 0.2
TRACK, WHEEL, AHEAD, SHARE = 0.8 * RADIUS, 0.165 * RADIUS, 0.4 * RADIUS, 0.03
FAR = {"position": [1e3, 1e3]}


@pytest.fixture
def drive(make_world, record_steps):
    """Drives one robot with a force on its hand point; records, and the state of MuJoCo in each step."""

    def run(force, steps=1000, heading=0.0, floor=None, **keys):
        robots = {
            "kind": {"kind": "diff_drive", "heading": heading, **keys},
            "count": 1, "positions": [[0.5, -0.2]], "mass": MASS, "radius": RADIUS, "force_limit": 100.0,
        }  # fmt: skip
        world = make_world("force", robots=robots, target=FAR, environment={"floor": floor or {}})
        seen = []

        def push(plant):
            c, s = np.cos(heading), np.sin(heading)
            plant.state.tau[0] = c * force[0] - s * force[1], s * force[0] + c * force[1]

        def note(plant):
            data = plant.data
            ahead = data.xmat[1].reshape(3, 3)[:, 0]
            seen.append(
                [ahead @ data.qvel[:3], data.qvel[5], *data.qvel[6:8], *data.actuator_force, data.qpos[2]]
            )

        record = record_steps(world, steps, push, note)
        return record, np.array(seen).T

    return run


def rolling(speed: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Rates of the left and the right wheel with which neither slips [rad/s]."""
    return np.array([speed - 0.5 * TRACK * turn, speed + 0.5 * TRACK * turn]) / WHEEL


def test_it_accelerates_as_its_mass_and_the_inertia_of_its_wheels_say(drive) -> None:
    """A force F along it gives F / (m + 2 J / r^2), wheels roll, and nothing else moves."""
    force, rotor = 0.6, 2e-4
    record, (speed, turn, left, right, *torques, height) = drive([force, 0.0], 1000, 0.7, rotor_inertia=rotor)
    np.testing.assert_allclose(torques, 0.5 * force * WHEEL, rtol=1e-6)
    gained = (speed[-1] - speed[499]) / 1.0
    lever = WHEEL - (RADIUS - height[-1])  # the floor is a little soft
    assert 0.98 * WHEEL < lever < WHEEL
    turning = 0.5 * SHARE * MASS * WHEEL**2 + rotor
    exact = force * WHEEL / lever / (MASS + 2.0 * turning / lever**2)
    print(f"{gained:.5f} m/s^2; {exact:.5f}")
    assert gained == pytest.approx(exact, rel=5e-3)
    np.testing.assert_allclose([left, right], rolling(speed, turn), rtol=0, atol=0.02 * left[-1])
    assert np.abs(turn).max() < 1e-6
    np.testing.assert_allclose(
        record["force"][-1, 0], force * np.array([np.cos(0.7), np.sin(0.7)]), rtol=1e-6
    )


def test_a_force_across_turns_it(drive) -> None:
    """At first the hand point gives way as a mass I / d^2 does, and the axle stays."""
    force = 0.02
    _, (speed, turn, left, right, *torques, _) = drive([0.0, force], 50)
    chassis = MASS * (1.0 - 2.0 * SHARE)
    inertia = 0.5 * chassis * (0.6 * TRACK) ** 2 + (0.5 * TRACK) ** 2 * 3.0 * SHARE * MASS
    exact = AHEAD * force / inertia
    print(f"{turn[-1] / 0.1:.4f} rad/s^2; {exact:.4f}")
    assert turn[-1] / 0.1 == pytest.approx(exact, rel=0.03)
    torque = force * WHEEL * AHEAD / TRACK
    np.testing.assert_allclose(torques, np.transpose([[-torque, torque]] * 50), rtol=2e-3)
    assert np.abs(speed).max() < 0.02 * AHEAD * turn[-1]
    np.testing.assert_allclose([left[-1], right[-1]], rolling(speed[-1], turn[-1]), rtol=0.05)


def test_its_motors_have_their_limits(drive) -> None:
    limit = 0.01
    record, (speed, _, *_, left, right, _) = drive([50.0, 0.0], 200, torque_limit=limit)
    np.testing.assert_allclose([left, right], limit, rtol=1e-12)
    np.testing.assert_allclose(record["force"][:, 0, 0], 2.0 * limit / WHEEL, rtol=1e-6)
    np.testing.assert_allclose(record["drive_force"][:, 0, 0], 2.0 * limit / WHEEL, rtol=1e-6)


def test_wheels_spin_where_the_floor_does_not_hold_them(drive) -> None:
    """On a slippery floor it accelerates by friction times the weight on its wheels, and no more."""
    friction = 0.1
    _, (speed, _, left, *_) = drive([4.0, 0.0], 400, floor={"friction": friction})
    gained = (speed[-1] - speed[199]) / 0.4
    rim = left[-1] * WHEEL
    print(f"{gained:.3f} m/s^2 of at most {friction * G:.3f}; rim {rim:.1f}, robot {speed[-1]:.2f} m/s")
    assert 0.5 * friction * G < gained < friction * G
    assert rim > 3.0 * speed[-1]


def test_it_starts_rolling(drive, make_world, record_steps) -> None:
    """With any velocity of the hand point at the start, wheels roll from the first step."""
    robots = {
        "kind": {"kind": "diff_drive", "heading": 0.7}, "positions": [[0.0, 0.0]], "velocities": [[0.3, 0.2]],
        "mass": MASS, "radius": RADIUS,
    }  # fmt: skip
    world = make_world("force", robots=robots, target=FAR)
    rates = []
    record = record_steps(world, 100, after=lambda plant: rates.append(plant.data.qvel[5:8].copy()))
    np.testing.assert_allclose(record["v"][0, 0], [0.3, 0.2], atol=2e-3)
    turn, left, right = np.array(rates)[-1]
    speed = 0.5 * (left + right) * WHEEL
    np.testing.assert_allclose(speed, 0.3 * np.cos(0.7) + 0.2 * np.sin(0.7), rtol=0.02)
    np.testing.assert_allclose((right - left) * WHEEL / TRACK, turn, rtol=0.05)
