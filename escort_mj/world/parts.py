"""Composes the hand-written parts in `models/` into one flat MJCF tree.

Flat, because attaching one model per robot costs time quadratic in their number. What there may be thousands
of is copied as plain XML: an element of `dm_control.mjcf` costs 0.3 ms.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

from dm_control import mjcf


@cache
def models_folder() -> Path:
    """Folder of the MJCF parts: inside an installed package, or beside the package in a checkout."""
    installed = Path(str(files("escort_mj"))) / "models"
    return installed if installed.is_dir() else Path(str(files("escort_mj"))).parent / "models"


@cache
def load_part(name: str) -> Any:
    """One of the parts, such as `point_mass`, as an MJCF root; shared, so never changed."""
    return mjcf.from_path(str(models_folder() / f"{name}.xml"))


def new_root(part: str, model: str) -> Any:
    """A fresh MJCF tree that starts as a copy of a part, under a model name of its own."""
    root = mjcf.from_path(str(models_folder() / f"{part}.xml"))
    root.model = model
    return root


def graft(source: Any, parent: Any, prefix: str, skip: tuple[str, ...] = ()) -> Any:
    """Copies an element of a part, with all its children, under another tree's element.

    Args:
        source: Element to copy.
        parent: Element that receives the copy.
        prefix: What stands before every name of the copy; the source's own name is replaced by it.
        skip: Names of children that are left out.

    Returns:
        The copy.
    """
    attributes = {key: value for key, value in source.get_attributes().items() if key != "name"}
    for key, value in attributes.items():
        if isinstance(value, mjcf.Element):
            attributes[key] = value.name
    if hasattr(source, "name"):
        attributes["name"] = prefix
    copy = parent.add(source.tag, **attributes)
    for child in source.all_children():
        name = getattr(child, "name", None)
        if name is None or name not in skip:
            graft(child, copy, f"{prefix}_{name}" if name else prefix)
    return copy


@cache
def load_plain(name: str) -> Element:
    """One of the parts as plain XML; shared, so never changed."""
    return ElementTree.parse(models_folder() / f"{name}.xml").getroot()


def copied(source: Element, prefix: str, skip: Sequence[str] = ()) -> Element:
    """A copy of an element of a part and all its children, as `graft` makes one.

    Args:
        source: Element to copy.
        prefix: What stands before every name of the copy; the source's own name is replaced by it.
        skip: Names of children that are left out.
    """
    copy = Element(source.tag, source.attrib)
    if "name" in source.attrib:
        copy.set("name", prefix)
    for child in source:
        name = child.get("name")
        if name is None or name not in skip:
            copy.append(copied(child, f"{prefix}_{name}" if name else prefix))
    return copy


def write(element: Element, **attributes: Any) -> None:
    """Sets attributes of an element: words, whole numbers, and numbers that are read back to the bit."""
    for name, value in attributes.items():
        if not isinstance(value, str | int):
            value = " ".join(map(repr, map(float, value if hasattr(value, "__len__") else [value])))
        element.set(name, str(value))


def named(parent: Element, tag: str, name: str) -> Element:
    """The element of a tag and name below another.

    Raises:
        KeyError: If there is none.
    """
    for element in parent.iter(tag):
        if element.get("name") == name:
            return element
    raise KeyError(f"{tag} {name}")


def section(tree: Element, tag: str) -> Element:
    """One of the sections of an MJCF tree, made where there is none."""
    found = tree.find(tag)
    return ElementTree.SubElement(tree, tag) if found is None else found
