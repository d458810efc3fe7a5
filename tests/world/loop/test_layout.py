"""Offsets into MuJoCo's structures are held against what the bindings report, before the first step."""

import pytest

from escort_mj.world.loop import layout
from escort_mj.world.plant import Plant

CHECKED = {
    "mjData": "qpos qvel ctrl userdata qfrc_applied actuator_force qacc mocap_pos M qfrc_bias time ncon"
    " contact efc_force geom_xpos geom_xmat xpos xmat",
    "mjModel": "numeric_data nnumericdata M_rownnz M_rowadr M_colind opt.cone geom_size geom_type",
    "mjContact": "dim geom efc_address dist frame",
}
PLANTED = [(struct, field) for struct, fields in CHECKED.items() for field in fields.split()]
PLANTED.append(("mjContact", ""))  # its size, by which the second contact is found


@pytest.mark.parametrize("planted", PLANTED, ids=".".join)
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
