"""A robot's MJCF without default classes, and copies of it in a world's flat tree.

MuJoCo writes a model out in a form of its own: includes, macros and angles are gone. What its classes of
defaults say is written into each element here, so that two files may use the same names, and copies are plain
elements: attaching models one by one takes time quadratic in their number.
"""

from __future__ import annotations

from collections.abc import Mapping
from xml.etree.ElementTree import Element

import mujoco
import numpy as np

from escort_mj.mjcf import set_attributes

MAIN = "main"
NAMED = frozenset(
    "name joint joint1 joint2 jointinparent site site1 site2 refsite sidesite cranksite slidersite tendon "
    "tendon1 tendon2 actuator geom geom1 geom2 body body1 body2 target objname refname camera".split()
)
"""Attributes that hold names of what belongs to one robot."""
OF_ASSETS = frozenset(("mesh", "material", "texture"))
OF_BODIES = frozenset(("body", "body1", "body2", "target"))
BODY_TYPES = ("body", "xbody")
OWN_DEFAULTS = ("tendon", "equality")  # what is in these has their defaults, not those of its own tag
PATHS = ("fixed", "spatial")
FLOOR_BITS, BITS = 3, 1  # contype of what floor, obstacles and robots touch, and all but the floor
SHOWN, HIDDEN = 0, 5  # groups of geoms


def written_out(root: Element) -> Element:
    """A copy of MJCF, as MuJoCo writes it, in which elements have what their default classes say."""
    classes = _classes(root.find("default"))
    copy = Element(root.tag, root.attrib)
    copy.extend(_with_defaults(child, classes, MAIN, "") for child in root if child.tag != "default")
    return copy


def _classes(default: Element | None) -> dict[str, dict[str, dict[str, str]]]:
    """What each class says of each tag, with what it inherits."""
    found: dict[str, dict[str, dict[str, str]]] = {MAIN: {}}

    def read(element: Element, name: str, inherited: Mapping[str, Mapping[str, str]]) -> None:
        own = {tag: dict(values) for tag, values in inherited.items()}
        for child in element:
            if child.tag != "default":
                own.setdefault(child.tag, {}).update(child.attrib)
        found[name] = own
        for child in element.findall("default"):
            read(child, child.get("class", MAIN), own)

    if default is not None:
        read(default, default.get("class", MAIN), {})
    return found


def _with_defaults(
    element: Element, classes: Mapping[str, Mapping[str, Mapping[str, str]]], inherited: str, parent: str
) -> Element:
    """A copy of an element and its children with their defaults.

    Args:
        element: What to copy.
        classes: What each class says of each tag.
        inherited: Class of an element that names none.
        parent: Tag of the element that it is in.
    """
    inherited = element.get("childclass", inherited)
    tag = parent if parent in OWN_DEFAULTS else element.tag
    said = classes.get(element.get("class", inherited), {}).get(tag, {})
    own = {key: value for key, value in element.items() if key not in ("class", "childclass")}
    if parent in PATHS or (element.tag == "joint" and own.get("type") == "free"):
        said = {}  # joints, sites and geoms of a tendon name others; a free joint is a <freejoint>
    copy = Element(element.tag, {**said, **own})
    copy.extend(_with_defaults(child, classes, inherited, element.tag) for child in element)
    return copy


def write_masses(root: Element, model: mujoco.MjModel) -> None:
    """Write the compiled mass and inertia into each body: the world's own compiler infers none."""
    for number, body in enumerate(root.find("worldbody").iter("body"), 1):  # type: ignore[union-attr]
        for inertial in body.findall("inertial"):
            body.remove(inertial)
        if model.body_mass[number] <= 0.0:
            continue
        inertial = Element("inertial")
        body.insert(0, inertial)
        set_attributes(
            inertial, pos=model.body_ipos[number], quat=model.body_iquat[number],
            mass=model.body_mass[number], diaginertia=model.body_inertia[number],
        )  # fmt: skip


def make_solid(root: Element, model: mujoco.MjModel, rises: bool) -> list[tuple[str, str]]:
    """Let geoms that can touch anything touch what a mission has; what is drawn only goes to one group.

    Args:
        root: The robot's outermost body, as MuJoCo writes it, bodies named.
        model: Compiled from the file.
        rises: Whether the floor bears it; else it passes through.

    Returns:
        Pairs of bodies that touch each other neither in the file nor here.
    """
    geoms = list(root.iter("geom"))
    visible = any(int(geom.get("group", "0")) < 3 for geom in geoms)
    bits = str(FLOOR_BITS if rises else BITS)
    for geom in geoms:
        shown = int(geom.get("group", "0")) < 3 or not visible
        geom.set("group", str(SHOWN if shown else HIDDEN))
        if geom.get("contype", "1") != "0" or geom.get("conaffinity", "1") != "0":
            geom.set("contype", bits)
            geom.set("conaffinity", bits)
            geom.set("priority", str(int(geom.get("priority", "0")) + 1))  # as the floor's, or above it
    names = {model.body(str(body.get("name"))).id: str(body.get("name")) for body in root.iter("body")}
    solid = {body: _bits(model, body) for body in names}
    apart = []
    for first, mine in solid.items():
        for second, other in solid.items():
            if first < second and len(mine) and len(other):
                meets = (mine[:, None, 0] & other[None, :, 1]) | (other[None, :, 0] & mine[:, None, 1])
                if not meets.any():
                    apart.append((names[first], names[second]))
    return apart


def _bits(model: mujoco.MjModel, body: int) -> np.ndarray:
    """Of the geoms of a body that can touch anything, shape (k, 2)."""
    first = model.body_geomadr[body]
    chosen = slice(first, first + model.body_geomnum[body])
    found = np.column_stack([model.geom_contype[chosen], model.geom_conaffinity[chosen]])
    return np.asarray(found[found.any(axis=1)])


def named_copy(element: Element, prefix: str, assets: str, root: str) -> Element:
    """A copy of an element in which everything has names of its own.

    Args:
        element: What to copy.
        prefix: Of the robot, `robot_1`.
        assets: What stands before the names of assets.
        root: Name of the outermost body, which becomes the prefix itself.
    """
    found = {}
    for key, value in element.items():
        if key in OF_ASSETS:
            value = f"{assets}/{value}"
        elif key in NAMED:
            of_body = key in OF_BODIES or (key == "name" and element.tag == "body")
            of_body = of_body or (key == "objname" and element.get("objtype") in BODY_TYPES)
            of_body = of_body or (key == "refname" and element.get("reftype") in BODY_TYPES)
            value = prefix if of_body and value == root else f"{prefix}/{value}"
        found[key] = value
    copy = Element(element.tag, found)
    copy.extend(named_copy(child, prefix, assets, root) for child in element)
    return copy


def asset_copy(element: Element, assets: str) -> Element:
    """A copy of an asset under a name of its own."""
    found = {
        key: f"{assets}/{value}" if key == "name" or key in OF_ASSETS else value
        for key, value in element.items()
    }
    copy = Element(element.tag, found)
    copy.extend(asset_copy(child, assets) for child in element)
    return copy
