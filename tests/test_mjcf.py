"""Elements of parts copied as plain XML: names, what is left out, and numbers to the bit."""

import xml.etree.ElementTree as ElementTree

import mujoco
import numpy as np
import pytest

from escort_mj.mjcf import child_named, copied, section, set_attributes
from escort_mj.world.model import parts
from escort_mj.world.model.parts import load_part, models_folder


def test_a_copy_is_named_after_its_robot_and_leaves_out_what_it_is_told() -> None:
    source = child_named(load_part("slung"), "body", "robot")
    copy = copied(source, "robot_7", skip=("z",))
    names = [element.get("name") for element in copy.iter() if "name" in element.attrib]
    assert names[:4] == ["robot_7", "robot_7_x", "robot_7_y", "robot_7_body"]
    assert "robot_7_payload_swing_x" in names and "robot_7_z" not in names
    assert source.get("name") == "robot", "parts are shared, and never changed"


def test_numbers_are_read_back_to_the_bit() -> None:
    values = np.random.default_rng(0).normal(size=50) * 10.0 ** np.arange(-25, 25)
    element = ElementTree.Element("geom")
    set_attributes(element, data=values, size=values[0], group=3, type="sphere")
    np.testing.assert_array_equal(np.array(element.attrib["data"].split(), dtype=float), values)
    assert float(element.attrib["size"]) == values[0]
    assert element.attrib["group"] == "3" and element.attrib["type"] == "sphere"


def test_sections_are_made_once_and_missing_names_are_told() -> None:
    tree = ElementTree.Element("mujoco")
    assert section(tree, "custom") is section(tree, "custom")
    with pytest.raises(KeyError, match="body robot_1"):
        child_named(tree, "body", "robot_1")


@pytest.mark.parametrize("path", sorted(models_folder().glob("*.xml")), ids=lambda path: path.stem)
def test_without_dm_control_parts_are_checked_by_mujoco_and_make_the_same_model(path, monkeypatch) -> None:
    text = path.read_text()
    with_it = ElementTree.fromstring(parts._checked(text))
    monkeypatch.setattr(parts, "find_spec", lambda name: None)
    without = ElementTree.fromstring(parts._checked(text))
    models = []
    for root in (with_it, without):
        materials = ElementTree.SubElement(root, "asset")  # those of the arena
        for name in {each.get("material") for each in root.iter("geom")} - {None}:
            ElementTree.SubElement(materials, "material", name=name)
        models.append(mujoco.MjModel.from_xml_string(ElementTree.tostring(root, "unicode")))
    images = [np.empty(mujoco.mj_sizeModel(model), np.uint8) for model in models]
    for model, image in zip(models, images, strict=True):
        mujoco.mj_saveModel(model, None, image)
    np.testing.assert_array_equal(*images)
    with pytest.raises(ValueError, match="unrecognized|unknown|Schema"):
        parts._checked(text.replace("<mujoco model", "<mujoco modle"))
