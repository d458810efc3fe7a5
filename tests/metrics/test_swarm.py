"""Measures of a swarm, on configurations that have them in closed form; see `recomputed` for missions."""

import math
from itertools import combinations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from escort_mj.measuring import measure
from tests.metrics.motions import TIME, ring, steps
from tests.synthetic import make_trace as synthetic

FEW = np.linspace(0.0, 1.0, 6)
SEES = {"sensing_robots": 1.0}  # surface to surface: 1.4 m between centers
NAMES = ("order", "union", "connectivity", "safety_agents", "safety_obstacles")


def still(places, **given):
    """Robots at places for a second."""
    places = np.asarray(places, float)
    given = {"truth": "heard_from" in given} | given
    return synthetic(FEW, robots=len(places), axes=places.shape[1], q=np.tile(places, (6, 1, 1)), **given)


def on_a_line(*places, **given):
    return still(np.column_stack([places, np.zeros(len(places))]), **given)


def flying(*velocities, **given):
    return synthetic(
        FEW, robots=len(velocities), v=np.tile(np.asarray(velocities, float), (6, 1, 1)), **given
    )


def value(name, trace):
    return measure(name, trace).value


class TestOrder:
    def test_who_hardly_moves_or_is_lost_has_no_heading(self):
        assert value("order", flying([1, 0], [1, 0], [-0.001, 0])) == pytest.approx(1.0)
        gone = np.tile([0.0, 0.0, 1.0], (6, 1))
        assert value("order", flying([1, 0], [1, 0], [-1, 0], lost=gone)) == pytest.approx(1.0)
        found = measure("order", flying([1, 0], [0, 0], [0, 0]))
        assert (found.value, found.reason) == (None, "no two robots move at a time")

    def test_it_is_a_mean_over_the_time_in_which_two_move(self):
        v = np.zeros((501, 2, 2))
        v[:, 0, 0], v[:, 1, 0] = 1.0, 1.0 - 2.0 * steps(TIME, 5.0)
        v[400:] = 0.0
        assert value("order", synthetic(TIME, robots=2, v=v)) == pytest.approx((250 - 150) / 400, abs=1e-2)

    @given(v=arrays(float, (3, 5, 3), elements=st.floats(-5.0, 5.0)))
    def test_it_is_the_mean_over_pairs(self, v):
        speed = np.linalg.norm(v, axis=2)
        v[speed < 0.1] = 1.0
        heading = v / np.linalg.norm(v, axis=2, keepdims=True)
        pairs = [(row[a] * row[b]).sum() for row in heading for a, b in combinations(range(5), 2)]
        trace = synthetic(np.arange(3.0), robots=5, axes=3, v=v)
        assert value("order", trace) == pytest.approx(np.mean(pairs))


class TestGraph:
    """Graphs of which the Laplacian's eigenvalues are known (Fiedler 1973)."""

    @pytest.mark.parametrize("n", [4, 5, 8])
    def test_a_cycle(self, n):
        side = 0.5 / math.sin(math.pi / n)  # neighbors are a meter apart
        trace = still(ring(n, side, time=[0.0])[0], about={"sensing_robots": 0.7})
        assert value("union", trace) == 1.0
        assert value("connectivity", trace) == pytest.approx(2.0 * (1.0 - math.cos(2.0 * math.pi / n)) / n)

    def test_messages_count_where_robots_communicate(self):
        heard = np.array([[2, 0], [1, 0], [4, 0], [3, 0]])
        trace = on_a_line(0, 0.1, 0.2, 0.3, heard_from=heard, about=SEES)
        assert value("union", trace) == pytest.approx(2 / 3)

    def test_who_is_lost_is_no_part_of_it(self):
        gone = np.tile([0.0, 1.0, 0.0], (6, 1))
        trace = on_a_line(0, 1, 2, about=SEES, lost=gone)
        assert (value("union", trace), value("connectivity", trace)) == (0.0, 0.0)

    def test_it_is_a_mean_over_time(self):
        q = np.zeros((501, 2, 2))
        q[:, 1, 0] = 1.0 + 8.0 * steps(TIME, 2.5)
        trace = synthetic(TIME, robots=2, q=q, about=SEES, truth=False)
        assert value("union", trace) == value("connectivity", trace) == pytest.approx(0.25, abs=2e-3)

    @given(places=arrays(float, (6, 2), elements=st.floats(-3.0, 3.0)))
    def test_groups_and_eigenvalues_are_those_of_who_sees_whom(self, places):
        apart = np.linalg.norm(places[:, None] - places, axis=2)
        assume((np.abs(apart - 1.4) > 1e-9).all())
        graph = (apart <= 1.4) & ~np.eye(6, dtype=bool)
        trace = still(places, about=SEES)
        assert value("union", trace) == pytest.approx((6 - groups(graph)) / 5)
        assert value("connectivity", trace) == pytest.approx(fiedler(graph) / 6, abs=1e-9)


