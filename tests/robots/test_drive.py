"""What drives make of a demand: kernels against their twins, and against what the actuators do."""

import numpy as np
import pytest

from escort_mj.robots import attitude, drive
from escort_mj.robots.drive import FORCE, THRUST, DriveModel, Input
from tests.oracle.attitude import wanted_rotation

RNG = np.random.default_rng(7)
controls_for, thrust_within = drive.controls_for, drive.thrust_within
ROTORS = [(-0.14, -0.18), (-0.14, 0.18), (0.14, 0.18), (0.14, -0.18)]


def rotors(yaw: float = 0.02) -> DriveModel:
    """Four rotors of which each turns the body as it pushes."""
    effect = np.array([[1.0, y, -x, s * yaw] for (x, y), s in zip(ROTORS, (1, -1, 1, -1), strict=True)]).T
    mix = np.linalg.pinv(effect)
    rows = [Input(k, 0.0, 0.0, 13.0, 1.0, *mix[k], 0.0, 0.0, 0.0, 0.0, 1.0) for k in range(4)]
    return DriveModel(THRUST, "thrust", (0.0, 0.0, 0.0), tuple(rows))


def by_kernel(model: DriveModel, demand: np.ndarray) -> np.ndarray:
    table, found, demand = np.array(model.inputs), np.full(len(model.inputs), np.nan), demand.copy()
    count = 6
    if model.mode == THRUST:
        demand[0], count = thrust_within(demand, table, 0, len(table)), 4
    controls_for(demand, count, table, 0, len(table), found)
    return found


@pytest.mark.parametrize("size", [1.0, 30.0], ids=["within", "beyond"])
def test_kernels_are_their_twins(size: float) -> None:
    mix = RNG.normal(size=(5, 6))
    rows = [Input(k, 0.3 * k, -2.0, 3.0, 1.0, *mix[k], 0.0, 0.0, 0.0) for k in range(5)]
    pushed = DriveModel(FORCE, "force", (0.0, 0.0, 0.0), tuple(rows))
    for _ in range(100):
        demand = RNG.normal(scale=size, size=6)
        for model in (pushed, rotors()):
            np.testing.assert_allclose(by_kernel(model, demand), drive.controls(model, demand), atol=1e-12)


def test_torque_comes_before_thrust() -> None:
    """Asked for more thrust than there is, the rotors still make the torque."""
    model, effect = rotors(), np.array([[1.0, y, -x, 0.0] for x, y in ROTORS]).T
    thrusts = drive.controls(model, np.array([500.0, 0.4, -0.3, 0.01, 0.0, 0.0]))
    assert thrusts.max() == pytest.approx(13.0)
    np.testing.assert_allclose((effect @ thrusts)[1:3], [0.4, -0.3], atol=1e-12)


def test_free_heading_is_the_heading_that_there_is() -> None:
    toward = attitude.axes_toward
    for _ in range(50):
        force, axes = RNG.normal(size=3) + [0.0, 0.0, 4.0], np.empty((3, 3))
        heading = np.array([np.cos(1.3), np.sin(1.3), 0.0])
        toward(force, heading, axes)
        np.testing.assert_allclose(axes.T, wanted_rotation(force, heading), atol=1e-14)
        assert axes[0] @ heading > 0.0
