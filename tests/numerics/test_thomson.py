"""The even figures: least energies that are known, polygons, the 16-cell, and how robots get their places."""

import math
from itertools import permutations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from escort_mj.native import cache
from escort_mj.numerics import thomson
from escort_mj.numerics.formation import widest_spacing

BEST_KNOWN = {
    4: 3.674234614,
    5: 6.474691495,
    6: 9.985281374,
    8: 19.675287861,
    12: 49.165253058,
    20: 150.881568334,
    32: 412.261274651,
}


@pytest.mark.parametrize("count", BEST_KNOWN)
def test_energy_is_the_best_known(count: int) -> None:
    points = thomson.even_points(count, 3)
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), 1.0, rtol=1e-12)
    assert thomson.coulomb_energy(points) == pytest.approx(BEST_KNOWN[count], abs=2e-9)


def test_eight_points_in_four_dimensions_are_the_16_cell() -> None:
    points = thomson.even_points(8, 4)
    distance = np.sort(np.linalg.norm(points[:, None] - points, axis=2), axis=1)
    np.testing.assert_allclose(distance, [[0.0] + 6 * [math.sqrt(2.0)] + [2.0]] * 8, atol=1e-5)
    assert thomson.coulomb_energy(points) == pytest.approx(24.0 / math.sqrt(2.0) + 4.0 / 2.0, abs=2e-9)


@pytest.mark.parametrize("axes", [4, 5, 7])
def test_one_point_more_than_axes_is_the_simplex(axes: int) -> None:
    points = thomson.even_points(axes + 1, axes)
    i, j = np.triu_indices(axes + 1, 1)
    apart = np.linalg.norm(points[i] - points[j], axis=1)
    np.testing.assert_allclose(apart, widest_spacing(axes + 1, axes, 1.0), atol=1e-5)


def test_the_least_distance_is_within_its_bound() -> None:
    for axes in (4, 5):
        for count in (2, 3, axes + 1, axes + 2, 2 * axes, 2 * axes + 1, 4 * axes):
            points = thomson.even_points(count, axes)
            i, j = np.triu_indices(count, 1)
            assert (
                np.linalg.norm(points[i] - points[j], axis=1).min() <= widest_spacing(count, axes, 1) + 1e-6
            )


@pytest.mark.parametrize("count", [2, 3, 5, 12])
def test_points_in_the_plane_are_a_regular_polygon(count: int) -> None:
    figure = thomson.even_figure(np.random.default_rng(count).normal(size=(count, 2)), np.zeros(2))
    assert len(figure.edges) == (1 if count == 2 else count)
    np.testing.assert_allclose(figure.lengths, 2.0 * math.sin(math.pi / count))


def test_the_octahedron_has_twelve_edges() -> None:
    figure = thomson.even_figure(np.random.default_rng(0).normal(size=(6, 3)), np.zeros(3))
    assert len(figure.edges) == 12
    np.testing.assert_allclose(figure.lengths, math.sqrt(2.0), rtol=1e-6)


def test_robots_that_stand_in_the_figure_already_keep_their_places() -> None:
    rotation = Rotation.from_rotvec([0.3, -1.1, 2.0]).as_matrix()
    order = np.random.default_rng(3).permutation(12)
    standing = thomson.even_points(12, 3)[order] @ rotation.T
    figure = thomson.even_figure(7.0 * standing + [1.0, 2.0, 3.0], np.array([1.0, 2.0, 3.0]))
    np.testing.assert_allclose(figure.vertices, standing, atol=1e-5)


def test_a_solution_is_kept_and_a_broken_one_solved_again(tmp_path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cache.formations, "folder", tmp_path)
    thomson.even_points.cache_clear()
    first = thomson.even_points(7, 3)
    (kept,) = tmp_path.iterdir()
    whole = kept.read_bytes()
    for content in (whole, b"not an array", whole[:-8], b""):
        kept.write_bytes(content)
        thomson.even_points.cache_clear()
        np.testing.assert_array_equal(thomson.even_points(7, 3), first)
        assert kept.read_bytes() == whole
    thomson.even_points.cache_clear()


@pytest.mark.parametrize("count", [200, 1000])
def test_a_crowd_has_nearly_the_least_energy_in_little_time(count: int) -> None:
    """Least energies up to 200 points fit n^2/2 (1 - a n^-1/2 + b n^-3/2) (Morris, Deaven, Ho 1996)."""
    points = thomson._solve(count, 3)
    fit = count**2 / 2 * (1.0 - 1.10461 / math.sqrt(count) + 0.137 / count**1.5)
    assert thomson.coulomb_energy(points) == pytest.approx(fit, rel=3e-5)
    assert thomson.coulomb_energy(thomson.lattice(count)) > thomson.coulomb_energy(points)
    i, j = np.triu_indices(count, 1)
    least = np.linalg.norm(points[i] - points[j], axis=1).min()
    assert 3.2 / math.sqrt(count) < least <= widest_spacing(count, 3, 1.0)


def test_each_assignment_is_fitted_once(monkeypatch: pytest.MonkeyPatch) -> None:
    count = 0

    def counted(matrix: np.ndarray) -> np.ndarray:
        nonlocal count
        count += 1
        return rotation(matrix)

    rotation = thomson._rotation
    thomson._turns(2, thomson.PLANAR)
    monkeypatch.setattr(thomson, "_rotation", counted)
    thomson.even_figure(np.random.default_rng(3).normal(size=(5, 2)), np.zeros(2))
    assert count < thomson.PLANAR


@pytest.mark.parametrize("count", [2, 3, 5, 6])
def test_no_other_turn_or_order_of_a_polygon_is_nearer_to_the_robots(count: int) -> None:
    places = np.random.default_rng(count).uniform(-3.0, 3.0, (5, count, 2))
    corners = thomson.even_points(count, 2) @ (1.0, 1.0j)
    for offset in places:
        directions = offset / np.linalg.norm(offset, axis=1, keepdims=True)
        ways = directions @ (1.0, -1.0j)
        best = max(abs(sum(ways * corners[[*order]])) for order in permutations(range(count)))
        found = thomson.even_figure(offset, np.zeros(2)).vertices
        assert (directions * found).sum() == pytest.approx(best, abs=1e-9)
