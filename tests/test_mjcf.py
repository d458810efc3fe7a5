"""Elements of parts copied as plain XML: names, what is left out, and numbers to the bit."""

import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from escort_mj.mjcf import child_named, copied, section, set_attributes
from escort_mj.world.model.parts import load_part


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
