"""Composes the hand-written parts in `models/` into one flat MJCF tree.

Flat, because attaching one model per robot costs time quadratic in their number. `dm_control.mjcf` reads and
checks the parts at set-up; worlds are made of plain copies: an element of its own costs 0.3 ms.
Where dm_control is not installed (it needs labmaze, which has no wheel for Python 3.13 and later), MuJoCo
checks them: the models are the same.
"""

from __future__ import annotations

import hashlib
import sys
import xml.etree.ElementTree as ElementTree
from copy import deepcopy
from functools import cache
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from xml.etree.ElementTree import Element

from escort_mj.errors import PluginError
from escort_mj.native.shipped import remembered
from escort_mj.robots import RobotKind
from escort_mj.world.model.robot.files import REFUSED

SECTIONS = ("worldbody", "actuator")
"""What a mission takes of a kind's MJCF."""


@cache
def models_folder() -> Path:
    """Folder of the MJCF parts: inside an installed package, or beside the package in a checkout."""
    installed = Path(str(files("escort_mj"))) / "models"
    return installed if installed.is_dir() else Path(str(files("escort_mj"))).parent / "models"


@cache
def load_part(name: str) -> Element:
    """One of the parts, such as `point_mass`, read once; shared, so never changed."""
    text = _written(name)
    return ElementTree.fromstring(remembered(_file(name, text), lambda: _checked(text)))


def texts() -> dict[str, str]:
    """Return the checked parts, by the names of their files."""
    written = {path.stem: _written(path.stem) for path in sorted(models_folder().glob("*.xml"))}
    return {_file(name, text): _checked(text) for name, text in written.items()}


def _written(name: str) -> str:
    return (models_folder() / f"{name}.xml").read_text("utf-8")


def _file(name: str, text: str) -> str:
    """The name of a checked part's file: of what was written."""
    return f"{name}.{hashlib.sha256(text.encode()).hexdigest()[:16]}.xml"


def _checked(text: str) -> str:
    """A part without its faults: they raise whatever dm_control or MuJoCo raises."""
    if find_spec("dm_control") is None:
        import mujoco

        mujoco.MjSpec.from_string(text)
        return text
    from dm_control import mjcf

    return str(mjcf.from_xml_string(text).to_xml_string())


def part_of(kind: RobotKind) -> Element:
    """The part that a kind of robots is made of; shared, so never changed.

    Raises:
        PluginError: If a plugin's is not what it must be.
    """
    return _own_part(place_of(kind), kind.mjcf) if kind.mjcf else _shipped_part(kind.kind, kind.part)


def place_of(kind: RobotKind) -> str:
    """The file of the plugin that brings a kind, and the kind."""
    file = getattr(sys.modules.get(type(kind).__module__), "__file__", None)
    return f"{file}: the kind {kind.kind}" if file else f"the kind {kind.kind}"


@cache
def _shipped_part(name: str, part: str) -> Element:
    """A part in `models/` that a kind names."""
    if not (models_folder() / f"{part}.xml").is_file():
        raise PluginError(f"the kind {name}: models/ has no part {part}")
    return load_part(part)


@cache
def _own_part(place: str, text: str) -> Element:
    """A part that a plugin brings as text, checked."""
    try:
        whole = _whole(text)
        root, sections = ElementTree.fromstring(_checked(whole)), ElementTree.fromstring(whole)
    except Exception as error:
        words = " ".join(str(error).split())[:200]
        raise PluginError(f"{place}: its MJCF cannot be read: {words}") from None
    body = root.find("worldbody/body[@name='robot']")
    if body is None:
        raise PluginError(f'{place}: its MJCF has no <body name="robot"> in its worldbody')
    joints = [(joint.get("name"), joint.get("type")) for joint in body.iter("joint")][:3]
    if body.find("freejoint") is not None or joints != [(axis, "slide") for axis in "xyz"]:
        raise PluginError(
            f"{place}: the body robot begins with the joints x, y and z, of type slide; "
            f"found {', '.join(str(joint) for joint, _ in joints) or 'none'}"
        )
    if body.find("geom[@name='body']") is None:
        raise PluginError(f'{place}: the body robot has no <geom name="body">, its hull, a sphere')
    if wrong := next((each.tag for each in root.iter() if each.tag in REFUSED), None):
        raise PluginError(f"{place}: found <{wrong}>; a body has bodies, geoms and joints")
    beside = (each for each in (*sections, *sections.iterfind("worldbody/*")) if each.get("name") != "robot")
    if wrong := next((each.tag for each in beside if each.tag not in SECTIONS), None):
        raise PluginError(f"{place}: found <{wrong}>; a mission takes the body robot and its motors alone")
    motors = [motor.get("name") for motor in root.iter("motor")]
    if motors != list("xyz"):
        raise PluginError(f"{place}: found the motors {motors}; expected x, y and z")
    return root


def _whole(text: str) -> str:
    """Return MJCF of a robot; a body alone hangs on a mass that slides along each axis."""
    root = ElementTree.fromstring(text)
    if root.tag != "body":
        return text
    mass = ElementTree.fromstring(_written("point_mass"))
    mass.findall("worldbody/body")[0].append(root)
    return ElementTree.tostring(mass, encoding="unicode")


def new_root(part: str, model: str) -> Element:
    """A fresh MJCF tree that starts as a copy of a part, under a model name of its own."""
    root = deepcopy(load_part(part))
    root.set("model", model)
    return root
