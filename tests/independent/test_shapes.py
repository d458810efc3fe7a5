"""The watcher's own geometry: outside against MuJoCo's, inside against points of the surface."""

import mujoco
import numpy as np
import pytest

from tests.independent import shapes

CORNERS = np.array([[-2, -1, -1], [2, -1, -1.2], [1.8, 1.5, -1], [-1.5, 1.7, -0.9], [0.2, 0.1, 2.2]])
MEASURES = {
    "sphere": lambda points: shapes.ball(points, 0.9),
    "box": lambda points: shapes.box(points, np.array([1.2, 0.5, 0.8])),
    "cylinder": lambda points: shapes.cylinder(points, 0.7, 1.1),
    "capsule": lambda points: shapes.capsule(points, 0.5, 1.0),
    "ellipsoid": lambda points: shapes.ellipsoid(points, np.array([1.5, 0.4, 0.9])),
    "disc": lambda points: shapes.ellipsoid(points, np.array([1.5, 1.5, 0.4])),
    "egg": lambda points: shapes.ellipsoid(points, np.array([0.6, 0.6, 1.4])),
    "mesh": lambda points: shapes.hull(points, CORNERS),
}
GEOMS = {
    "sphere": 'type="sphere" size="0.9"',
    "box": 'type="box" size="1.2 0.5 0.8"',
    "cylinder": 'type="cylinder" size="0.7 1.1"',
    "capsule": 'type="capsule" size="0.5 1.0"',
    "ellipsoid": 'type="ellipsoid" size="1.5 0.4 0.9"',
    "disc": 'type="ellipsoid" size="1.5 1.5 0.4"',
    "egg": 'type="ellipsoid" size="0.6 0.6 1.4"',
    "mesh": 'type="mesh" mesh="mesh"',
}
BALL = 0.1


@pytest.mark.parametrize("name", MEASURES)
def test_outside_it_is_the_distance_that_mujoco_finds(name: str) -> None:
    model = mujoco.MjModel.from_xml_string(f"""
        <mujoco>
          <asset><mesh name="mesh" vertex="{" ".join(map(str, CORNERS.ravel()))}"/></asset>
          <worldbody>
            <geom name="solid" {GEOMS[name]}/>
            <body name="ball" mocap="true"><geom name="ball" type="sphere" size="{BALL}"/></body>
          </worldbody>
        </mujoco>""")
    data = mujoco.MjData(model)
    points = np.random.default_rng(1).uniform(-3.0, 3.0, (300, 3))
    found, segment = [], np.empty(6)
    for point in points:
        data.mocap_pos[0] = point
        mujoco.mj_kinematics(model, data)
        found.append(mujoco.mj_geomDistance(model, data, 0, 1, 100.0, segment))
    far = MEASURES[name](points) > 2 * BALL
    assert far.sum() > 100
    np.testing.assert_allclose(MEASURES[name](points)[far] - BALL, np.array(found)[far], atol=2e-6)


@pytest.mark.parametrize("name", MEASURES)
def test_inside_it_is_the_way_to_the_nearest_point_of_the_surface(name: str) -> None:
    """Points of the surface are found along rays from a point inside."""
    dice = np.random.default_rng(2)
    measure = MEASURES[name]
    points = dice.uniform(-1.5, 1.5, (400, 3))
    points = points[measure(points) < -0.05][:4]
    assert len(points) == 4
    every = dice.normal(size=(2000, 3))
    every /= np.linalg.norm(every, axis=1)[:, None]
    for point in points:
        rays, low, high = every, np.zeros(len(every)), np.full(len(every), 10.0)
        for _ in range(30):
            middle = 0.5 * (low + high)
            outside = measure(point + middle[:, None] * rays) > 0.0
            low, high = np.where(outside, low, middle), np.where(outside, middle, high)
            first = low <= high.min()  # the others end later
            rays, low, high = rays[first], low[first], high[first]
        least = high.min()
        depth = -measure(point[None])[0]
        assert depth <= least + 1e-9
        assert least - depth < 0.03 * least


def test_a_mesh_is_as_thick_as_the_narrowest_slit_that_it_fits_through() -> None:
    cube = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1.0, 1.0)])
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    assert shapes.least_width(cube * [3, 2, 0.1] @ turn) == pytest.approx(0.2)
    tetrahedron = cube[[0, 3, 5, 6]]  # of edge 2 sqrt(2): opposite edges are edge / sqrt(2) apart
    assert shapes.least_width(tetrahedron @ turn) == pytest.approx(2.0)
