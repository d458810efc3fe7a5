"""Distances to shapes: against MuJoCo's own geometry, and against clouds of points."""

import mujoco
import numpy as np
import pytest

from escort_mj.scenario.geometry.shapes import (
    Solid,
    bounding_radius,
    extent,
    nearest_on_shape,
    quaternion,
    rotation_matrix,
)

TETRAHEDRON = np.array([[0.9, 0.0, -0.3], [-0.4, 0.8, -0.3], [-0.4, -0.7, -0.4], [0.1, 0.2, 1.1]])
SHAPES = {
    "sphere": (0.7,),
    "box": (0.9, 0.4, 0.6),
    "cylinder": (0.5, 0.8),
    "capsule": (0.4, 0.6),
    "ellipsoid": (0.5, 0.8, 1.2),
    "mesh": (),
}


def solid(shape: str) -> Solid:
    vertices = TETRAHEDRON if shape == "mesh" else np.zeros((0, 3))
    turned = rotation_matrix(quaternion((0.3, -0.7, 1.1)))
    return Solid(shape, SHAPES[shape], np.array([0.4, -0.2, 0.1]), turned, vertices)


def mujoco_distances(body: Solid, points: np.ndarray) -> np.ndarray:
    """Distances of points by MuJoCo: of small spheres around them, plus their radius."""
    mesh = " ".join(map(str, body.vertices.ravel()))
    asset = f'<asset><mesh name="m" vertex="{mesh}"/></asset>' if body.shape == "mesh" else ""
    size = 'mesh="m"' if body.shape == "mesh" else f'size="{" ".join(map(str, body.size))}"'
    turn = np.zeros(4)
    mujoco.mju_mat2Quat(turn, body.rotation.ravel())
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco>{asset}<worldbody><geom name="b" type="{body.shape}" {size} '
        f'pos="{" ".join(map(str, body.center))}" quat="{" ".join(map(str, turn))}"/>'
        '<body name="p" mocap="true"><geom name="p" size="0.001"/></body></worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    found = []
    for point in points:
        data.mocap_pos[0] = point
        mujoco.mj_kinematics(model, data)
        found.append(
            mujoco.mj_geomDistance(model, data, model.geom("p").id, model.geom("b").id, 100.0, None) + 0.001
        )
    return np.array(found)


@pytest.mark.parametrize("shape", SHAPES)
def test_distances_are_mujocos(shape: str):
    body = solid(shape)
    points = np.random.default_rng(3).normal(scale=2.0, size=(300, 3))
    points = points[nearest_on_shape(body, points)[1] > 0.02]
    surface, distance = nearest_on_shape(body, points)
    np.testing.assert_allclose(distance, mujoco_distances(body, points), atol=2e-6)
    np.testing.assert_allclose(np.linalg.norm(points - surface, axis=1), distance, rtol=1e-12)
    np.testing.assert_allclose(nearest_on_shape(body, surface)[1], 0.0, atol=1e-9)


@pytest.mark.parametrize("shape", SHAPES)
def test_inside_distances_are_negative_and_to_the_surface(shape: str):
    body = solid(shape)
    rng = np.random.default_rng(4)
    points = body.center + rng.normal(scale=0.15, size=(50, 3))
    surface, distance = nearest_on_shape(body, points)
    inside = distance < 0.0
    assert inside.sum() > 20
    np.testing.assert_allclose(nearest_on_shape(body, surface)[1], 0.0, atol=1e-9)
    # Nothing outside is nearer than the surface: no point of a cloud within that distance is outside.
    for point, depth in zip(points[inside], -distance[inside], strict=True):
        cloud = rng.normal(size=(200, 3))
        cloud = point + 0.999 * depth * cloud / np.linalg.norm(cloud, axis=1, keepdims=True)
        assert (nearest_on_shape(body, cloud)[1] < 1e-9).all()


@pytest.mark.parametrize("shape", SHAPES)
def test_extents_hold_the_shape_and_touch_it(shape: str):
    body = solid(shape)
    far = np.random.default_rng(5).normal(size=(20_000, 3))
    surface, _ = nearest_on_shape(body, body.center + 50.0 * far / np.linalg.norm(far, axis=1, keepdims=True))
    low, high = extent(body)
    assert (surface >= low - 1e-9).all() and (surface <= high + 1e-9).all()
    np.testing.assert_allclose([surface.min(axis=0), surface.max(axis=0)], [low, high], atol=0.02)
    assert np.linalg.norm(surface - body.center, axis=1).max() <= bounding_radius(
        shape, body.size, body.vertices
    ) * (1 + 1e-9)


def test_orientations():
    np.testing.assert_allclose(rotation_matrix(quaternion(np.pi / 2)) @ [1, 0, 0], [0, 1, 0], atol=1e-12)
    np.testing.assert_allclose(
        rotation_matrix(quaternion((0.0, np.pi / 2, 0.0))) @ [0, 0, 1], [1, 0, 0], atol=1e-12
    )
    np.testing.assert_allclose(
        rotation_matrix(quaternion((np.pi / 2, 0.0, np.pi))) @ [0, 1, 0], [0, 0, 1], atol=1e-12
    )
    np.testing.assert_allclose(quaternion((2.0, 0.0, 0.0, 2.0)), quaternion(np.pi / 2), atol=1e-12)
