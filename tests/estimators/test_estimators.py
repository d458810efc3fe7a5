"""Estimators against theory: the posterior Cramer-Rao bound, consistency, and what a mixture may claim."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import chdtri

from escort_mj import Scenario
from escort_mj.behaviors import Surface
from escort_mj.control.setup import Setup
from escort_mj.estimators import ESTIMATORS, Consensus, CovarianceIntersection, Kalman
from escort_mj.estimators.belief import EstimatorView
from escort_mj.estimators.matrices import invert, mix
from escort_mj.knowledge.belief import carry
from escort_mj.knowledge.sight import SightNoise, TargetSight
from escort_mj.scenario.mission import Mission
from escort_mj.sensing.sensors import Sensors
from escort_mj.sensors import Plain
from tests.control.twins import Kernel
from tests.oracle.estimators import Belief, believe, believed, linearized, mixture, update
from tests.oracle.knowing import blank_view

Array = NDArray[np.float64]

STEP, LOOKS, DENSITY, FIRST = 0.02, 5, 0.02, (0.3, 0.1)  # [s], steps between looks, [m/s^1.5], [m, m/s]
SEEDS, DURATION, SETTLED = 50, 12.0, 6.0
NOISE = {"range": 0.05, "bearing": 0.01}


@cache
def wandering(seed: int) -> tuple[Setup, Array]:
    """A target whose velocity is a random walk, and its states at all steps, shape (steps, 4)."""
    random = np.random.default_rng(seed)
    steps = round(DURATION / STEP)
    speed = np.array([0.3, 0.0]) + np.cumsum(
        random.normal(scale=DENSITY * np.sqrt(STEP), size=(steps + 1, 2)), axis=0
    )
    place = np.vstack([np.zeros(2), np.cumsum(speed[:-1] * STEP, axis=0)])
    points = [{"time": k * STEP, "position": place[k].tolist()} for k in range(steps + 1)]
    scenario = Scenario(
        seed=seed, duration=DURATION, physics={"timestep": STEP}, target={"waypoints": points},
        robots={"count": 3, "placement": {"within": 4}}, mission={"radius": 3, "behaviors": ["surface"]},
        recording={"rate": 50},
    )  # fmt: skip
    setup = replace(Mission(scenario).setup, behaviors=(Surface(),))
    return setup, np.hstack([place, speed])[:steps]


def circling(t: float) -> Array:
    """Where three robots are: on circles of their own, so that ranges and bearings tell the whole state."""
    angle = np.array([0.0, 2.1, 4.2]) + 1.5 * t
    return np.array([0.3 * t, 0.0]) + 3.0 * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def flown(measure: str, sensing: Sensors) -> tuple[Array, Array, Array]:
    """Errors of the state, shape (seeds, steps, robots, 4), covariances, and the true states."""
    errors, covariances, states = [], [], []
    for seed in range(SEEDS):
        setup, truth = wandering(seed)
        noise = SightNoise(**{measure: NOISE[measure]})
        sight = TargetSight(rate=1.0 / (LOOKS * STEP), measures=(measure,), noise=noise)
        setup = replace(
            setup,
            sensing=sensing,
            sight=sight,
            estimator=Kalman(noise=DENSITY),
            start_deviation=(*FIRST, 0.0),
        )
        kernel, found, sure = Kernel(setup), [], []
        for k in range(len(truth)):
            state = kernel.evaluate(k * STEP, circling(k * STEP), np.zeros((3, 2)))
            if k % LOOKS == 0:
                found.append(state.belief - truth[k])
                sure.append(state.belief_covariance.reshape(3, 4, 4).copy())
        errors.append(found)
        covariances.append(sure)
        states.append(truth[::LOOKS])
    return np.array(errors), np.array(covariances), np.array(states)


def bound(measure: str, variance: float, states: Array) -> Array:
    """Posterior Cramer-Rao bound on the position, root of the trace, shape (steps, robots) [m].

    Tichavsky, Muravchik, Nehorai (1998): J' = (Q + F J^-1 F^T)^-1 + E[H^T R^-1 H] for linear motion.
    """
    elapsed = STEP * LOOKS
    f = np.kron([[1.0, elapsed], [0.0, 1.0]], np.eye(2))
    q = DENSITY**2 * np.kron([[elapsed**3 / 3, elapsed**2 / 2], [elapsed**2 / 2, elapsed]], np.eye(2))
    information = np.repeat(np.diag(np.repeat(FIRST, 2) ** -2.0)[None], 3, axis=0)
    found = []
    for k in range(states.shape[1]):
        if k:
            information = np.linalg.inv(q + f @ np.linalg.inv(information) @ f.T)
        eyes = circling(k * elapsed)
        for robot in range(3):
            way = states[:, k, :2] - eyes[robot]
            distance = np.linalg.norm(way, axis=1, keepdims=True)
            along, across = way / distance, np.stack([-way[:, 1], way[:, 0]], axis=1) / distance**2
            row, scale = (along, 1.0) if measure == "range" else (across, distance)
            error = NOISE[measure] ** 2 + variance / scale**2
            information[robot, :2, :2] += np.einsum("sa,sb->ab", row, row / error) / len(row)
        found.append([np.sqrt(np.trace(np.linalg.inv(each)[:2, :2])) for each in information])
    return np.array(found)


@pytest.mark.slow_cases("range")
@pytest.mark.crossed
@pytest.mark.parametrize("radius", [0.0, 0.1])
@pytest.mark.parametrize("measure", NOISE)
def test_kalman_is_near_the_bound_and_consistent(measure: str, radius: float) -> None:
    """Also where robots do not know exactly where they are: errors from a ball of this radius [m]."""
    errors, covariances, states = flown(measure, Sensors(position=Plain(noise=radius)))
    late = slice(round(SETTLED / STEP / LOOKS), None)
    rms = np.sqrt((errors[..., :2] ** 2).sum(axis=3).mean(axis=0))[late]
    least = bound(measure, radius**2 / 4.0, states)[late]
    ratio = np.sqrt((rms**2).mean(axis=0)) / np.sqrt((least**2).mean(axis=0))
    assert (ratio > 0.9).all() and (ratio < 1.3).all(), ratio
    nees = np.einsum("stra,strab,strb->str", errors, np.linalg.inv(covariances), errors)[:, late]
    low, high = chdtri(4 * SEEDS, [0.975, 0.025]) / SEEDS
    mean = nees.mean(axis=0)
    assert ((mean > low) & (mean < high)).mean() > 0.85, (measure, mean.mean(), low, high)


def spread(random: np.random.Generator, size: int) -> Array:
    """A random covariance."""
    root = random.normal(size=(size, size))
    return root @ root.T + 0.1 * np.eye(size)


@pytest.mark.parametrize(("axes", "orders"), [(2, 2), (3, 2), (2, 3), (3, 3), (5, 3)])
def test_a_belief_moves_on(axes: int, orders: int) -> None:
    """In one step or in two, in place or in matrices."""
    random, size = np.random.default_rng(axes * orders), axes * orders
    before = Belief(random.normal(size=size), spread(random, size), 1.0, 1.0)
    after, twice = before.at(1.7, axes, 0.3), before.at(1.2, axes, 0.3).at(1.7, axes, 0.3)
    np.testing.assert_allclose(after.covariance, twice.covariance, atol=1e-12)
    x, covariance = before.x.copy(), before.covariance.ravel()
    carry(x, covariance, axes, 0.7, 0.3)
    np.testing.assert_allclose(x, after.x, atol=1e-13)
    np.testing.assert_allclose(covariance.reshape(size, size), after.covariance, atol=1e-12)


def test_measurements_are_linearized_as_they_change() -> None:
    """Finite differences of what a robot measures."""
    random, p = np.random.default_rng(1), 3
    x, eye, none = random.normal(size=3 * p), random.normal(size=p), np.zeros(p)

    def shown(x: Array) -> EstimatorView:
        way, view = x[:p] - eye, blank_view(1, p, 3 * p)
        distance = float(np.linalg.norm(way))
        view.q_measured[0], view.seen_position[0], view.seen_velocity[0] = eye, x[:p], x[p : 2 * p]
        view.seen_range[0], view.seen_bearing[0], view.sight_variance[:] = distance, way / distance, 0.01
        return view

    h, off, _ = linearized(x, shown(x), 0)
    np.testing.assert_allclose(off, 0.0, atol=1e-12)
    numeric = np.stack(
        [
            (linearized(x, shown(x + 1e-6 * e), 0)[1] - linearized(x, shown(x - 1e-6 * e), 0)[1]) / 2e-6
            for e in np.eye(len(x))
        ],
        axis=1,
    )
    np.testing.assert_allclose(h, numeric, atol=1e-8)
    assert not (h @ np.concatenate([none, none, np.ones(p)])).any(), "nobody measures accelerations"


def test_covariance_intersection_never_claims_too_much() -> None:
    """However two errors depend on each other, the mixture's covariance is at least that of its error."""
    random = np.random.default_rng(2)
    for _ in range(50):
        joint = spread(random, 8)
        a, b, cross = joint[:4, :4], joint[4:, 4:], joint[:4, 4:]
        said = Belief(np.zeros(4), b, 0.0, 0.0)
        found = mixture(CovarianceIntersection(), Belief(np.zeros(4), a, 0.0, 0.0), said, 2)
        weight = np.trace(b[:2, :2]) / (np.trace(a[:2, :2]) + np.trace(b[:2, :2]))
        first = weight * found.covariance @ np.linalg.inv(a)
        second = (1.0 - weight) * found.covariance @ np.linalg.inv(b)
        true = (
            first @ a @ first.T
            + second @ b @ second.T
            + first @ cross @ second.T
            + second @ cross.T @ first.T
        )
        assert np.linalg.eigvalsh(found.covariance - true)[0] > -1e-9


