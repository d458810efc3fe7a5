"""Elements of MJCF: copied, written and found. `world/model/parts.py` reads the parts in `models/`."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from typing import Any
from xml.etree.ElementTree import Element


def copied(source: Element, prefix: str, skip: Sequence[str] = ()) -> Element:
    """A copy of an element of a part and all its children.

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


def names_in_copy(source: Element, prefix: str) -> dict[str, str]:
    """Names below an element of a part, and what `copied` makes of them; without those that are skipped."""
    names: dict[str, str] = {}
    for child in source:
        name = child.get("name")
        if name is not None:
            names[name] = f"{prefix}_{name}"
        names |= names_in_copy(child, names[name] if name else prefix)
    return names


def set_attributes(element: Element, **attributes: Any) -> None:
    """Sets attributes of an element: words, whole numbers, and numbers that are read back to the bit."""
    for name, value in attributes.items():
        if not isinstance(value, str | int):
            value = " ".join(map(repr, map(float, value if hasattr(value, "__len__") else [value])))
        element.set(name, str(value))


def child_named(parent: Element, tag: str, name: str) -> Element:
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
