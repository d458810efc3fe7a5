import numpy as np
import pytest

from escort_mj.measuring import measure
from tests.metrics.motions import TIME


class TestDistances:
    def test_the_nearest_of_robots_and_obstacles(self, make_trace):
        distance = np.full((501, 2, 3), 9.0)
        distance[40, 1, 2] = 1.25
        clearance, body = np.full((501, 2, 4), 4.0), np.full((501, 2, 4), 3)
        clearance[41, 0, 2], body[41, 0, 2] = -0.01, 4
        trace = make_trace(
            TIME,
            robots=2,
            obstacles=3,
            obstacle_distance=distance,
            clearance=clearance,
            clearance_body=body,
        )
        found = measure("obstacle_distance_min", trace)
        assert (found.value, found.time, found.who) == (1.25, TIME[40], "robot 2 and rock 3")
        found = measure("obstacle_clearance_min", trace)
        assert (found.value, found.time, found.who) == (-0.01, TIME[41], "robot 1 and rock 2")
        clearance[43, 1, 3], body[43, 1, 3] = -0.02, 5  # of the walls
        trace = make_trace(TIME, robots=2, obstacles=3, clearance=clearance, clearance_body=body)
        found = measure("obstacle_clearance_min", trace)
        assert (found.value, found.time, found.who) == (-0.02, TIME[43], "robot 2 and rock 3")

    def test_the_nearest_two_robots(self, make_trace):
        distance = np.full((501, 2), 3.0)
        distance[7] = 0.9
        clearance = np.repeat((distance - 0.4)[:, :, None], 4, axis=2)
        trace = make_trace(TIME, robots=2, robot_distance_min=distance, clearance=clearance)
        assert measure("robot_distance_min", trace)[:3] == (0.9, TIME[7], ("robot_1",))
        assert measure("robot_clearance_min", trace).value == pytest.approx(0.5)

    def test_a_least_of_zero_is_plain_zero(self, make_trace):
        value = measure("robot_clearance_min", make_trace(TIME, robots=2)).value
        assert str(value) == "0.0"

    def test_alone_in_an_empty_world(self, make_trace):
        trace = make_trace(TIME)
        for name, reason in {
            "obstacle_distance_min": "there are no obstacles",
            "obstacle_clearance_min": "there are no obstacles",
            "robot_distance_min": "there is one robot",
            "robot_clearance_min": "there is one robot",
        }.items():
            found = measure(name, trace)
            assert (found.value, found.reason) == (None, reason)
