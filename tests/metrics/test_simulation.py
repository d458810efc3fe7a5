import numpy as np
import pytest

from escort_mj.measuring import measure
from tests.metrics.motions import TIME, steps


class TestPhysics:
    def test_tunneling_is_the_sum_of_the_two_largest_speeds(self, make_trace):
        """Robots of 0.4 m; 100 and 60 m/s in one sample, the target at 80: 180 m/s times 2 ms over 0.4 m."""
        speed, target = np.ones((501, 2)), np.zeros(501)
        speed[40] = 60.0, 100.0
        target[40] = 80.0
        found = measure("tunneling", make_trace(TIME, robots=2, speed_max=speed, target_speed_max=target))
        assert found[:3] == (pytest.approx(0.9), TIME[40], ("robot_2", "robot_1"))

    def test_tunneling_does_not_depend_on_which_steps_share_a_sample(self, make_trace):
        speed, target = np.ones((501, 1)), np.zeros(501)
        speed[40], target[300] = 60.0, 80.0
        found = measure("tunneling", make_trace(TIME, robots=1, speed_max=speed, target_speed_max=target))
        assert found[:3] == (pytest.approx(140.0 * 0.002 / 0.4), TIME[300], ("target", "robot_1"))

    def test_a_moving_obstacle_can_be_the_fastest(self, make_trace):
        speed = np.zeros((501, 1))
        speed[41] = 100.0
        found = measure("tunneling", make_trace(TIME, robots=1, obstacles=1, obstacle_speed_max=speed))
        assert found[:3] == (pytest.approx(100.0 * 0.002 / 0.4), TIME[41], ("rock 1", "robot_1"))

    def test_the_largest_kinetic_energy(self, make_trace):
        found = measure("kinetic_energy_max", make_trace(TIME, kinetic_energy=steps(TIME, 3.0)))
        assert found[:2] == (1.0, pytest.approx(3.0))
