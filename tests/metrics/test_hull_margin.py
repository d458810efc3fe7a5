import math
from itertools import combinations, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from escort_mj.measuring import measure, measures_of
from escort_mj.metrics.hull_margin import CANDIDATES, least_margin, margin, margins

EVERY = settings(max_examples=40)


def both(points):
    """The margin of the origin in one hull, which two ways agree on."""
    points = np.asarray(points, float)
    found = margin(points)
    if math.comb(*points.shape) <= CANDIDATES:
        assert margins(points[None])[0] == pytest.approx(found, abs=1e-12 * max(1.0, np.abs(points).max()))
    assert least_margin(points[None]) == (pytest.approx(found, abs=1e-12), 0)
    return found


def by_hand(points):
    """Distance to the nearest facet, or minus the distance to the nearest simplex of p points."""
    inside = []
    for corners in combinations(points, points.shape[1]):
        normal = np.linalg.svd(np.array(corners)[1:] - corners[0])[2][-1]
        heights = points @ normal - corners[0] @ normal
        for sign in (1.0, -1.0):
            if (sign * heights <= 1e-9).all():
                inside.append(sign * corners[0] @ normal)
    if min(inside) >= 0.0:
        return min(inside)
    return -min(to_simplex(np.array(corners)) for corners in combinations(points, points.shape[1]))


def to_simplex(corners):
    """Distance of the origin from a simplex."""
    if len(corners) == 1:
        return np.linalg.norm(corners[0])
    edges = (corners[1:] - corners[0]).T
    weights = np.linalg.lstsq(edges, -corners[0], rcond=None)[0]
    if (weights >= 0.0).all() and weights.sum() <= 1.0:
        return np.linalg.norm(corners[0] + edges @ weights)
    return min(to_simplex(np.delete(corners, k, axis=0)) for k in range(len(corners)))


def recomputed_hull_margin(again):
    """Over a mission of `test_recomputed`.

    A margin changes by no more than the largest motion of a point: most steps cannot bring a new minimum.
    """
    least, value, seen = math.inf, -math.inf, np.zeros((0, again.p))
    for points, alive in zip(again.q - again.target[:, None], again.alive, strict=True):
        around = points[alive]
        moved = np.linalg.norm(around - seen, axis=1).max() if len(around) == len(seen) else math.inf
        if value - moved < least:
            value, seen = by_hand(around), around
            least = min(least, value)
    return least


def polygon(count, radius=2.0):
    turns = 2.0 * np.pi * np.arange(count) / count
    return radius * np.column_stack([np.cos(turns), np.sin(turns)])


def cube(axes, half=1.5):
    return np.array(list(product([-half, half], repeat=axes)))


def simplex(axes, radius=2.0):
    """A regular one about the origin: unit vectors of one axis more, in the plane through their ends."""
    corners = np.eye(axes + 1) - 1.0 / (axes + 1)
    basis = np.linalg.svd(corners)[2][:axes]
    corners = corners @ basis.T
    return radius * corners / np.linalg.norm(corners[0])


class TestClosedForms:
    @pytest.mark.parametrize("count", [3, 4, 5, 6, 12, 40, 101])
    def test_a_regular_polygon_has_its_inner_radius(self, count):
        assert both(polygon(count)) == pytest.approx(2.0 * math.cos(math.pi / count), rel=1e-12)

    @pytest.mark.parametrize("axes", [2, 3, 4, 5])
    def test_a_regular_simplex_has_its_inner_radius(self, axes):
        assert both(simplex(axes)) == pytest.approx(2.0 / axes, rel=1e-12)

    @pytest.mark.parametrize("axes", [2, 3, 4])
    def test_a_cube_and_what_is_in_it(self, axes):
        assert both(cube(axes)) == pytest.approx(1.5, rel=1e-12)
        assert both([*cube(axes), *0.2 * cube(axes)]) == pytest.approx(1.5, rel=1e-12)
        shift = np.array([0.4, -0.7, 0.1, 0.2])[:axes]
        assert both(cube(axes) - shift) == pytest.approx(0.8, rel=1e-12)

    @pytest.mark.parametrize("axes", [2, 3, 4])
    def test_a_cross_polytope(self, axes):
        assert both([*np.eye(axes), *-np.eye(axes)]) == pytest.approx(axes**-0.5, rel=1e-12)

    @pytest.mark.parametrize("axes", [2, 3, 4])
    @pytest.mark.parametrize("out", [1, 2, 4])
    def test_outside_it_is_minus_the_distance_to_face_edge_or_corner(self, axes, out):
        target = np.where(np.arange(axes) < out, 1.5 + 0.25 * (1 + np.arange(axes)), 0.3)
        distance = np.linalg.norm(target[:out] - 1.5)
        assert both(cube(axes) - target) == pytest.approx(-distance, rel=1e-12)

    @pytest.mark.parametrize("axes", [2, 3, 4])
    def test_on_a_face_it_is_zero(self, axes):
        target = np.array([1.5, *[0.1] * (axes - 1)])
        assert both(cube(axes) - target) == pytest.approx(0.0, abs=1e-12)