def test_mixing_and_inverting_in_place() -> None:
    random = np.random.default_rng(3)
    a, b, x, y = spread(random, 6), spread(random, 6), random.normal(size=6), random.normal(size=6)
    inverse = a.ravel().copy()
    invert(inverse, 6)
    np.testing.assert_allclose(inverse.reshape(6, 6) @ a, np.eye(6), atol=1e-10)
    expected = mixture(Consensus(share=0.4), Belief(x, a, 0.0, 0.0), Belief(y, b, 0.0, 0.0), 2)
    found, covariance = x.copy(), a.ravel().copy()
    mix(found, covariance, y.copy(), b.ravel().copy(), 0.6, inverse)
    np.testing.assert_allclose(found, expected.x, atol=1e-10)
    np.testing.assert_allclose(covariance.reshape(6, 6), expected.covariance, atol=1e-10)


def test_kalman_takes_over_what_is_surer() -> None:
    sure, vague = (Belief(np.full(4, x), x * np.eye(4), 0.0, fix) for x, fix in ((0.1, 1.0), (2.0, 3.0)))
    for own, said in ((vague, sure), (sure, vague)):
        view = blank_view(1, 2, 4)
        believe(own, view, 0)
        view.sent_belief[0], view.sent_covariance[0] = said.x, said.covariance.ravel()
        view.sent_fix[0], view.time[0] = said.fix, 5.0
        update(Kalman(), view, 0)
        assert believed(view, 0).x[0] == pytest.approx(0.1 + 5.0 * 0.1)
        assert view.belief_fix[0] == 3.0, "the newest measurement that it knows of"


