"""Measurement noise: the generator word by word, its distribution, and its independence of order."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import kolmogorov

from escort_mj.behaviors import Surface
from escort_mj.control.setup import Setup
from escort_mj.laws import ApdSmc
from escort_mj.native.compiler.declarations import jitted
from escort_mj.native.lanes import WIDTH, stack_rows
from escort_mj.numerics.noise import OF_TARGET, TAG, draw_points
from escort_mj.sensing.sensors import Sensors
from escort_mj.sensors import Plain
from tests.oracle.noise import ball_noise
from tests.oracle.reference import ReferenceController

MASK = 2**64 - 1
DRAWS = 400_000
# Axes, robot and step of draws with seed 1, and how many of the first eight candidates are inside
LATE = [(2, 75, 20, 1), (2, 60, 1323, 0), (3, 40, 0, 1), (3, 9, 1, 0)]


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
    sensing=Sensors(Plain(noise=0.02), Plain(noise=0.01)),
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
        words = [w for block in range(1, 9) for w in philox([block, 0, robot, step], [seed, int(TAG)])]
        halves = [half for word in words for half in (word % 2**32, word >> 32)]
        coordinates = [(half + 0.5) * 2.0**-31 - 1.0 for half in halves]
        candidates = np.array(coordinates[: len(coordinates) // axes * axes]).reshape(-1, axes)
        inside = candidates[np.sum(candidates**2, axis=1) <= 1.0]
        np.testing.assert_array_equal(ball_noise(seed, robot, step, axes), inside[:2])


@jitted
def draw(points: np.ndarray, counts: np.ndarray, seed: int, steps: np.ndarray) -> None:
    """Draws points for robots and, last, the target: shape (steps, n + 1, 2, p)."""
    n, p = points.shape[1] - 1, points.shape[3]
    rows = stack_rows(2 * p)
    for row in range(len(steps)):
        for first in range(0, n + 1, WIDTH):
            draw_points(rows, int(counts[0]), int(counts[1]), seed, first, n, int(steps[row]))
            for body in range(first, min(first + WIDTH, n + 1)):
                for k in range(2 * p):
                    points[row, body, k // p, k % p] = rows[k, body - first]


def drawn(n: int, axes: int, seed: int, steps: Sequence[int], counts: tuple[int, int] = (2, 2)) -> np.ndarray:
    """What `draw` makes of it; `counts`: how many points a robot needs, and the target."""
    points = np.full((len(steps), n + 1, 2, axes), np.nan)
    draw(points, np.array(counts), seed, np.array(steps))
    return points


def uniform(values: np.ndarray) -> float:
    """Probability of a larger distance from the uniform distribution, by Kolmogorov's test."""
    steps = np.arange(len(values) + 1) / len(values)
    values = np.sort(values)
    return float(
        kolmogorov(np.sqrt(len(values)) * max((steps[1:] - values).max(), (values - steps[:-1]).max()))
    )


@pytest.mark.parametrize("axes", [2, 3])
def test_noise_is_uniform_in_the_ball(axes: int) -> None:
    channels = drawn(4, axes, 1, range(DRAWS // 4))[:, :4]
    for x in (channels[:, :, 0].reshape(-1, axes), channels[:, :, 1].reshape(-1, axes)):
        assert_uniform(x, axes)


def assert_uniform(x: np.ndarray, axes: int) -> None:
    radius = np.linalg.norm(x, axis=1)
    assert radius.max() <= 1.0
    np.testing.assert_allclose(x.mean(axis=0), 0.0, atol=4.0 / np.sqrt(DRAWS * (axes + 2)))
    np.testing.assert_allclose(np.cov(x.T) * (axes + 2), np.eye(axes), atol=0.01)
    assert uniform(radius**axes) > 0.001
    # One coordinate of the direction: an arcsine law on the circle, uniform on the sphere.
    direction = x[:, 0] / radius
    share = np.arccos(direction) / np.pi if axes == 2 else (direction + 1.0) / 2.0
    assert uniform(share) > 0.001


@pytest.mark.parametrize("axes", [2, 3, 5])
@pytest.mark.parametrize("n", [*range(1, 21), 100])
def test_kernel_and_twin_draw_the_same_points(n: int, axes: int) -> None:
    for seed, steps in [(3, (0, 1)), (2**53 - 1, (123456, 10**9))]:
        points = drawn(n, axes, seed, steps)
        for step, row in zip(steps, points, strict=True):
            for robot in range(n):
                np.testing.assert_array_equal(row[robot], ball_noise(seed, robot, step, axes))
            np.testing.assert_array_equal(row[n], ball_noise(seed, 0, step, axes, use=OF_TARGET))


@pytest.mark.parametrize("axes", [2, 3, 5])
@pytest.mark.parametrize("counts", [(1, 1), (1, 2), (2, 1), (0, 2), (2, 0), (0, 1)])
def test_as_many_points_as_are_needed(counts: tuple[int, int], axes: int) -> None:
    n, steps = 9, range(40)
    every, some = drawn(n, axes, 5, steps), drawn(n, axes, 5, steps, counts)
    np.testing.assert_array_equal(some[:, :n, : counts[0]], every[:, :n, : counts[0]])
    np.testing.assert_array_equal(some[:, n, : counts[1]], every[:, n, : counts[1]])


@pytest.mark.parametrize(("axes", "robot", "step", "inside"), LATE)
def test_who_finds_too_little_at_once_goes_on_alone(axes: int, robot: int, step: int, inside: int) -> None:
    words = [w for block in range(1, axes + 1) for w in philox([block, 0, robot, step], [1, int(TAG)])]
    at_once = np.array([half for word in words for half in (word % 2**32, word >> 32)]).reshape(8, axes)
    squares = np.sum(((at_once + 0.5) * 2.0**-31 - 1.0) ** 2, axis=1)
    assert np.sum(squares <= 1.0) == inside, "another draw is needed here"
    points = drawn(robot + 1, axes, 1, [step])[0, robot]
    np.testing.assert_array_equal(points, ball_noise(1, robot, step, axes))


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
