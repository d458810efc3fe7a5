"""Surroundings from files: obstacles are what MuJoCo has of the file, and faults say where they are."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import escort_mj
from escort_mj import ScenarioError
from escort_mj.scenario.geometry.shapes import quaternion, rotation_matrix
from escort_mj.scenario.mission import Mission
from tests import meshes
from tests.corpus import documents, is_said

GEOMS = """
<geom name="board" type="box" size=".8 .1 .5" pos="4 3 .5" euler="0 0 30"/>
<geom name="beam" type="box" size=".2 .3 1" pos="-4 3 1" euler="20 30 40"/>
<geom name="pillar" type="cylinder" size=".3 1" pos="-3 -2 1"/>
<geom name="barrel" type="cylinder" size=".3 .6" pos="0 -4 .4" euler="90 15 0"/>
<geom name="pipe" type="capsule" size=".1 1" pos="0 4 .3" euler="0 80 20"/>
<geom name="egg" type="ellipsoid" size=".5 .3 .2" pos="5 -3 .4" euler="10 20 30"/>
<geom name="ball" type="sphere" size=".4" pos="6 0 .4"/>
<geom name="ramp" type="mesh" mesh="wedge" pos="-6 0 0" euler="0 0 15"/>
"""
WEDGE = '<asset><mesh name="wedge" vertex="0 0 0 1 0 0 0 1 0 1 1 0 0 0 1 1 0 1"/></asset>'
OTHERS = """
<geom type="plane" size="9 9 .1"/>
<geom name="sign" type="box" size="9 9 9" contype="0" conaffinity="0"/>
"""
BASE = {"name": "hall", "duration": 1, "robots": {"positions": [[-1, 0], [1, 0]]}}
PLACE = {"position": [0.5, -0.3], "orientation": 0.7}


def written(folder: Path, geoms: str = GEOMS + OTHERS, name: str = "hall.xml") -> Path:
    (file := folder / name).write_text(f"<mujoco>{WEDGE}<worldbody>{geoms}</worldbody></mujoco>")
    return file


def loaded(folder: Path, table: dict[str, object], **keys: object) -> escort_mj.Scenario:
    import json

    (file := folder / "hall.yaml").write_text(json.dumps(BASE | keys | {"scenery": [table]}))
    return escort_mj.load_scenario(file)


def distances(model: mujoco.MjModel, geom: str, points: np.ndarray) -> np.ndarray:
    """Distance of points from a geom of the file, by MuJoCo; -1 within."""
    data, probe = mujoco.MjData(model), model.geom("probe").id
    found = []
    for point in points:
        data.mocap_pos[0] = point
        mujoco.mj_kinematics(model, data)
        found.append(mujoco.mj_geomDistance(model, data, model.geom(geom).id, probe, 99.0, None) + 1e-3)
    return np.array(found)


def test_in_space_obstacles_are_the_files_geoms(tmp_path: Path) -> None:
    written(tmp_path)
    turn = (0.3, -0.4, 1.2)
    scenario = loaded(
        tmp_path,
        {"file": "hall.xml", "position": [1, 2, 3], "orientation": turn, "color": "red"},
        axes=3,
        robots={"positions": [[-1, 0, 0], [1, 0, 0]]},
    )
    probe = '<body name="probe" mocap="true"><geom name="probe" type="sphere" size=".001"/></body>'
    model = mujoco.MjModel.from_xml_string(f"<mujoco>{WEDGE}<worldbody>{GEOMS}{probe}</worldbody></mujoco>")
    bodies = {body.name: body for body in Mission(scenario).obstacles}
    names = [f"hall_{model.geom(g).name}" for g in range(model.ngeom - 1)]
    assert list(bodies) == names and {body.color for body in bodies.values()} == {"red"}
    turned, random = rotation_matrix(quaternion(turn)), np.random.default_rng(1)
    for name, body in bodies.items():
        points = model.geom(name[5:]).pos + random.uniform(-2.0, 2.0, (40, 3))
        theirs = distances(model, name[5:], points)
        ours = body.gaps(points @ turned.T + [1.0, 2.0, 3.0])
        outside = theirs > 0.01
        assert outside.sum() > 10 and np.abs(ours - theirs)[outside].max() < 2e-5
        assert (ours[~outside] < 0.011).all()


def test_in_the_plane_obstacles_are_outlines_seen_from_above(tmp_path: Path) -> None:
    model = mujoco.MjModel.from_xml_path(str(written(tmp_path)))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    bodies = {body.name: body for body in Mission(loaded(tmp_path, {"file": "hall.xml", **PLACE})).obstacles}
    cos, sin = np.cos(0.7), np.sin(0.7)
    turned, random = np.array([[cos, -sin], [sin, cos]]), np.random.default_rng(2)
    for name, body in bodies.items():
        geom = model.geom(name[5:]).id
        local = random.normal(size=(4000, 3))
        size = model.geom_size[geom]
        match mujoco.mjtGeom(model.geom_type[geom]):
            case mujoco.mjtGeom.mjGEOM_SPHERE:
                local *= size[0] / np.linalg.norm(local, axis=1, keepdims=True)
            case mujoco.mjtGeom.mjGEOM_ELLIPSOID:
                local *= size / np.linalg.norm(local, axis=1, keepdims=True)
            case mujoco.mjtGeom.mjGEOM_BOX:
                local = np.clip(5.0 * local, -size, size)
            case mujoco.mjtGeom.mjGEOM_MESH:
                local = model.mesh_vert.copy()
            case _:  # a cylinder, or a capsule without its caps
                round_ = local[:, :2] / np.linalg.norm(local[:, :2], axis=1, keepdims=True) * size[0]
                local = np.column_stack([round_, np.clip(5.0 * local[:, 2], -size[1], size[1])])
        seen = (local @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom])[:, :2]
        gaps = body.gaps(seen @ turned.T + PLACE["position"])
        assert gaps.max() < 1e-9 and gaps.max() > -0.03, name  # within, and some at the border
        assert body.is_sphere or body.solid.shape in ("box", "cylinder", "mesh")


@pytest.mark.parametrize("pitch", [90, -90, 89.9999995, 89.998, -89.998, 89.9])
def test_orientations_are_exact_where_angles_are_ambiguous(tmp_path: Path, pitch: float) -> None:
    turned = f'<geom name="mast" type="box" size="1 .2 .3" pos="0 0 4" euler="20 {pitch!r} -120"/>'
    text = f'<mujoco><compiler eulerseq="XYZ"/><worldbody>{turned}</worldbody></mujoco>'
    (tmp_path / "hall.xml").write_text(text)
    start = {"positions": [[-1, 0, 0], [1, 0, 0]]}
    (mast,) = loaded(tmp_path, {"file": "hall.xml"}, axes=3, robots=start).obstacles
    model = mujoco.MjModel.from_xml_string(text)
    mujoco.mj_kinematics(model, data := mujoco.MjData(model))
    found = rotation_matrix(quaternion(mast.orientation))
    np.testing.assert_allclose(found, data.geom_xmat[0].reshape(3, 3), rtol=0, atol=5e-8)


def test_what_is_above_robots_or_below_the_floor_is_left_out(tmp_path: Path) -> None:
    crane = '<geom name="crane" type="box" size="1 1 .1" pos="0 3 2"/>'
    cellar = '<geom name="cellar" type="box" size="1 1 .1" pos="0 3 -2"/>'
    written(tmp_path, crane + cellar + '<geom name="foot" type="box" size=".2 .2 .2" pos="0 3 .2"/>')
    for below, names in ((None, ["hall_foot"]), (2.0, ["hall_crane", "hall_foot"])):
        table = {"file": "hall.xml"} | ({"below": below} if below else {})
        assert [each.name for each in loaded(tmp_path, table).obstacles] == names


@pytest.mark.parametrize("suffix", ["obj", "stl"])
def test_a_mesh_alone(tmp_path: Path, suffix: str) -> None:
    content = meshes.obj().encode() if suffix == "obj" else meshes.stl()
    (tmp_path / f"rock.{suffix}").write_bytes(content)
    scenario = loaded(tmp_path, {"file": f"rock.{suffix}", "position": [3, 3], "name": "rock"})
    (rock,) = scenario.obstacles
    outline = np.array(rock.position) + np.array(rock.vertices)
    expected = np.array([[3, 3], [4, 3], [3, 4]])
    assert rock.name == "rock_mesh" and len(outline) == 3
    assert all(np.linalg.norm(outline - corner, axis=1).min() < 1e-6 for corner in expected)


def test_a_stored_scenario_needs_no_file(tmp_path: Path) -> None:
    file = written(tmp_path)
    scenario = loaded(tmp_path, {"file": "hall.xml"})
    run = escort_mj.run(scenario, out=tmp_path / "run", figures=False, video=False)
    file.unlink()
    assert escort_mj.load_scenario(tmp_path / "run" / "scenario.yaml") == scenario == run.scenario
    assert not scenario.scenery and scenario.replace({"seed": 3}).obstacles == scenario.obstacles


def test_a_scenario_that_python_has_tells_where_it_looks_for_files(tmp_path: Path) -> None:
    """It is in no folder any more: paths begin here."""
    written(tmp_path)
    scenario = loaded(tmp_path, {"file": "hall.xml"})
    with pytest.raises(ScenarioError, match=rf"hall\.xml: there is no such file in {Path.cwd()}"):
        scenario.replace({"scenery[0].file": "hall.xml"})


def test_names_are_unique_and_have_letters_of_names(tmp_path: Path) -> None:
    box = '<geom type="box" size=".2 .2 .2" pos="{} 3 .2"/>'
    rack = '<body name="rack no. 1">' + box.format(2) + box.format(4) + "</body>"
    written(tmp_path, rack + box.format(6) + box.format(8) + f'<body name="box_2">{box.format(-6)}</body>')
    names = [each.name for each in loaded(tmp_path, {"file": "hall.xml", "name": "b"}).obstacles]
    assert names == ["b_box", "b_box_2", "b_rack_no__1", "b_rack_no__1_2", "b_box_2_2"]


PARTS, WRONG = documents(Path(__file__).parents[1] / "scenery.yaml")


@pytest.mark.parametrize("case", WRONG, ids=[case["said"] for case in WRONG])
def test_faults_say_where_they_are(tmp_path: Path, case: dict[str, Any]) -> None:
    written(tmp_path, PARTS[case["geoms"]] if "geoms" in case else GEOMS)
    with pytest.raises(ScenarioError) as caught:
        loaded(tmp_path, case.get("table", {"file": "hall.xml"}), **case.get("keys", {}))
    assert any(is_said(f"{fault.key}: {fault.message}", case["said"]) for fault in caught.value.faults)
    assert all(fault.line == 1 for fault in caught.value.faults)


def test_all_faults_are_found_at_once_each_in_its_line(tmp_path: Path) -> None:
    written(tmp_path, '<geom name="foot" type="sphere" size=".2"/>')
    (file := tmp_path / "hall.yaml").write_text(
        """seed: -1
