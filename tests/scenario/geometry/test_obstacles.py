"""Obstacles resolved: names, groups, sizes."""

from typing import get_args

import numpy as np
import pytest

from escort_mj.palette import NAMED
from escort_mj.scenario import parse_scenario
from escort_mj.scenario.geometry.obstacle_body import clear_of
from escort_mj.scenario.geometry.obstacles import Body, obstacles_of
from escort_mj.scenario.geometry.shapes import outline
from escort_mj.scenario.schema.obstacle_tables import Color


def test_spheres_are_named_and_numbered() -> None:
    scenario = parse_scenario("obstacles: [{position: [8, 0], radius: 0.7}, {position: [0, 8], name: gate}]")
    first, second = obstacles_of(scenario)
    assert (first.name, first.group, first.shape, first.size) == ("obstacle_1", "obstacles", "sphere", (0.7,))
    assert first.position.tolist() == [8.0, 0.0]
    assert first.bounding_radius == 0.7
    assert (second.name, second.path) == ("gate", ("obstacles", 1))


def bodies(text: str) -> list[Body]:
    return list(obstacles_of(parse_scenario(text)))


def least_gaps(parts: list[Body], points: np.ndarray) -> np.ndarray:
    """How far points are from the nearest of some bodies, shape (k,) [m]."""
    return np.min([part.gaps(points) for part in parts], axis=0)


def test_walls_leave_doors_open():
    parts = bodies(
        "walls: [{points: [[-4, 6], [8, 6]], thickness: 0.4, doors: [{at: 3, width: 2}, {at: 9, width: 1}]}]"
    )
    assert [part.name for part in parts] == ["wall_1_1", "wall_1_2", "wall_1_3"]
    assert {part.group for part in parts} == {"walls"}
    spans = [(part.position[0] - part.size[0], part.position[0] + part.size[0]) for part in parts]
    np.testing.assert_allclose(spans, [(-4, -2), (0, 4.5), (5.5, 8)])
    on_line = np.array([[-1.0, 6.0], [5.0, 6.0], [2.0, 6.0]])
    np.testing.assert_allclose(least_gaps(parts, on_line), [1.0, 0.5, -0.2])


def test_a_corridor_has_its_clear_width_around_a_corner():
    walls = bodies("walls: [{points: [[-30, 8], [10, 8], [10, 30]], corridor: 3, thickness: 0.2}]")
    assert len(walls) == 4
    along = np.linspace(-29, 8.4, 50)
    middle = np.column_stack([along, np.full(50, 8.0)])
    np.testing.assert_allclose(least_gaps(walls, middle), 1.5, atol=1e-9)
    np.testing.assert_allclose(least_gaps(walls, np.array([[10.0, 20.0]])), 1.5)
    corners = np.array([[11.6, 6.4], [8.4, 9.6]])  # both walls are closed there, outside and inside
    assert (least_gaps(walls, corners) < 0.0).all()


def test_doors_in_space_have_a_sill_and_a_lintel():
    text = """
axes: 3
robots: {positions: [[9, 0, 0]]}
walls: [{points: [[-5, 5, 1], [5, 5, 1]], height: 6, doors: [{at: 5, width: 2, sill: 1, height: 3}]}]
"""
    parts = bodies(text)
    assert len(parts) == 4
    at = np.array([[0.0, 5.0, 1.5], [0.0, 5.0, 3.5], [0.0, 5.0, 6.0], [0.0, 5.0, 7.5], [3.0, 5.0, 3.5]])
    np.testing.assert_allclose(least_gaps(parts, at), [-0.1, 1.0, -0.1, 0.5, -0.1], atol=1e-9)


CLUTTER = """
axes: {axes}
seed: {seed}
duration: 60
target: {{position: ["0.5*t"{zeros}]}}
robots: {{positions: [[0, 6{zero}]]}}
walls: [{{points: [[-5, -9{zero}], [40, -9{zero}]]}}]
clutter:
  {{count: 20, low: [5, -8{low}], high: [35, 8{high}], passage: 1.5,
   shapes: [sphere, box, cylinder, capsule, ellipsoid]}}
"""


@pytest.mark.crossed
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("axes", [2, 3])
def test_clutter_leaves_its_passage(axes: int, seed: int):
    more = {
        "zeros": ", 0" * (axes - 1),
        "zero": ", 0" * (axes - 2),
        "low": ", -5" * (axes - 2),
        "high": ", 5" * (axes - 2),
    }
    scenario = parse_scenario(CLUTTER.format(axes=axes, seed=seed, **more))
    every = obstacles_of(scenario)
    clutter = [body for body in every if body.name.startswith("clutter")]
    assert len(clutter) == 20 and len({body.shape for body in clutter}) == 5
    path = np.pad(np.linspace(0, 30, 2000)[:, None], ((0, 0), (0, axes - 1)))
    assert least_gaps(clutter, path).min() >= 0.3 + 1.5
    assert least_gaps(clutter, np.array([scenario.robots.positions[0]])).min() >= 0.2 + 1.5
    for body in clutter:  # what is drawn lies in its ball, and balls keep apart
        surface = body.position + outline(body.solid, axes)
        assert np.linalg.norm(surface - body.position, axis=1).max() <= body.bounding_radius * (1 + 1e-9)
        others = [other for other in every if other.name != body.name]
        assert least_gaps(others, surface).min() >= 1.5 - 1e-9


def test_clutter_is_the_same_everywhere():
    text = CLUTTER.format(axes=2, seed=3, zeros=", 0", zero="", low="", high="")
    found = [body for body in bodies(text) if body.name.startswith("clutter")][:3]
    assert found[0].position.tolist() == bodies(text)[1].position.tolist()
    assert [body.shape for body in found] == ["sphere", "capsule", "ellipsoid"]
    np.testing.assert_array_equal(
        [body.position for body in found],
        [
            [19.416726339961937, 6.916519181865663],
            [25.020184142531296, -4.035438899134466],
            [27.316637168594625, 7.240637131344485],
        ],
    )


def test_colors_are_those_of_the_palette():
    assert set(get_args(Color)) == set(NAMED)


def test_points_are_clear_of_bodies_as_their_gaps_say() -> None:
    """The sphere around a body spares work and changes no answer: of lifted walls, of meshes off center."""
    parts = bodies(
        "walls: [{points: [[-4, 2], [4, 2]], height: 3}]\n"
        "obstacles: [{shape: mesh, position: [-3, -3], vertices: [[0, 0], [2, 0], [2, 1]]}]\n"
        "clutter: {count: 5, low: [-8, -8], high: [8, 8], shapes: [box, capsule, ellipsoid]}"
    )
    points = np.random.Generator(np.random.Philox(1)).uniform(-8, 8, (500, 2))
    for apart in (0.0, 0.5, 2.0):
        clear = clear_of(parts, points, apart)
        assert 0 < clear.sum() < len(points)
        np.testing.assert_array_equal(clear, least_gaps(parts, points) >= apart)
