"""Measurement noise: the generator word by word, its distribution, and its independence of order."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from escort_mj.compiler.declarations import jitted
from escort_mj.control.behaviors import Surface
from escort_mj.control.laws import ApdSmc
from escort_mj.control.noise import AT_ONCE, OF_ROBOT, draw_points, first_coordinates
from escort_mj.control.reference import ReferenceController
from escort_mj.control.reference.noise import NOISE_KEY, ball_noise
from escort_mj.control.sensing import Channel, Sensors
from escort_mj.control.setup import Setup
from escort_mj.kernels import stack_memory, vector_at

MASK = 2**64 - 1
DRAWS = 400_000


class Rest:
    """A target that stays at the origin."""

    def position(self, t: float) -> np.ndarray:
        return np.zeros(2)

    velocity = position


SETUP = Setup(
    timestep=0.002,
    seed=42,
    behaviors=(Surface(),),
    law=ApdSmc(),
    radius=5.0,
    target_feedforward=True,
    max_speed=np.inf,
    arrangement=None,
    obstacle_position=np.zeros((0, 2)),
    obstacle_radius=np.zeros(0),
    robot_radius=np.full(4, 0.2),
    force_limit=np.full(4, 10.0),
    sensing=Sensors(Channel(0.02), Channel(0.01)),
    target=Rest(),
    disturbance=None,
)


def philox(counter: list[int], key: list[int]) -> list[int]:
    """Philox4x64-10 in Python's whole numbers, from Salmon et al. 2011."""
    c, k = list(counter), list(key)
    for _ in range(10):
        product0, product1 = 0xD2E7470EE14C6C93 * c[0], 0xCA5A826395121157 * c[2]
        c = [product1 >> 64 ^ c[1] ^ k[0], product1 & MASK, product0 >> 64 ^ c[3] ^ k[1], product0 & MASK]
        k = [(k[0] + 0x9E3779B97F4A7C15) & MASK, (k[1] + 0xBB67AE8584CAA73B) & MASK]
    return c


@pytest.mark.parametrize(
    ("counter", "key", "words"),
    [
        ([0] * 4, [0] * 2, "16554d9eca36314c db20fe9d672d0fdc d7e772cee186176b 7e68b68aec7ba23b"),
        ([MASK] * 4, [MASK] * 2, "87b092c3013fe90b 438c3c67be8d0224 9cc7d7c69cd777b6 a09caebf594f0ba0"),
    ],
)
def test_philox_gives_the_published_answers(counter: list[int], key: list[int], words: str) -> None:
    assert philox(counter, key) == [int(word, 16) for word in words.split()]


