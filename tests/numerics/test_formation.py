"""Facts of the even formations: ring and octahedron, whatever the team's numbering and attitude."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from escort_mj.numerics.formation import (
    OCTAHEDRON,
    OCTAHEDRON_CYCLES,
    Arrangement,
    arrange,
    chords_exist,
    spacing,
    widest_spacing,
)
from escort_mj.numerics.thomson import even_points

PAPER_2D = np.array([(5, 10), (-5, 5), (-5, -5), (5, -10), (5, 0)], dtype=float)
PAPER_3D = np.array(
    [(10, 1, 0), (1, 10, 0.3), (-10, 0, 1), (0, 0.5, -10), (0, -10, 0.3), (0, 0, 10)], dtype=float
)

angles = st.floats(0.0, 2.0 * math.pi)
radii = st.floats(0.1, 100.0)
counts = st.integers(2, 12)
seeds = st.integers(0, 2**32 - 1)


def ring(count: int, angle: float, radius: float, center: np.ndarray, seed: int) -> np.ndarray:
    """A regular polygon with its corners in random order."""
    phi = angle + 2.0 * math.pi * np.arange(count) / count
    corners = center + radius * np.stack([np.cos(phi), np.sin(phi)], axis=1)
    return np.random.default_rng(seed).permutation(corners)


def one_cycle(predecessors: np.ndarray) -> bool:
    """Whether following predecessors from robot 0 visits everyone before it returns."""
    seen, robot = [], 0
    while robot not in seen:
        seen.append(robot)
        robot = int(predecessors[robot])
    return robot == 0 and len(seen) == len(predecessors)


def lengths(arrangement: Arrangement, q: np.ndarray) -> np.ndarray:
    return np.linalg.norm(q[arrangement.pairs[:, 0]] - q[arrangement.pairs[:, 1]], axis=1)


@given(counts, radii)
def test_ring_spacing_is_the_papers_chord(count: int, radius: float) -> None:
    paper = 2.0 * radius * math.cos(math.pi / 2.0 - math.pi / count)
    assert spacing(count, 2, radius) == pytest.approx(paper, rel=1e-12)


@given(counts, angles, radii, seeds)
def test_regular_polygon_keeps_its_places(count: int, angle: float, radius: float, seed: int) -> None:
    center = np.array([3.0, -2.0])
    q = ring(count, angle, radius, center, seed)
    a = arrange(q, center, radius)
    assert a.order[0] == 0
    assert sorted(a.order) == list(range(count))
    assert a.predecessors.shape == (1, count)
    assert one_cycle(a.predecessors[0])
    assert len(a.pairs) == (1 if count == 2 else count)
    assert np.all(a.pairs[:, 0] < a.pairs[:, 1])
    np.testing.assert_allclose(lengths(a, q), a.length, rtol=1e-9)


@given(st.integers(3, 12), angles, seeds)
def test_ring_runs_counterclockwise(count: int, angle: float, seed: int) -> None:
    q = ring(count, angle, 5.0, np.zeros(2), seed)
    a = arrange(q, np.zeros(2), 5.0)
    before = q[a.predecessors[0]]
    assert np.all(before[:, 0] * q[:, 1] - before[:, 1] * q[:, 0] > 0.0)


@given(counts, angles, seeds)
def test_ring_does_not_depend_on_attitude_or_numbering(count: int, angle: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    q = rng.normal(size=(count, 2))
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    a = arrange(q, np.zeros(2), 1.0)
    np.testing.assert_array_equal(arrange(q @ turn.T, np.zeros(2), 1.0).predecessors, a.predecessors)

    numbering = rng.permutation(count)  # robot i of the renumbered team is robot numbering[i]
    renumbered = arrange(q[numbering], np.zeros(2), 1.0)
    np.testing.assert_array_equal(numbering[renumbered.predecessors[0]], a.predecessors[0][numbering])


def test_paper_robots_stand_in_ring_order() -> None:
    a = arrange(PAPER_2D, np.array([3.0, 0.0]), 5.0)
    np.testing.assert_array_equal(a.order, [0, 1, 2, 3, 4])
    np.testing.assert_array_equal(a.predecessors, [[4, 0, 1, 2, 3]])
    assert a.length == pytest.approx(5.878, abs=5e-4)


@pytest.mark.parametrize("cycle", OCTAHEDRON_CYCLES)
def test_octahedron_cycles_visit_everyone(cycle: tuple[int, ...]) -> None:
    assert one_cycle(np.array(cycle))


def test_octahedron_cycles_are_the_papers() -> None:
    printed = ("1->2, 2->5, 3->4, 4->1, 5->6, 6->3", "1->3, 2->6, 3->2, 4->5, 5->1, 6->4")
    for cycle, text in zip(OCTAHEDRON_CYCLES, printed, strict=True):
        assert ", ".join(f"{j + 1}->{other + 1}" for j, other in enumerate(cycle)) == text


def test_octahedron_edges() -> None:
    directed = [(j, cycle[j]) for cycle in OCTAHEDRON_CYCLES for j in range(6)]
    undirected = {frozenset(edge) for edge in directed}
    assert len(undirected) == len(directed) == 12  # each edge is kept by exactly one of its ends
    for j in range(6):
        neighbors = {k for edge in undirected if j in edge for k in edge} - {j}
        opposite = int(np.flatnonzero((OCTAHEDRON == -OCTAHEDRON[j]).all(axis=1))[0])
        assert neighbors == set(range(6)) - {j, opposite}
        assert len({cycle[j] for cycle in OCTAHEDRON_CYCLES}) == 2
    for j, k in directed:
        assert np.linalg.norm(OCTAHEDRON[j] - OCTAHEDRON[k]) == pytest.approx(math.sqrt(2.0))


@settings(max_examples=40)
@given(radii, seeds)
def test_octahedron_keeps_its_places(radius: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    center = rng.normal(size=3)
    turn = Rotation.random(rng=rng)
    q = center + radius * turn.apply(rng.permutation(OCTAHEDRON))
    a = arrange(q, center, radius)
    assert sorted(a.order) == list(range(6))
    assert a.pairs.shape == (12, 2)
    np.testing.assert_allclose(lengths(a, q), a.length, rtol=1e-9)
    assert a.length == pytest.approx(math.sqrt(2.0) * radius)


@settings(max_examples=40)
@given(seeds)
def test_octahedron_does_not_depend_on_attitude_or_distance(seed: int) -> None:
    rng = np.random.default_rng(seed)
    q = 5.0 * OCTAHEDRON + rng.normal(size=(6, 3))
    a = arrange(q, np.zeros(3), 5.0)
    stretched = Rotation.random(rng=rng).apply(q) * rng.uniform(0.5, 2.0, (6, 1))
    np.testing.assert_array_equal(arrange(stretched, np.zeros(3), 5.0).predecessors, a.predecessors)


@settings(max_examples=40)
@given(seeds)
def test_octahedron_neighbors_do_not_depend_on_numbering(seed: int) -> None:
    rng = np.random.default_rng(seed)
    q = 5.0 * OCTAHEDRON + rng.normal(size=(6, 3))
    numbering = rng.permutation(6)
    pairs = {frozenset(pair) for pair in arrange(q, np.zeros(3), 5.0).pairs.tolist()}
    renumbered = arrange(q[numbering], np.zeros(3), 5.0).pairs
    assert {frozenset(pair) for pair in numbering[renumbered].tolist()} == pairs


def test_paper_robots_face_each_other_in_the_octahedron() -> None:
    a = arrange(PAPER_3D, np.zeros(3), 5.0)
    pairs = {tuple(pair) for pair in a.pairs.tolist()}
    everyone = {(i, j) for i in range(6) for j in range(i + 1, 6)}
    assert everyone - pairs == {(0, 2), (1, 4), (3, 5)}


def test_an_order_is_taken_as_told() -> None:
    a = arrange(PAPER_2D, np.zeros(2), 5.0, order=(3, 1, 2, 5, 4))
    np.testing.assert_array_equal(a.order, [2, 0, 1, 4, 3])
    np.testing.assert_array_equal(a.predecessors, [[2, 0, 3, 4, 1]])
    b = arrange(PAPER_3D, np.zeros(3), 5.0, order=(1, 2, 4, 5, 6, 3))
    for cycle, row in zip(OCTAHEDRON_CYCLES, b.predecessors, strict=True):
        for place, other in enumerate(cycle):
            assert row[b.order[place]] == b.order[other]


@pytest.mark.parametrize(("count", "axes"), [(1, 2), (5, 3), (7, 3), (6, 4)])
def test_no_arrangement(count: int, axes: int) -> None:
    assert not chords_exist(count, axes)
    assert spacing(count, axes, 5.0) is None
    with pytest.raises(ValueError, match=f"{count} robots in {axes} axes"):
        arrange(np.ones((count, axes)), np.zeros(axes), 5.0)


@pytest.mark.parametrize("count", [3, 4, 5, 6, 8, 12, 20, 32])
def test_no_figure_in_space_is_wider_than_the_bound(count: int) -> None:
    points = even_points(count, 3)
    distance = np.linalg.norm(points[:, None] - points, axis=2) + 9.0 * np.eye(count)
    bound = widest_spacing(count, 3, 2.0)
    assert 2.0 * distance.min() <= bound + 1e-6
    if count in (3, 4, 6, 12):
        assert 2.0 * distance.min() == pytest.approx(bound, abs=1e-5)
