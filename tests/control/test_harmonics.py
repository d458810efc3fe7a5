"""Straight lines plus sinusoids: found in programs, and followed as the programs themselves are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from escort_mj.control.harmonics import Sum, sum_of, tabulate
from escort_mj.native.compiler.declarations import jitted
from escort_mj.native.lanes import WIDTH, load, store
from escort_mj.numerics.elementary import sine_and_cosine
from escort_mj.scenario.geometry.trajectory import Trajectory
from escort_mj.scenario.schema.expressions import Expression
from tests.control.twins import Kernel, mission

SUMS = [
    "0",
    "3",
    "2 - 0.5*t",
    "sin(t)",
    "4*cos(0.125*t)",
    "0.5*t + 2*sin(0.15*t + 1) - 1",
    "-(cos(2*t) - 3*sin(2*t))/4",
    "sin(t) + sin(2*t) + sin(3*t) + sin(4*t) + cos(5*t)",
    "sin(t) - sin(t)",
    "sin(2) + cos(1 - t)",
]
OTHERS = [
    "t**2",
    "sin(t)*cos(t)",
    "exp(-t)",
    "sin(sin(t))",
    "abs(t - 5)",
    "1/(2 + t)",
    "min(t, 5)",
    "sin(t**2)",
]


@jitted
def turn(x, sines, cosines):  # of whole lanes
    for at in range(0, len(x), WIDTH):
        sine, cosine = sine_and_cosine(load(x, at))
        store(sines, at, sine)
        store(cosines, at, cosine)


def found(source: str) -> Sum | None:
    return sum_of(np.reshape(Expression(source).instructions(), (-1, 3)).astype(float))


def value_of(total: Sum, t: NDArray[np.float64]) -> NDArray[np.float64]:
    waves = [a * np.cos(w * t + f) + b * np.sin(w * t + f) for (w, f), (a, b) in total.waves.items()]
    return total.constant + total.slope * t + np.sum(waves, axis=0)


@pytest.mark.parametrize("scale", [1.0, 30.0, 1e3, 1e6, 1e12])
def test_sine_and_cosine_are_exact_to_rounding(scale: float) -> None:
    near = np.arange(-400.0, 400.0) * np.pi / 8.0  # where one of them is 0 or 1
    x = np.concatenate([np.random.default_rng(1).uniform(-scale, scale, 4000), scale / 155.0 * near])
    sines, cosines = np.empty_like(x), np.empty_like(x)
    turn(x, sines, cosines)
    np.testing.assert_allclose(sines, np.sin(x), rtol=0.0, atol=4e-16)
    np.testing.assert_allclose(cosines, np.cos(x), rtol=0.0, atol=4e-16)


def test_sine_and_cosine_of_what_is_no_number_are_none() -> None:
    x = np.array([np.nan, 0.0, np.inf, 1.0, 0.0, 0.0, 0.0, 0.0])
    sines, cosines = np.empty_like(x), np.empty_like(x)
    turn(x, sines, cosines)
    assert np.isnan(sines[[0, 2]]).all() and np.isnan(cosines[[0, 2]]).all()
    np.testing.assert_allclose([sines[1], cosines[1], sines[3]], [0.0, 1.0, np.sin(1.0)], atol=1e-16)


@pytest.mark.parametrize("source", SUMS)
def test_a_sum_of_sinusoids_is_what_the_expression_says(source: str) -> None:
    t = np.linspace(0.0, 60.0, 400)
    total = found(source)
    assert total is not None
    np.testing.assert_allclose(value_of(total, t), Expression(source).evaluate(t)[0], rtol=0.0, atol=1e-13)


@pytest.mark.parametrize("source", OTHERS)
def test_other_functions_are_left_to_their_programs(source: str) -> None:
    assert found(source) is None


def test_axes_share_their_tones_and_tables_are_whole_lanes() -> None:
    tables = tabulate([found("4*cos(0.5*t)"), found("3*t + 4*sin(0.5*t)"), None, found("1 + 2*t")])
    assert tables["tones"].shape == (2, WIDTH)
    assert tables["tones"][:, 0].tolist() == [0.5, 0.0]
    assert tables["waves"].shape == (4, WIDTH), "pairs of tones"
    assert tables["waves"][0].tolist() == [4.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0], "shares of the cosine"
    assert tables["waves"][1].tolist() == [0.0, 4.0, -2.0, 0.0, 0.0, 0.0, 0.0, 0.0], "shares of the sine"
    assert not tables["waves"][2:].any()
    assert tables["lines"].tolist() == [
        [0.0, 0.0, 0.0, 3.0, 0.0, 1.0, 0.0, 0.0],
        [0.0, 3.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0],
    ]
    assert tabulate([None, None])["tones"].shape == (2, 0)


@pytest.mark.parametrize("axes", [2, 3])
def test_target_and_disturbance_are_followed_whatever_they_are(axes: int) -> None:
    def some(*sources: str) -> Trajectory:
        return Trajectory(tuple(map(Expression, sources[:axes])))

    setup, q, v = mission(axes, seed=1)
    target = some(SUMS[7], OTHERS[1], SUMS[5])
    push = some(OTHERS[3], SUMS[6], "sin(t*1e7)")
    kernel = Kernel(replace(setup, target=target, disturbance=push))
    for t in (0.0, 0.002, 1.7, 59.0):
        state = kernel.evaluate(t, q, v)
        np.testing.assert_allclose(state.target_position, target.position(t), rtol=0.0, atol=1e-13)
        np.testing.assert_allclose(state.target_velocity, target.velocity(t), rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(state.disturbance, np.tile(push.position(t), (len(q), 1)), atol=1e-13)
