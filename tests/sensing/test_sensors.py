"""Sensors: the compiled ones against their NumPy twin, and each for what it promises."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import bdtr

from escort_mj.control.outer_loops import BarrierFilter
from escort_mj.control.setup import Setup
from escort_mj.rules.quantities import ObstacleDistance, RobotDistance, TargetObstacleDistance
from escort_mj.scenario.schema.scenario import Phase
from escort_mj.sensing.sensors import Sensors, bias_of
from escort_mj.sensors import Plain
from tests.control.twins import AVOID, REPULSION, SURFACE, VERTICES, Kernel, compare, mission
from tests.oracle.reference import ReferenceController

STEP = 0.002  # s, of the missions
MEASURED = ("q_measured", "v_measured", "target_position_measured", "target_velocity_measured")
TRUE = ("q", "v", "target_position", "target_velocity")


def everything(axes: int) -> Sensors:
    """Sensors with every fault at once, different for each channel."""
    along = tuple(float(k + 1) for k in range(axes))
    return Sensors(
        Plain(noise=0.02, bias=1.0, delay=3 * STEP, dropout=0.3, resolution=0.001),
        Plain(noise=0.01, bias=along, delay=STEP, dropout=0.2, resolution=0.01),
        Plain(noise=0.05, bias=along, delay=5 * STEP, dropout=0.4, resolution=0.002),
        Plain(noise=0.03, bias=2.0, delay=2 * STEP, dropout=0.1, resolution=0.005),
    )


def with_every(channel: Plain) -> Sensors:
    """The same channel everywhere."""
    return Sensors(channel, channel, channel, channel)


def walk(setup: Setup, q: np.ndarray, v: np.ndarray, steps: int) -> Iterator[dict[str, np.ndarray]]:
    """Random motion through the compiled controller: true and measured signals, each evaluated twice."""
    rng, kernel = np.random.default_rng(0), Kernel(setup)
    for count in range(steps):
        kernel.evaluate(count * setup.timestep, q, v)
        once = {name: getattr(kernel.state, name).copy() for name in TRUE + MEASURED}
        kernel.evaluate(count * setup.timestep, q, v)
        for name, values in once.items():
            assert (getattr(kernel.state, name) == values).all(), name
        yield once
        q, v = q + rng.normal(scale=0.05, size=q.shape), v + rng.normal(scale=0.5, size=v.shape)


@pytest.mark.crossed
@pytest.mark.parametrize("axes", [2, 3, pytest.param(4, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    "change",
    [{}, {"noise": 0.0}, {"bias": 0.0}, {"delay": 0.0}, {"dropout": 0.0}, {"resolution": None}],
    ids=str,
)
def test_kernel_and_twin_measure_the_same(change: dict, axes: int) -> None:
    setup, q, v = mission(axes, seed=30)
    sensing = Sensors(*(channel.model_copy(update=change) for channel in everything(axes).channels))
    setup = replace(setup, behaviors=(AVOID, VERTICES, SURFACE), sensing=sensing)
    compare(setup, q, v, steps=6)
    twin = ReferenceController(setup, stride=1)
    twin.reset(q)
    for count, signals in enumerate(walk(setup, q, v, 30)):
        expected = twin.evaluate(count * setup.timestep, signals["q"], signals["v"])
        for name in MEASURED:
            np.testing.assert_allclose(signals[name], getattr(expected, name), rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("channel", range(4))
def test_one_imperfect_channel_leaves_the_others_true(channel: int) -> None:
    setup, q, v = mission(2, seed=31)
    channels = [Plain()] * 4
    channels[channel] = everything(2).channels[channel]
    for count, signals in enumerate(walk(replace(setup, sensing=Sensors(*channels)), q, v, 20)):
        for number, (true, measured) in enumerate(zip(TRUE, MEASURED, strict=True)):
            same = np.array_equal(signals[true], signals[measured])
            assert same == (number != channel), (count, measured)


@pytest.mark.parametrize("steps", [1, 2, 7])
def test_a_delay_shows_what_was_true_that_many_steps_ago(steps: int) -> None:
    setup, q, v = mission(3, seed=32)
    delays = [steps, steps + 3, 2 * steps, 1]
    setup = replace(setup, sensing=Sensors(*(Plain(delay=delay * setup.timestep) for delay in delays)))
    history = list(walk(setup, q, v, 40))
    for now, signals in enumerate(history):
        for true, measured, delay in zip(TRUE, MEASURED, delays, strict=True):
            np.testing.assert_array_equal(signals[measured], history[max(now - delay, 0)][true])


def test_dropouts_hold_the_last_value_as_often_as_said() -> None:
    """Exact binomial bounds; who misses what, and when, has nothing to do with the rest."""
    share, steps = 0.2, 3000
    setup, q, v = mission(2, seed=33)
    setup = replace(setup, sensing=with_every(Plain(dropout=share)))
    history = list(walk(setup, q, v, steps + 1))
    held = []
    for true, measured in zip(TRUE, MEASURED, strict=True):
        truth, shown = (np.array([signals[name] for signals in history]) for name in (true, measured))
        assert (truth[1:] != truth[:-1]).all()  # there is something new at every step
        missed, arrived = (shown[1:] == shown[:-1]).all(axis=-1), (shown == truth)[1:].all(axis=-1)
        np.testing.assert_array_equal(missed, ~arrived)
        held.append(missed.reshape(steps, -1))
    columns = np.hstack(held)  # 6 + 6 + 1 + 1
    for column in columns.T:
        assert 5e-5 < bdtr(int(column.sum()), steps, share) < 1.0 - 5e-5
    both = np.hstack([columns[1:], columns[:-1]]).astype(float)
    correlation = np.corrcoef(both.T) - np.eye(both.shape[1])
    assert np.abs(correlation).max() < 5.0 / np.sqrt(steps)


@pytest.mark.parametrize("resolution", [0.001, 0.3])
def test_rounding_errs_by_half_a_step_at_most(resolution: float) -> None:
    setup, q, v = mission(3, seed=34)
    setup = replace(setup, sensing=with_every(Plain(resolution=resolution)))
    errors = []
    for signals in walk(setup, q, v, 50):
        for true, measured in zip(TRUE, MEASURED, strict=True):
            multiples = signals[measured] / resolution
            np.testing.assert_allclose(multiples, np.round(multiples), rtol=0.0, atol=1e-9)
            errors.append(np.abs(signals[measured] - signals[true]).max())
    assert 0.4 * resolution < max(errors) <= 0.5 * resolution * (1.0 + 1e-9)


def test_a_bias_stays() -> None:
    setup, q, v = mission(2, seed=35)
    sensing = Sensors(*(Plain(bias=channel.bias) for channel in everything(2).channels))
    for signals in walk(replace(setup, sensing=sensing), q, v, 10):
        for number, (true, measured) in enumerate(zip(TRUE, MEASURED, strict=True)):
            error = np.atleast_2d(signals[measured] - signals[true])
            bias = bias_of(sensing.channels[number], setup.seed, number, len(error), 2)
            np.testing.assert_allclose(error, bias, rtol=0.0, atol=1e-14)


def test_noise_of_the_target_is_its_own() -> None:
    """From a ball of its size; robots' noise does not change where the target is noisy, too."""
    setup, q, v = mission(2, seed=36)
    noisy = Sensors(Plain(noise=0.02), Plain(noise=0.01))
    more = noisy._replace(target_position=Plain(noise=0.05), target_velocity=Plain(noise=0.03, dropout=0.5))
    drawn = []
    for a, b in zip(
        walk(replace(setup, sensing=noisy), q, v, 300),
        walk(replace(setup, sensing=more), q, v, 300),
        strict=True,
    ):
        np.testing.assert_array_equal(a["q_measured"], b["q_measured"])
        np.testing.assert_array_equal(a["v_measured"], b["v_measured"])
        own = (b["q_measured"][0] - b["q"][0]) / 0.02
        drawn.append(((b["target_position_measured"] - b["target_position"]) / 0.05, own))
    target, robot = np.array(drawn).swapaxes(0, 1)
    assert 0.9 < np.linalg.norm(target, axis=1).max() <= 1.0 + 1e-12
    assert np.abs(np.corrcoef(target.T, robot.T)[:2, 2:]).max() < 4.0 / np.sqrt(len(drawn))


