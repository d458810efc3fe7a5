"""Robot files that change within a process: the next scenario has what they say now, earlier ones stay."""

from __future__ import annotations

from pathlib import Path

import pytest

from escort_mj.api import load_scenario
from escort_mj.errors import ScenarioError
from escort_mj.scenario.schema.scenario import Scenario
from tests import meshes

MODEL = """<mujoco><asset><mesh name="m" file="m.stl"/></asset><worldbody><body name="base" pos="0 0 0.3">
<freejoint/><geom type="mesh" mesh="m" mass="{mass}"/><include file="part.xml"/>
<site name="s"/></body></worldbody>
<actuator><motor site="s" gear="1 0 0 0 0 0" ctrlrange="-20 20"/><motor site="s" gear="0 1 0 0 0 0"
ctrlrange="-20 20"/><motor site="s" gear="0 0 0 0 0 1" ctrlrange="-5 5"/></actuator></mujoco>"""
PART = '<mujocoinclude><geom size="0.05" mass="{mass}"/></mujocoinclude>'


def write(folder: Path, mass: float = 1.0, part: float = 0.5, size: float = 0.2) -> None:
    (folder / "r.xml").write_text(MODEL.format(mass=mass))
    (folder / "part.xml").write_text(PART.format(mass=part))
    (folder / "m.stl").write_bytes(meshes.stl(size))


def loaded(folder: Path, more: str = "") -> Scenario:
    (folder / "s.yaml").write_text(
        f"duration: 1\ntarget: {{position: [9, 9]}}\n"
        f"robots: {{count: 1, kind: {{kind: mjcf, file: r.xml{more}}}}}\n"
    )
    return load_scenario(folder / "s.yaml")


@pytest.mark.parametrize("changed", [{"mass": 3.0}, {"part": 2.5}, {"size": 0.3}])
def test_what_changes_is_read_again(tmp_path: Path, changed: dict[str, float]) -> None:
    write(tmp_path)
    before = loaded(tmp_path).robots
    write(tmp_path, **changed)
    after = loaded(tmp_path).robots
    assert after.kind != before.kind
    if "size" in changed:
        assert after.radius > 1.2 * before.radius
    else:
        assert after.mass == pytest.approx(3.5) and before.mass == pytest.approx(1.5)
    write(tmp_path)
    assert loaded(tmp_path).robots == before


def test_a_digest_holds_within_a_process(tmp_path: Path) -> None:
    write(tmp_path)
    digest = loaded(tmp_path).robots.kind.sha256  # type: ignore[attr-defined]
    loaded(tmp_path, f", sha256: {digest}")
    write(tmp_path, mass=3.0)
    with pytest.raises(ScenarioError, match="has changed"):
        loaded(tmp_path, f", sha256: {digest}")
