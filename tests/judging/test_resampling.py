"""Positions between time stamps, velocities without any, totals of forces."""

import numpy as np
import pytest

from escort_mj.judging.log import Track, differentiated
from escort_mj.judging.resampling import before, path_of, totals_of, velocity_of

TIME = np.array([10.0, 10.3, 10.5, 11.1, 11.2, 12.0])


def cubic(t: np.ndarray) -> np.ndarray:
    return np.stack([1.0 + 2.0 * t - t**2 + 0.5 * t**3, -t], axis=-1)


def rate(t: np.ndarray) -> np.ndarray:
    return np.stack([2.0 - 2.0 * t + 1.5 * t**2, -np.ones_like(t)], axis=-1)


def test_a_cubic_is_followed_exactly_between_uneven_stamps() -> None:
    track = Track("robot_1", "", TIME, {"position": cubic(TIME - 10), "velocity": rate(TIME - 10)})
    path, t = path_of(track, 10.0), np.linspace(0, 2, 201)
    assert np.abs(path.position(t) - cubic(t)).max() < 1e-12
    assert np.abs(path.velocity(t) - rate(t)).max() < 1e-11


def test_velocities_of_a_parabola_are_exact_between_uneven_stamps() -> None:
    assert np.abs(differentiated(TIME, TIME[:, None] ** 2) - 2.0 * TIME[:, None]).max() < 1e-11
    track = Track("robot_1", "", TIME, {"position": np.column_stack([TIME**2, TIME])})
    assert velocity_of(track) == pytest.approx(np.column_stack([2.0 * TIME, np.ones(6)]))


def test_totals_count_from_the_start() -> None:
    force = np.array([[3.0, 4.0], [0, 0], [1, 0], [1, 0], [-1, 0], [2, 0]])
    track = Track(
        "robot_1", "", TIME, {"position": np.zeros((6, 2)), "velocity": np.ones((6, 2)), "force": force}
    )
    totals = totals_of(track, 2.0, 10.3)
    assert totals["effort"] == pytest.approx([0, 0, 0, 0.6, 0.7, 1.5])
    assert totals["work"] == pytest.approx([0, 0, 0, 0.6, 0.7, 1.5])
    assert totals["force_variation"] == pytest.approx([0, 0, 1, 1, 3, 6])
    assert totals["saturated_time"] == pytest.approx([0, 0, 0, 0, 0, 0])


def test_what_changes_in_steps_keeps_its_last_value() -> None:
    assert before(np.array([0.0, 0.99, 1.0, 5.0]), np.array([0.0, 1.0]), np.array([7.0, 8.0])).tolist() == [
        7,
        7,
        8,
        8,
    ]