scenery:
  - {file: hall.xml, position: [3, 3]}
  - {file: hall.xml, color: pink}
  - {file: nope.xml}
  - {file: hall.xml, position: [3]}
  - {fil: hall.xml, file: hall.xml}
expect:
  - {clearance: [robots, nope_mast], at_least: 0.1}
"""
    )
    with pytest.raises(ScenarioError) as caught:
        escort_mj.load_scenario(file)
    assert [(fault.line, fault.key) for fault in caught.value.faults] == [
        (1, "seed"),
        (4, "scenery[1].color"),
        (5, "scenery[2].file"),
        (6, "scenery[3].position"),
        (7, "scenery[4].fil"),
    ]


def test_as_many_tables_as_the_schema_allows(tmp_path: Path) -> None:
    written(tmp_path, '<geom name="foot" type="sphere" size=".2"/>')
    tables = [{"file": "hall.xml", "position": [3 + k, 3]} for k in range(21)]
    (file := tmp_path / "hall.yaml").write_text(f"{{scenery: {tables[:20]}}}".replace("'", ""))
    assert len(escort_mj.load_scenario(file).obstacles) == 20
    with pytest.raises(ScenarioError, match="scenery: found a list of 21; expected at most 20 items"):
        escort_mj.load_scenario(file, {"scenery": tables})


def test_the_depot_is_where_its_file_says() -> None:
    scenario = escort_mj.load_scenario("worlds/depot")
    names = [each.name for each in scenario.obstacles]
    assert {"depot_rack_1", "depot_pillar_2", "depot_weight", "depot_mast"} <= set(names)
    assert not {"depot_crane", "depot_sign", "depot_floor"} & set(names)
    assert all(first != second for first, second in pairwise(sorted(names)))