@pytest.mark.parametrize("axes", [2, 3])
@pytest.mark.parametrize("seed", [0, 7, 2**53 - 1])
def test_ball_noise_follows_its_definition(seed: int, axes: int) -> None:
    for robot, step in [(0, 0), (3, 12345), (4999, 10**9)]:
        words = [w for block in range(1, 9) for w in philox([block, 0, robot, step], [seed, NOISE_KEY])]
        halves = [half for word in words for half in (word % 2**32, word >> 32)]
        coordinates = [(half + 0.5) * 2.0**-31 - 1.0 for half in halves]
        candidates = np.array(coordinates[: len(coordinates) // axes * axes]).reshape(-1, axes)
        inside = candidates[np.sum(candidates**2, axis=1) <= 1.0]
        np.testing.assert_array_equal(ball_noise(seed, robot, step, axes), inside[:2])


@jitted
def draw(points: np.ndarray, seed: int) -> None:
    """Fills rows with points from unit balls, a position's and a velocity's in turn, four robots a step."""
    coordinates = vector_at(stack_memory(), AT_ONCE)
    for row in range(points.shape[0] // 2):
        first_coordinates(coordinates, points.shape[1], seed, OF_ROBOT, row % 4, row // 4)
        draw_points(points[2 * row : 2 * row + 2], 1.0, 1.0, seed, OF_ROBOT, row % 4, row // 4, coordinates)


@pytest.mark.parametrize("axes", [2, 3])
@pytest.mark.parametrize("channel", [0, 1])
def test_noise_is_uniform_in_the_ball(axes: int, channel: int) -> None:
    drawn = np.zeros((2 * DRAWS, axes))
    draw(drawn, 1)
    x = drawn[channel::2]
    radius = np.linalg.norm(x, axis=1)
    assert radius.max() <= 1.0
    np.testing.assert_allclose(x.mean(axis=0), 0.0, atol=4.0 / np.sqrt(DRAWS * (axes + 2)))
    np.testing.assert_allclose(np.cov(x.T) * (axes + 2), np.eye(axes), atol=0.01)
    assert stats.kstest(radius**axes, "uniform").pvalue > 0.001
    # One coordinate of the direction: an arcsine law on the circle, uniform on the sphere.
    direction = x[:, 0] / radius
    share = np.arccos(direction) / np.pi if axes == 2 else (direction + 1.0) / 2.0
    assert stats.kstest(share, "uniform").pvalue > 0.001


@pytest.mark.parametrize("axes", [2, 3, 5])
def test_kernel_and_twin_draw_the_same_points(axes: int) -> None:
    drawn = np.zeros((2 * 400, axes))
    draw(drawn, 3)
    told = [ball_noise(3, row % 4, row // 4, axes) for row in range(400)]
    np.testing.assert_array_equal(drawn, np.concatenate(told))


def test_noise_differs_by_everything_that_names_it() -> None:
    names = [(s, r, k) for s in (0, 1) for r in range(3) for k in range(3)]
    draws = {tuple(point) for name in names for point in ball_noise(*name, 3)}
    assert len(draws) == 2 * len(names)


def test_successive_steps_and_robots_are_uncorrelated() -> None:
    x = np.array([[ball_noise(5, robot, step, 2) for robot in range(2)] for step in range(4000)])
    q, v = x[:, :, 0], x[:, :, 1]
    for a, b in [(q[:-1, 0], q[1:, 0]), (q[:, 0], q[:, 1]), (q[:, 0], v[:, 0])]:
        assert np.abs(np.corrcoef(a.T, b.T)[:2, 2:]).max() < 4.0 / np.sqrt(4000)


def measured(setup: Setup, times: list[float]) -> dict[float, np.ndarray]:
    """Noise of positions and velocities at some times, evaluated in the order given."""
    n, p = setup.count, setup.axes
    found = {}
    for t in times:
        controller = ReferenceController(setup)
        controller.reset(np.ones((n, p)))
        signals = controller.evaluate(t, np.zeros((n, p)), np.zeros((n, p)))
        found[t] = np.stack([signals.q_measured, signals.v_measured])
    return found


def test_noise_does_not_depend_on_order_or_on_the_rest_of_the_team() -> None:
    times = [0.002 * k for k in range(20)]
    forward, backward = measured(SETUP, times), measured(SETUP, times[::-1])
    small = measured(replace(SETUP, robot_radius=np.full(2, 0.2), force_limit=np.full(2, 10.0)), times)
    for t in times:
        np.testing.assert_array_equal(forward[t], backward[t])
        np.testing.assert_array_equal(forward[t][:, :2], small[t])


def test_noise_has_the_size_of_its_balls() -> None:
    noise = np.array(list(measured(SETUP, [0.002 * k for k in range(300)]).values()))
    length = np.linalg.norm(noise, axis=-1)
    assert 0.019 < length[:, 0].max() <= 0.02
    assert 0.0095 < length[:, 1].max() <= 0.01


def test_no_noise_means_true_measurements() -> None:
    controller = ReferenceController(replace(SETUP, sensing=Sensors()))
    q = np.arange(8.0).reshape(4, 2)
    controller.reset(q)
    signals = controller.evaluate(0.0, q, -q)
    np.testing.assert_array_equal(signals.q_measured, q)
    np.testing.assert_array_equal(signals.v_measured, -q)
