"""Lists of neighbors against a look at all pairs: points that move, jump, gather and scatter."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import KDTree

from escort_mj.native.compiler.declarations import jitted
from escort_mj.numerics import neighbors
from escort_mj.numerics.cells import CELL_ROWS
from escort_mj.numerics.neighbors import ALL, COUNT, FIRST, NEIGHBORS, NOTE, keep_neighbors

pytestmark = pytest.mark.slow  # compiling takes seconds; tests of crowds cross these lists, too


@jitted
def keep(points, radius, lists):
    keep_neighbors(points, radius, lists)


class Lists:
    """A set of lists with its scratch."""

    def __init__(self, radius: np.ndarray, axes: int) -> None:
        n = len(radius)
        self.radius, self.lists = radius, np.zeros((n, NEIGHBORS))
        self.rest = np.zeros((n, axes)), np.zeros(NOTE), np.zeros((CELL_ROWS, n))

    def keep(self, points: np.ndarray) -> int:
        """Keeps them valid; returns how many steps they have held."""
        keep(points, self.radius, neighbors.Lists(self.lists, *self.rest))
        return int(self.rest[1][1])

    def candidates(self) -> np.ndarray:
        """Whom each robot's list holds, in ascending order; shape (n, n)."""
        count = self.lists[:, COUNT].astype(int)
        every = count == ALL
        listed = np.arange(NEIGHBORS - FIRST) < np.where(every, 0, count)[:, None]
        assert (np.diff(self.lists[:, FIRST:], axis=1) > 0)[listed[:, 1:]].all(), "not in ascending order"
        found = np.repeat(every[:, None], len(every), axis=1)
        np.fill_diagonal(found, False)
        robot, place = np.nonzero(listed)
        found[robot, self.lists[robot, FIRST + place].astype(int)] = True
        return found


def check(lists: Lists, points: np.ndarray) -> None:
    """Candidates hold the nearest, by centers and by surfaces."""
    apart = np.linalg.norm(points[:, None] - points[None], axis=-1)
    np.fill_diagonal(apart, np.inf)
    clear = apart - lists.radius[:, None] - lists.radius[None]
    candidates = lists.candidates()
    assert not candidates.diagonal().any()
    for distance in (apart, clear):
        among = np.where(candidates, distance, np.inf)
        np.testing.assert_array_equal(among.min(axis=1), distance.min(axis=1))


def scattered(rng: np.random.Generator, shape: str, n: int, axes: int) -> np.ndarray:
    if shape == "ball":
        return rng.normal(size=(n, axes))
    if shape == "shell":
        points = rng.normal(size=(n, axes))
        return 5.0 * points / np.linalg.norm(points, axis=1, keepdims=True)
    if shape == "line":
        return np.outer(np.arange(n), np.eye(axes)[1])
    if shape == "grid":  # many at the same distance
        side = int(np.ceil(n ** (1.0 / axes)))
        return np.argwhere(np.ones((side,) * axes))[:n].astype(float)
    if shape == "heap":  # all in one place
        return np.zeros((n, axes))
    points = 0.01 * rng.normal(size=(n, axes))  # bunches, and a few very far out
    points += 3.0 * rng.integers(0, 3, size=(n, 1))
    points[:2] += 1e4 * rng.normal(size=(2, axes))
    return points


SHAPES = ("ball", "shell", "line", "grid", "heap", "bunches")


@settings(max_examples=6)
@given(
    seed=st.integers(0, 2**31),
    shape=st.sampled_from(SHAPES),
    n=st.integers(2, 80),
    axes=st.integers(2, 5),
    speed=st.sampled_from([0.0, 1e-3, 0.03, 1.0]),
    mixed=st.booleans(),
)
def test_candidates_hold_the_nearest(
    seed: int, shape: str, n: int, axes: int, speed: float, mixed: bool
) -> None:
    rng = np.random.default_rng(seed)
    radius = rng.uniform(0.01, 0.5, size=n) if mixed else np.full(n, 0.1)
    lists, points = Lists(radius, axes), scattered(rng, shape, n, axes)
    drift, jump = rng.normal(size=axes), int(rng.integers(12))
    for step in range(12):
        lists.keep(points)
        check(lists, points)
        points = points + speed * rng.normal(size=points.shape) + drift
        if step == jump:  # one is thrown far off
            points[rng.integers(n)] += 100.0 * rng.normal(size=axes)


@pytest.mark.parametrize("axes", [2, 3])
@pytest.mark.parametrize("shape", ["ball", "shell", "grid", "bunches"])
def test_lists_are_short_and_hold(shape: str, axes: int) -> None:
    """Otherwise they would be of no use."""
    rng = np.random.default_rng(4)
    n = 500
    points = scattered(rng, shape, n, axes)
    lists, heading = Lists(np.full(n, 0.001), axes), rng.normal(size=(n, axes))
    spacing = np.median(KDTree(points).query(points, 2)[0][:, 1])
    made = 0
    for _ in range(200):
        points = points + 1e-4 * spacing * heading + 0.1
        made += lists.keep(points) == 0
    assert made < 20
    lengths = lists.candidates().sum(axis=1)
    assert np.median(lengths) <= 8 and (lengths == n - 1).mean() < 0.01
    check(lists, points)


def test_wild_positions_do_no_harm() -> None:
    """No numbers, and what is farther away than cells can be counted."""
    rng = np.random.default_rng(5)
    for wrong in (np.nan, np.inf, -np.inf, 1e300, 1e23):
        points = rng.normal(size=(100, 3))
        points[7, 1] = wrong
        lists = Lists(np.full(100, 0.1), 3)
        with np.errstate(all="ignore"):
            lists.keep(points)
            lists.keep(points)
        counts = lists.lists[:, COUNT]
        assert ((counts == ALL) | ((counts >= 0) & (counts < NEIGHBORS))).all()


def test_robots_in_one_place_are_listed_by_plain_python_as_by_machine_code(compiled) -> None:
    found = []
    for call in (keep, keep_neighbors):
        lists = Lists(np.full(100, 0.2), 2)
        call(np.zeros((100, 2)), lists.radius, neighbors.Lists(lists.lists, *lists.rest))
        found.append(lists)
    assert all((each.lists[:, COUNT] == ALL).all() for each in found)
    assert all(np.array_equal(one, other) for one, other in zip(*(each.rest for each in found), strict=True))
