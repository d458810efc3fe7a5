"""Re-forming: the assignment against SciPy's, the rotation against the SVD, the placing against all."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linear_sum_assignment
from scipy.spatial.transform import Rotation

from escort_mj.numerics import reform
from escort_mj.numerics.thomson import coulomb_energy, even_points

seeds = st.integers(0, 2**32 - 1)


def assign(rows: np.ndarray, columns: np.ndarray, count: int, p: int, work: np.ndarray) -> bool:
    return reform.assign(rows, columns, count, p, work)


def fit_rotation(h: np.ndarray, r: np.ndarray, u: np.ndarray, v: np.ndarray, p: int) -> None:
    reform.fit_rotation(h, r, u, v, p)


def dealt(rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Column of each row, from the kernel."""
    count, p = rows.shape
    work = np.zeros(6 * (count + 1))
    assert assign(rows.ravel(), columns.ravel(), count, p, work)
    return work[:count].astype(int)


def reformed(
    q: np.ndarray, lost: np.ndarray, figures: tuple[np.ndarray, ...], turns: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and rotation after the kernel has placed the figure for the robots that are left."""
    n, p = q.shape
    rotation, vertices = np.eye(p), np.full((n, p), 7.0)
    scratch = np.full(reform.scratch_size(n, p), np.nan)
    points, starts = np.concatenate(figures), turns.reshape(-1, p)
    reform.reform(q, np.ones(p), lost, points, starts, rotation, vertices, scratch)
    return vertices, rotation


@settings(max_examples=200)
@given(st.integers(1, 40), st.integers(1, 6), seeds)
def test_the_assignment_is_scipys(count: int, p: int, seed: int) -> None:
    rows, columns = np.random.default_rng(seed).normal(size=(2, count, p))
    expected = linear_sum_assignment(rows @ columns.T, maximize=True)[1]
    np.testing.assert_array_equal(dealt(rows, columns), expected)


@settings(max_examples=100)
@given(st.integers(1, 25), st.integers(1, 4), seeds)
def test_the_assignment_is_optimal_where_many_are(count: int, p: int, seed: int) -> None:
    rows, columns = np.random.default_rng(seed).integers(-1, 2, size=(2, count, p)).astype(float)
    profit = rows @ columns.T
    found = dealt(rows, columns)
    assert sorted(found) == list(range(count))
    assert profit[np.arange(count), found].sum() == profit[linear_sum_assignment(profit, maximize=True)].sum()


def test_no_assignment_of_what_is_no_number() -> None:
    rows = np.array([np.nan, 1.0, 2.0])
    assert not assign(rows, np.ones(3), 3, 1, np.zeros(24))


@settings(max_examples=300)
@given(st.integers(2, 6), st.sampled_from(["full", "rank 1", "rank 2", "diagonal", "negative"]), seeds)
def test_the_rotation_is_kabschs(p: int, kind: str, seed: int) -> None:
    x = np.random.default_rng(seed).normal(size=(5, p, p))
    h = {
        "full": x[0],
        "rank 1": np.outer(x[0, 0], x[1, 0]),
        "rank 2": np.outer(x[0, 0], x[1, 0]) + np.outer(x[2, 0], x[3, 0]),
        "diagonal": np.diag(x[0, 0]),
        "negative": -np.eye(p),
    }[kind]
    flat, u, v = np.zeros((3, p * p))
    fit_rotation(h.ravel().copy(), flat, u, v, p)
    r = flat.reshape(p, p)
    np.testing.assert_allclose(r @ r.T, np.eye(p), atol=1e-13)
    assert np.linalg.det(r) == pytest.approx(1.0)
    u, s, vt = np.linalg.svd(h)
    s[-1] *= np.sign(np.linalg.det(u) * np.linalg.det(vt))
    assert (r * h).sum() == pytest.approx(s.sum(), abs=1e-12 * max(1.0, s.sum()))


@pytest.mark.parametrize(("count", "axes"), [(4, 2), (5, 2), (6, 3), (8, 3), (9, 4)])
def test_robots_that_stand_right_stay(count: int, axes: int) -> None:
    """Of a figure of n - 1, anywhere, in any order, with a lost robot among them: no one has to move."""
    rng = np.random.default_rng(count)
    figures, turns = reform.reforming(count, axes, 1)
    q, lost = np.zeros((count, axes)), np.zeros(count)
    lost[2] = 1.0
    turn = np.linalg.qr(rng.normal(size=(axes, axes))).Q
    turn[:, 0] *= np.linalg.det(turn)
    places = rng.permutation(figures[0] @ turn.T)
    q[lost == 0.0], q[2] = 1.0 + 3.0 * places, 1.5
    vertices, rotation = reformed(q, lost, figures, turns)
    # Solved figures are symmetric to 1e-7, so that placings which differ by a symmetry align as well.
    np.testing.assert_allclose(vertices[lost == 0.0], places, atol=1e-6)
    np.testing.assert_array_equal(vertices[2], 0.0)
    np.testing.assert_array_equal(rotation, np.eye(axes))


@pytest.mark.parametrize("seed", range(5))
def test_no_placing_is_nearer(seed: int) -> None:
    """Five robots in space: all 120 assignments, each with its best rotation."""
    rng = np.random.default_rng(seed)
    q, lost = rng.normal(size=(6, 3)), np.array([0, 0, 0, 1.0, 0, 0])
    figures, turns = reform.reforming(6, 3, 1)
    vertices, _ = reformed(1.0 + q, lost, figures, turns)
    directions = q[lost == 0.0] / np.linalg.norm(q[lost == 0.0], axis=1, keepdims=True)
    best = 0.0
    for order in itertools.permutations(range(5)):
        rotation, _ = Rotation.align_vectors(directions, figures[0][list(order)])
        best = max(best, float((rotation.apply(figures[0][list(order)]) * directions).sum()))
    assert (vertices[lost == 0.0] * directions).sum() == pytest.approx(best, abs=2 * reform.SAME)
    assert coulomb_energy(vertices[lost == 0.0]) == pytest.approx(coulomb_energy(even_points(5, 3)))


@pytest.mark.parametrize("losses", [2, 3, 5])
def test_several_at_once(losses: int) -> None:
    figures, turns = reform.reforming(6, 3, losses)
    lost = (np.arange(6) < losses).astype(float)
    vertices, _ = reformed(np.random.default_rng(losses).normal(size=(6, 3)), lost, figures, turns)
    assert coulomb_energy(vertices[losses:]) == pytest.approx(coulomb_energy(even_points(6 - losses, 3)))
    np.testing.assert_allclose(np.linalg.norm(vertices[losses:], axis=1), 1.0)


def test_a_position_that_is_no_number_changes_nothing() -> None:
    figures, turns = reform.reforming(6, 3, 1)
    q = np.random.default_rng(0).normal(size=(6, 3))
    q[1, 0] = np.nan
    vertices, _ = reformed(q, np.array([1.0, 0, 0, 0, 0, 0]), figures, turns)
    np.testing.assert_array_equal(vertices, 7.0)


def test_starting_rotations_are_proper_and_fewer_for_many_robots() -> None:
    counts = {}
    for count in (5, 32, 64, 200):
        turns = reform.reforming(count, 2, 1).turns
        counts[count] = len(turns)
        np.testing.assert_allclose(np.linalg.det(turns), 1.0)
    assert counts == {5: 64, 32: 64, 64: 8, 200: 0}