@pytest.mark.parametrize("kind", ESTIMATORS)
def test_a_file_of_an_estimator_says_all_of_it(kind: type) -> None:
    name = kind.model_fields["estimator"].default
    assert kind.__module__ == f"escort_mj.estimators.{name}"
    assert kind().needs and kind().orders in (2, 3)


@pytest.mark.parametrize("measured", [(0, 1, 2, 3), (0, 2, 3), (0, 2)], ids=str)
@pytest.mark.parametrize("axes", [2, 3])
def test_exact_measurements_of_the_same_do_not_lead_astray(axes: int, measured: tuple[int, ...]) -> None:
    """A joint correction of all numbers at once is singular to rounding; one after the other is not."""
    kalman, view, step = Kalman(model="acceleration", noise=0.5), blank_view(1, axes, 3 * axes), 0.002
    random = np.random.default_rng(3)
    believe(Belief(0.5 * random.normal(size=3 * axes), np.eye(3 * axes), 0.0, 0.0), view, 0)
    view.sight_variance[:] = [0.0 if k in measured else -1.0 for k in range(4)]
    view.message[0] = -1
    for t in step * np.arange(1, 300):
        place = np.array([2.0 * np.sin(0.5 * t), np.cos(0.7 * t), 0.3 * t])[:axes]
        eye = 3.0 * np.array([np.cos(t), np.sin(t), 0.1])[:axes]
        way = place - eye
        distance = float(np.linalg.norm(way))
        view.time[0], view.q_measured[0] = t, eye
        view.seen_position[0], view.seen_range[0], view.seen_bearing[0] = place, distance, way / distance
        view.seen_velocity[0] = np.array([np.cos(0.5 * t), -0.7 * np.sin(0.7 * t), 0.3])[:axes]
        update(kalman, view, 0)
        if t > 0.04:
            np.testing.assert_allclose(view.belief[0, :axes], place, rtol=0, atol=0.05)