class TestSafety:
    @pytest.mark.parametrize(
        ("about", "share"),
        [
            ({"safe_distance": 0.5, "safe_distance_measure": "surface"}, 1 / 3),
            ({"safe_distance": 0.5, "safe_distance_measure": "center"}, 1.0),
            ({"safe_distance": 0.5, "safe_distance_measure": "surface", "teammate_distance": 0.1}, 1.0),
            ({"safe_distance": 0.1, "safe_distance_measure": "center"}, 1.0),  # not less than a touch
        ],
    )
    def test_the_distance_is_that_of_avoidance(self, about, share):
        assert value("safety_agents", on_a_line(0, 0.8, 1.6, about=about)) == pytest.approx(share)

    def test_obstacles(self):
        distance = np.full((501, 2, 3), 9.0)
        distance[:250, 0, 1] = 0.5
        given = {"robots": 2, "obstacles": 3, "obstacle_distance": distance}
        usual = synthetic(TIME, **given)
        radius = float(usual["obstacle_radius"].values[1] + usual["robot_radius"].values[0])
        distance[:250, 0, 1] = 0.9 * radius
        assert value("safety_obstacles", synthetic(TIME, **given)) == pytest.approx(1 - 1 / 12, abs=1e-3)
        distance[:250, 0, 1] = 1.1 * radius
        assert value("safety_obstacles", synthetic(TIME, **given)) == 1.0
        avoids = {"safe_distance": 0.2 * radius, "safe_distance_measure": "surface"}
        found = value("safety_obstacles", synthetic(TIME, **given, about=avoids))
        assert found == pytest.approx(1 - 1 / 12, abs=1e-3)

    @given(q=arrays(float, (4, 4, 3), elements=st.floats(-1.0, 1.0)))
    def test_it_is_the_share_of_pairs(self, q):
        gaps = [np.linalg.norm(row[a] - row[b]) for row in q for a, b in combinations(range(4), 2)]
        trace = synthetic(np.arange(4.0), robots=4, axes=3, q=q)
        assert value("safety_agents", trace) == pytest.approx(np.mean(np.array(gaps) >= 0.4))


def test_what_they_say_nothing_of(make_trace):
    for name in NAMES[:4]:
        assert measure(name, make_trace(TIME)).reason == "there is one robot"
    for name in NAMES[1:3]:
        found = measure(name, make_trace(TIME, robots=2, truth=False))
        assert found.reason == "robots see each other at any distance, and do not communicate"
    assert measure("safety_obstacles", make_trace(TIME, robots=2)).reason == "there are no obstacles"


def recomputed_order(again):
    cosines = []
    for v, left in zip(again.v, again.alive, strict=True):
        v = [each for each, there in zip(v, left, strict=True) if there and math.hypot(*each) > 0.01 * 0.2]
        pairs = [a @ b / math.hypot(*a) / math.hypot(*b) for a, b in combinations(v, 2)]
        cosines += [np.mean(pairs)] if pairs else []
    return float(np.mean(cosines)) if cosines else None


def _adjacency(again):
    """Who hears whom, or is within the range of sensing, of the robots of each step."""
    reach = again.case.keys.get("sensing", {}).get("radius", {}).get("robots")
    if "communication" not in again.case.keys and reach is None:
        return
    heard = again.get("heard_from").astype(int) if "communication" in again.case.keys else None
    for step, q in enumerate(again.q):
        graph = np.zeros((again.n, again.n))
        for a, b in combinations(range(again.n), 2):
            hears = heard is not None and (b + 1 in heard[step, a] or a + 1 in heard[step, b])
            sees = heard is None and math.dist(q[a], q[b]) <= reach + 2.0 * again.case.robot
            graph[a, b] = graph[b, a] = hears or sees
        yield graph


def groups(graph):
    """How many parts of a graph are not linked."""
    reached = np.linalg.matrix_power(graph + np.eye(len(graph)), len(graph)) > 0
    return len({tuple(row) for row in reached})


def fiedler(graph):
    """The second least eigenvalue of a graph's Laplacian."""
    graph = graph.astype(float)
    return round(float(np.sort(np.linalg.eigvalsh(np.diag(graph.sum(axis=0)) - graph))[1]), 12)


def recomputed_union(again):
    found = [(again.n - groups(graph)) / (again.n - 1) for graph in _adjacency(again)]
    return float(np.mean(found)) if found else None


def recomputed_connectivity(again):
    values = [fiedler(graph) / again.n for graph in _adjacency(again)]
    return float(np.mean(values)) if values else None


def _safe(again):
    """The safe distances to teammates and to obstacles, surface to surface [m]."""
    behaviors = again.case.keys.get("mission", {}).get("behaviors", ["avoid_obstacles"])
    if "avoid_obstacles" not in behaviors:
        return 0.0, 0.0
    spacing = 2.0 * again.case.radius * (math.sqrt(2.0 / 3.0) if again.p == 3 else math.sin(math.pi / 4))
    return min(2.0, 0.5 * (spacing - 2.0 * again.case.robot)), 2.0


def recomputed_safety_agents(again):
    gaps = np.array([again.gaps(a, b) for a, b in combinations(range(again.n), 2)])
    return float((gaps >= _safe(again)[0]).mean())


def recomputed_safety_obstacles(again):
    if not again.case.obstacles:
        return None
    return float((again.obstacle_gaps() - again.case.robot >= _safe(again)[1]).mean())
