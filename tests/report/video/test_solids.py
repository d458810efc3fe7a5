"""Bodies as triangles: closed, of the right size, and where MuJoCo has them."""

import math

import mujoco
import numpy as np
import pytest

from escort_mj.errors import RunFolderError
from escort_mj.report.video.solids import floor_of, load_model, places, pose, solids_of

EVERY = """<mujoco><option gravity="0 0 0"/>
<asset><mesh name="wedge" vertex="0 0 0  1 0 0  0 1 0  0 0 1"/></asset><worldbody>
  <geom name="floor" type="plane" size="0 0 1" pos="0 0 -1" euler="10 0 0"/>
  <body name="robot_1" pos="0 0 1"><freejoint/><geom name="robot_1_body" type="box" size=".1 .2 .3"/>
    <geom name="robot_1_arm" type="capsule" size=".1 .4" pos="1 0 0" euler="0 90 20"/></body>
  <body name="robot_12"><joint type="slide" axis="1 0 0"/>
    <geom name="robot_12_body" size=".2" rgba="1 0 0 .5"/></body>
  <body name="target" mocap="true"><geom name="target_body" size=".3"/></body>
  <geom name="c" type="cylinder" size=".5 .25" pos="3 0 0" euler="30 0 0"/>
  <geom name="e" type="ellipsoid" size=".1 .2 .3" pos="4 0 0"/>
  <geom name="m" type="mesh" mesh="wedge" pos="5 0 0"/>
  <geom name="elsewhere" size="1" group="1" pos="9 0 0"/>
</worldbody></mujoco>"""


@pytest.fixture
def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(EVERY)


def volume(corners: np.ndarray) -> float:
    """Of triangles, shape (f, 3, 3), that face outward."""
    return float(np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6)


def test_shapes_are_closed_and_of_the_right_size(model: mujoco.MjModel) -> None:
    solids = solids_of(model)
    ball = 4 / 3 * math.pi
    expected = {
        "robot_1_body": 8 * 0.1 * 0.2 * 0.3,
        "robot_1_arm": ball * 0.1**3 + math.pi * 0.1**2 * 0.8,
        "robot_12_body": ball * 0.2**3,
        "target_body": ball * 0.3**3,
        "c": math.pi * 0.5**2 * 0.5,
        "e": ball * 0.1 * 0.2 * 0.3,
        "m": 1 / 6,
    }
    assert set(solids.names) == set(expected)
    for k, name in enumerate(solids.names):
        mesh = solids.meshes[solids.mesh[k]]
        corners = (mesh.vertices * solids.scale[k])[mesh.faces]
        assert volume(corners) == pytest.approx(expected[name], rel=0.03), name
        assert volume(corners + [7.0, 0.0, 0.0]) == pytest.approx(volume(corners), rel=1e-6), "it has a hole"
    assert len(solids.meshes) == 5  # balls and the ellipsoid share one
    assert solids.robot.tolist() == [
        {"robot_1_body": 0, "robot_1_arm": 0, "robot_12_body": 11}.get(name, -1) for name in solids.names
    ]


def test_places_are_those_of_mujoco(model: mujoco.MjModel) -> None:
    data, solids = mujoco.MjData(model), solids_of(model)
    qpos = np.array([0.3, -1.0, 2.0, 0.5, 0.5, -0.1, 0.7, 1.5])
    pose(model, data, qpos, np.array([7.0, 8.0, 9.0]))
    where, turn = places(model, data, solids.geoms)
    matrix = np.empty(9)
    for k, geom in enumerate(solids.geoms):
        mujoco.mju_quat2Mat(matrix, turn[k])
        np.testing.assert_allclose(matrix, data.geom_xmat[geom], atol=1e-9)
        np.testing.assert_allclose(where[k], data.geom_xpos[geom])
    assert where[solids.names.index("target_body")].tolist() == [7.0, 8.0, 9.0]


def test_the_floor(model: mujoco.MjModel) -> None:
    floor = floor_of(model)
    assert floor is not None
    np.testing.assert_allclose(floor[0], [0, 0, -1])
    assert floor[1][0] == pytest.approx(math.cos(math.radians(5)))
    assert floor_of(mujoco.MjModel.from_xml_string("<mujoco/>")) is None


def test_models_that_do_not_fit(tmp_path) -> None:
    (tmp_path / "model.xml").write_text(EVERY)
    assert load_model(tmp_path / "model.xml", 8).nq == 8
    with pytest.raises(RunFolderError, match="it has 8 coordinates, the trace has 9"):
        load_model(tmp_path / "model.xml", 9)
    (tmp_path / "model.xml").write_text("<mujoco><worldbody>")
    with pytest.raises(RunFolderError, match="is damaged: MuJoCo refuses it: XML parse error"):
        load_model(tmp_path / "model.xml", 8)