class TestFlatTeams:
    """In a hyperplane, a target is on the team or outside."""

    @pytest.mark.parametrize("axes", [2, 3, 5])
    def test_of_one_robot_it_is_minus_the_distance(self, axes):
        assert both(np.full((1, axes), 3.0)) == pytest.approx(-3.0 * math.sqrt(axes))

    @pytest.mark.parametrize("axes", [2, 3, 4])
    @pytest.mark.parametrize(
        ("along", "aside", "distance"), [(0.0, 0.0, 0.0), (0.4, 0.7, 0.7), (4.0, 4.0, 5.0)]
    )
    def test_of_robots_on_a_line(self, axes, along, aside, distance):
        """From -1 to 1, two of them or six."""
        for count in (2, 6):
            line = np.zeros((count, axes))
            line[:, 0] = np.linspace(-1.0, 1.0, count) + along
            line[:, 1] = aside
            assert both(line) == pytest.approx(-distance, abs=1e-12)

    @pytest.mark.parametrize("axes", [3, 4])
    @pytest.mark.parametrize("count", [3, 4, 6, 30])
    def test_of_a_ring_in_space(self, axes, count):
        ring = np.zeros((count, axes))
        ring[:, :2] = polygon(count)
        assert both(ring) == pytest.approx(0.0, abs=1e-12)
        assert both(ring + np.eye(axes)[2] * 0.6) == pytest.approx(-0.6, rel=1e-12)
        beside = ring - 2.0 * np.eye(axes)[0] + 0.75 * (np.eye(axes)[2] - np.eye(axes)[0] * 4.0 / 3.0)
        assert both(beside) == pytest.approx(-1.25, rel=1e-12)

    def test_a_hair_off_a_triangle(self):
        corners = np.random.default_rng(2).standard_normal((3, 3))
        corners -= np.array([0.2, 0.3, 0.5]) @ corners
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        away = 1e-4 * normal / np.linalg.norm(normal)
        assert margins((corners + away)[None])[0] == pytest.approx(-1e-4, rel=1e-11)
        assert both(corners + away) == pytest.approx(-1e-4, rel=1e-11)

    @pytest.mark.parametrize("axes", [2, 3])
    def test_of_robots_at_one_place(self, axes):
        assert both(np.full((5, axes), 1.0)) == pytest.approx(-math.sqrt(axes))
        assert both(np.zeros((5, axes))) == 0.0


@st.composite
def teams(draw):
    axes = draw(st.integers(2, 4))
    count = draw(st.integers(axes + 1, 9))
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    return random.standard_normal((count, axes)) + draw(st.sampled_from([0.0, 0.5, 2.0]))


class TestRandomTeams:
    @EVERY
    @given(team=teams())
    def test_facets_and_simplices_by_hand(self, team):
        assert both(team) == pytest.approx(by_hand(team), abs=1e-9)

    @EVERY
    @given(team=teams(), factor=st.floats(1e-3, 1e3))
    def test_it_grows_with_the_team(self, team, factor):
        assert margins(factor * team[None])[0] == pytest.approx(
            factor * margins(team[None])[0], abs=1e-9 * factor
        )

    @pytest.mark.parametrize(("robots", "axes"), [(30, 2), (20, 3), (12, 4)])
    def test_of_many_the_worst_sample_is_found_without_looking_at_all(self, robots, axes):
        random = np.random.default_rng(robots)
        moments = random.standard_normal((40, robots, axes)) + np.linspace(0.0, 2.0, 40)[:, None, None]
        expected = [margin(points) for points in moments]
        assert least_margin(moments) == (min(expected), int(np.argmin(expected)))


class TestMetric:
    time = np.linspace(0.0, 4.0, 9)

    def test_the_least_over_the_window_and_its_moment(self, make_trace):
        q = np.broadcast_to(polygon(4), (9, 4, 2)) * np.linspace(2.0, 1.0, 9)[:, None, None]
        target = np.zeros((9, 2))
        target[3] = 5.0, 0.0
        trace = make_trace(self.time, robots=4, q=q + target[:, None], target_position=target)
        found = measure("hull_margin", trace)
        assert found[:3] == (pytest.approx(math.sqrt(2.0)), 4.0, ())
        away = make_trace(self.time, robots=4, q=q, target_position=target)
        found = measure("hull_margin", away)
        assert (found.value, found.time) == (pytest.approx(3.25 - 5.0), 1.5)
        assert measure("hull_margin", away, after=2.0).value == pytest.approx(math.sqrt(2.0))

    def test_robots_that_are_lost_do_not_count(self, make_trace):
        lost = np.zeros((9, 4))
        lost[5:, 3] = 1.0
        trace = make_trace(self.time, robots=4, q=polygon(4), lost=lost, target_position=(0.5, 0.0))
        found = measure("hull_margin", trace)
        assert (found.value, found.time) == (pytest.approx(0.0, abs=1e-12), 2.5)  # half a square is left
        assert measure("hull_margin", trace, before=2.0).value == pytest.approx(1.5 / math.sqrt(2.0))
        assert measure("hull_margin", make_trace(self.time, lost=1.0)).reason == "no robot is left"

    def test_a_number_that_is_none_is_not_hidden(self, make_trace):
        q = np.broadcast_to(polygon(4), (9, 4, 2)).copy()
        q[4, 2] = np.nan
        assert math.isnan(measure("hull_margin", make_trace(self.time, robots=4, q=q)).value)

    def test_of_a_crowd_it_is_measured_where_it_is_wanted(self, make_trace):
        crowd = make_trace(self.time, robots=30, q=polygon(30))
        assert "takes long" in measures_of(crowd)["hull_margin"].reason
        wanted = measures_of(crowd, wanted={"hull_margin"})["hull_margin"].value
        assert wanted == pytest.approx(2.0 * math.cos(math.pi / 30))