SIGHTS = [(np.inf, np.inf), (4.0, np.inf), (np.inf, 3.0), (5.0, 4.0), (0.5, 0.5)]


@pytest.mark.crossed
@pytest.mark.parametrize("axes", [2, 3])
@pytest.mark.parametrize(("robots", "obstacles"), SIGHTS)
def test_sight_of_kernel_and_twin(robots: float, obstacles: float, axes: int) -> None:
    """In repulsion, in the barrier filter, and in the supervisor's conditions."""
    phases = tuple(
        Phase(behaviors=(SURFACE, AVOID), when=rule(below=6.0, scope=scope))
        for rule in (ObstacleDistance, RobotDistance, TargetObstacleDistance)
        for scope in ("robot", "team")
    )
    setup, q, v = mission(axes, seed=40)
    setup = replace(setup, sensing=everything(axes)._replace(robots=robots, obstacles=obstacles))
    compare(replace(setup, behaviors=(REPULSION, SURFACE)), q, v)
    compare(replace(setup, behaviors=(AVOID, VERTICES, SURFACE), outer=BarrierFilter()), q, v, tolerance=1e-8)
    for phase in phases:
        compare(replace(setup, behaviors=(AVOID, VERTICES, SURFACE), phases=(phase,)), q, v, steps=2)


def reference_velocity(setup: Setup, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """What the compiled controller wants at first."""
    kernel = Kernel(setup)
    return kernel.evaluate(0.0, q, v).v_d.copy()


def test_who_is_out_of_sight_does_not_repel() -> None:
    """Two pairs, far apart: with short sight each is as if the other were not there."""
    setup, _, v = mission(3, seed=42, count=4, obstacles=0)
    q = np.array([[5.0, 0.0, 0.0], [5.0, 1.0, 0.0], [-5.0, 0.0, 4.0], [-5.0, -1.0, 3.0]])
    setup = replace(setup, behaviors=(REPULSION,), sensing=Sensors(), robot_radius=np.full(4, 0.2))
    pair = replace(
        setup, robot_radius=np.full(2, 0.2), force_limit=setup.force_limit[:2], arrangement=None, figure=None
    )
    near = reference_velocity(replace(setup, sensing=Sensors(robots=3.0)), q, v)[:2]
    np.testing.assert_array_equal(near, reference_velocity(pair, q[:2], v[:2]))
    assert np.abs(near - reference_velocity(setup, q, v)[:2]).max() > 1e-3


@pytest.mark.parametrize("axes", [2, 3])
def test_sight_as_far_as_safety_changes_no_avoidance(axes: int) -> None:
    """What `check_sight` asks for is enough: the avoidance task looks no farther than its safe distance."""
    setup, q, v = mission(axes, seed=43)
    for behaviors in ((AVOID, VERTICES, SURFACE), (SURFACE, AVOID)):
        far = replace(setup, behaviors=behaviors)
        near = replace(far, sensing=setup.sensing._replace(robots=2.5, obstacles=2.5))
        np.testing.assert_array_equal(reference_velocity(far, q, v), reference_velocity(near, q, v))
        assert compare(near, q, v).any()
