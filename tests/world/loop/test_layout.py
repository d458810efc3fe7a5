"""Offsets into MuJoCo's structures, against the addresses and values that the bindings report."""

import ctypes

import mujoco
import pytest

from escort_mj.world.loop import layout
from escort_mj.world.plant import Plant

TWO_SPHERES = """
<mujoco>
  <custom><numeric name="a" data="1 2"/><numeric name="b" data="3"/></custom>
  <option cone="elliptic"/>
  <worldbody>
    <body mocap="true"><geom size="1" condim="4"/></body>
    <body pos="1.9 0 0"><joint name="x" type="slide"/><geom name="moves" size="1"/></body>
  </worldbody>
  <actuator><motor joint="x"/></actuator>
  <size nuserdata="3"/>
</mujoco>
"""

POINTERS = (
    (
        "mjData",
        "qpos qvel ctrl userdata qfrc_applied actuator_force mocap_pos efc_force xpos M qfrc_bias qacc",
    ),
    (
        "mjModel",
        "numeric_data numeric_adr numeric_size geom_bodyid jnt_qposadr qpos0 M_rownnz M_rowadr M_colind",
    ),
)


@pytest.fixture
def touching() -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Two spheres in contact, after the solve."""
    model = mujoco.MjModel.from_xml_string(TWO_SPHERES)
    data = mujoco.MjData(model)
    data.time = 1.25
    mujoco.mj_forward(model, data)
    assert data.ncon == 1
    return model, data


@pytest.mark.parametrize(("struct", "fields"), POINTERS)
def test_pointers(touching, struct: str, fields: str) -> None:
    owner = touching[struct == "mjData"]
    for field in fields.split():
        stored = ctypes.c_void_p.from_address(owner._address + layout._offset(struct, field)).value
        assert stored == getattr(owner, field).ctypes.data, field


def test_numbers(touching) -> None:
    model, data = touching

    def read(owner, kind, struct: str, field: str):
        return kind.from_address(owner._address + layout._offset(struct, field)).value

    assert read(data, ctypes.c_double, "mjData", "time") == 1.25
    assert read(data, ctypes.c_int, "mjData", "ncon") == 1
    assert read(model, ctypes.c_int, "mjModel", "nnumericdata") == 3
    assert read(model, ctypes.c_double, "mjModel", "opt.timestep") == model.opt.timestep
    assert read(model, ctypes.c_int, "mjModel", "opt.cone") == mujoco.mjtCone.mjCONE_ELLIPTIC


def test_contacts(touching) -> None:
    model, data = touching
    first = ctypes.c_void_p.from_address(data._address + layout._offset("mjData", "contact")).value
    contact = layout.structure("mjContact").from_address(first)
    expected = data.contact[0]
    assert contact.dist == pytest.approx(expected.dist, abs=0.0)
    assert contact.dim == expected.dim == 4
    assert list(contact.geom) == list(expected.geom)
    assert contact.efc_address == expected.efc_address
    assert list(contact.frame) == list(expected.frame)


def test_size_of_a_contact() -> None:
    """The second contact stands where the size of the first says."""
    model = mujoco.MjModel.from_xml_string(
        """<mujoco><worldbody><geom size="1"/>
        <body pos="1.9 0 0"><freejoint/><geom size="1"/></body>
        <body pos="-1.8 0 0"><freejoint/><geom size="1"/></body></worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    kind = layout.structure("mjContact")
    first = ctypes.c_void_p.from_address(data._address + layout._offset("mjData", "contact")).value
    found = [kind.from_address(first + i * ctypes.sizeof(kind)).dist for i in range(2)]
    assert found == list(data.contact.dist) and len(set(found)) == 2


CHECKED = (
    ("mjData", "qpos"),
    ("mjData", "qvel"),
    ("mjData", "ctrl"),
    ("mjData", "userdata"),
    ("mjData", "qfrc_applied"),
    ("mjData", "actuator_force"),
    ("mjData", "qacc"),
    ("mjData", "mocap_pos"),
    ("mjData", "M"),
    ("mjData", "qfrc_bias"),
    ("mjData", "time"),
    ("mjData", "ncon"),
    ("mjData", "contact"),
    ("mjData", "efc_force"),
    ("mjModel", "numeric_data"),
    ("mjModel", "nnumericdata"),
    ("mjModel", "M_rownnz"),
    ("mjModel", "M_rowadr"),
    ("mjModel", "M_colind"),
    ("mjModel", "opt.cone"),
    ("mjContact", "dim"),
    ("mjContact", "geom"),
    ("mjContact", "efc_address"),
)


@pytest.mark.parametrize("planted", CHECKED, ids=".".join)
def test_a_wrong_offset_is_caught(planted: tuple[str, str], make_world, monkeypatch) -> None:
    """Every offset that the callbacks use is held against the bindings before the first step."""
    world = make_world(duration=1.0)
    Plant(world)
    true = layout._offset

    def wrong(struct: str, field: str) -> int:
        return true(struct, field) + (8 if (struct, field) == planted else 0)

    monkeypatch.setattr(layout, "_offset", wrong)
    layout._check_contacts.cache_clear()
    with pytest.raises(RuntimeError, match="not where it is declared"):
        Plant(world)
