import math
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from escort_mj.measuring import measure
from escort_mj.metrics.hull_margin import over_time
from escort_mj.metrics.largest_gap import gaps
from tests.metrics.test_hull_margin import polygon, simplex

TIME = np.linspace(0.0, 4.0, 9)


def opening_of(points):
    return float(gaps(np.asarray(points, float)[None])[0])


def recomputed_largest_gap(again):
    """Over a mission of `test_recomputed`."""
    return max(
        by_angles(away) if again.p == 2 else by_cones(away)
        for away in (
            (again.q[row] - again.target[row])[again.alive[row]] for row in np.flatnonzero(again.tail)
        )
    )


def by_angles(away):
    angle = np.sort(np.arctan2(away[:, 1], away[:, 0]))
    return float(np.diff(angle, append=angle[0] + 2.0 * np.pi).max())


def by_cones(away):
    """The widest of those around the axes as far from three robots, around a target inside the team."""
    unit = away / np.linalg.norm(away, axis=1, keepdims=True)
    triples = np.array(list(combinations(unit, 3)))
    axes = np.cross(triples[:, 1] - triples[:, 0], triples[:, 2] - triples[:, 0])
    axes = np.vstack([axes, -axes]) / np.linalg.norm(np.vstack([axes, axes]), axis=1, keepdims=True)
    return 2.0 * math.acos((axes @ unit.T).max(axis=1).min())


@pytest.mark.parametrize("count", [2, 3, 5, 12, 40])
def test_of_a_regular_polygon(count):
    assert opening_of(polygon(count)) == pytest.approx(2.0 * math.pi / count, rel=1e-9)


def test_of_a_tetrahedron_an_octahedron_and_teams_on_one_side():
    assert opening_of(simplex(3)) == pytest.approx(2.0 * math.acos(1.0 / 3.0))
    assert opening_of([*np.eye(3), *-np.eye(3)]) == pytest.approx(2.0 * math.acos(3.0**-0.5))
    team = np.random.default_rng(3).standard_normal((30, 3))
    assert opening_of(team) == pytest.approx(by_cones(team))
    assert opening_of([[2.0, 0.0]]) == opening_of([[0.0, 0.0, 7.0]]) == pytest.approx(2.0 * math.pi)
    assert opening_of([[1.0, 0.0], [0.0, 5.0]]) == pytest.approx(1.5 * math.pi)


@settings(max_examples=40)
@given(count=st.integers(1, 9), seed=st.integers(0, 2**32 - 1))
def test_in_the_plane_it_is_the_largest_angle_between_neighbors(count, seed):
    away = np.random.default_rng(seed).standard_normal((count, 2)) + 0.5
    assert opening_of(away) == pytest.approx(by_angles(away), abs=1e-7)


def test_its_moment_and_who_is_beside_it(make_trace):
    q = np.tile(polygon(4), (9, 1, 1))
    q[6, 1] = 2.0 * np.array([math.cos(0.2), math.sin(0.2)])  # robot 2 close to robot 1
    trace = make_trace(TIME, robots=4, q=q)
    found = measure("largest_gap", trace)
    assert found[:3] == (pytest.approx(math.pi - 0.2), 3.0, ("robot_2", "robot_3"))
    wanted = np.full(9, 0.5 * math.pi)
    wanted[6] = math.pi - 0.2
    np.testing.assert_allclose(over_time(trace, gaps), wanted)
    lost = np.zeros((9, 4))
    lost[4:, 0] = 1.0
    found = measure("largest_gap", make_trace(TIME, robots=4, q=polygon(4), lost=lost))
    assert found[:3] == (pytest.approx(math.pi), 2.0, ("robot_2", "robot_4"))
