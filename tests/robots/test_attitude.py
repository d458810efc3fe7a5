"""The attitude loop: against its twin, and against what four thrusts do to a rigid body."""

import numpy as np
import pytest

from escort_mj.robots import attitude
from escort_mj.robots.attitude import Craft
from escort_mj.robots.quadrotor import Quadrotor
from tests.oracle.attitude import mixing, rotation, thrusts_for, wanted_rotation

GRAVITY = (0.0, 0.0, -9.81)
CRAFT = Quadrotor().craft(1.2, 0.25, GRAVITY, 0.75)
RNG = np.random.default_rng(4)


fly = attitude.fly_craft


def kernel_thrusts(force: np.ndarray, orientation: np.ndarray, rate: np.ndarray, craft: Craft) -> np.ndarray:
    thrusts = np.empty(4)
    fly(force.copy(), orientation, rate, np.array(craft), thrusts)
    return thrusts


def some_orientation(spread: float) -> np.ndarray:
    quaternion = np.array([1.0, 0.0, 0.0, 0.0]) + spread * RNG.normal(size=4)
    return quaternion / np.linalg.norm(quaternion)


@pytest.mark.parametrize("spread", [0.0, 0.1, 5.0], ids=["level", "near", "anyhow"])
def test_the_kernel_is_the_twin(spread: float) -> None:
    for _ in range(200):
        force = RNG.normal(scale=8.0, size=3) + [0.0, 0.0, 12.0]
        orientation, rate = some_orientation(spread), RNG.normal(scale=spread, size=3)
        found = kernel_thrusts(force, orientation, rate, CRAFT)
        np.testing.assert_allclose(found, thrusts_for(force, orientation, rate, CRAFT), rtol=0, atol=1e-11)


def test_rotation_is_that_of_mujoco() -> None:
    mujoco = pytest.importorskip("mujoco")
    for _ in range(20):
        orientation, expected = some_orientation(3.0), np.empty(9)
        mujoco.mju_quat2Mat(expected, orientation)
        np.testing.assert_allclose(rotation(orientation).ravel(), expected, rtol=0, atol=1e-14)


def test_level_and_at_rest_all_rotors_push_alike() -> None:
    lift = np.array([0.0, 0.0, 1.2 * 9.81])
    thrusts = kernel_thrusts(lift, np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3), CRAFT)
    np.testing.assert_allclose(thrusts, lift[2] / 4, rtol=1e-14)


def test_mixing_and_its_inverse_are_one() -> None:
    """Where no rotor is at a limit, the thrusts make just the force along the body and the torque wanted."""
    craft = CRAFT._replace(rotor_limit=1e6)
    for _ in range(100):
        force, orientation = RNG.normal(scale=2.0, size=3) + [0.0, 0.0, 60.0], some_orientation(0.02)
        rate = RNG.normal(scale=0.02, size=3)
        thrusts = kernel_thrusts(force, orientation, rate, craft)
        assert thrusts.min() > 0.0
        actual, inertia = rotation(orientation), np.array(craft[6:9])
        skew = wanted_rotation(force).T @ actual
        error = 0.5 * np.array([skew[2, 1] - skew[1, 2], skew[0, 2] - skew[2, 0], skew[1, 0] - skew[0, 1]])
        torque = -inertia * (craft.stiffness_x * error + craft.damping_x * rate)
        torque += np.cross(rate, inertia * rate)
        made = mixing(craft) @ thrusts
        np.testing.assert_allclose(made, [force @ actual[:, 2], *torque], rtol=1e-12, atol=1e-12)


def test_torque_comes_before_thrust() -> None:
    """Asked for more than the rotors have, it keeps its torque and gives up force."""
    tilted = np.array([np.cos(0.2), np.sin(0.2), 0.0, 0.0])
    free = mixing(CRAFT) @ kernel_thrusts(np.array([0.0, 0.0, 8.0]), tilted, np.zeros(3), CRAFT)
    full = mixing(CRAFT) @ kernel_thrusts(np.array([0.0, 0.0, 500.0]), tilted, np.zeros(3), CRAFT)
    np.testing.assert_allclose(full[1:], free[1:], rtol=1e-12, atol=1e-14)
    thrusts = kernel_thrusts(np.array([0.0, 0.0, 500.0]), tilted, np.zeros(3), CRAFT)
    assert thrusts.max() == pytest.approx(CRAFT.rotor_limit)


def test_force_is_cut_to_the_largest_tilt() -> None:
    """However much is wanted across, or downward, the wanted attitude tilts no further than told."""
    across, down = np.array([300.0, 0.0, 10.0]), np.array([0.0, 40.0, -50.0])
    for force in (across, down):
        forward = force / np.hypot(force[0], force[1]) * [1.0, 1.0, 0.0]
        upward = max(force[2], CRAFT.least_lift)
        edge = forward * upward * np.tan(Quadrotor().tilt_limit) + [0.0, 0.0, upward]
        level = np.array([1.0, 0.0, 0.0, 0.0])
        np.testing.assert_allclose(
            kernel_thrusts(force, level, np.zeros(3), CRAFT),
            kernel_thrusts(edge, level, np.zeros(3), CRAFT),
            rtol=1e-12,
        )
