"""The files of a robot's model: MJCF with all that it includes, and the assets that it names."""

from __future__ import annotations

import hashlib
import math
import os
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import NamedTuple
from xml.etree.ElementTree import Element

from escort_mj.errors import OutsideError, RobotError
from escort_mj.recognize import irregular
from escort_mj.robots.modeled import Source
from escort_mj.scenario.findings import did_you_mean, shortened

MOST_TEXT, MOST_ASSET = 5_000_000, 50_000_000  # bytes of MJCF, and of one asset
MOST_DEPTH = 20  # of includes
MOST_NESTED = 100  # elements in each other
MOST_ELEMENTS, MOST_BODIES = 50_000, 2000  # of the text, and of bodies with all that <replicate> repeats
REPEATING = ("replicate", "composite")
LARGEST = 1e10  # mjMAXVAL: a state beyond it is none for MuJoCo
NAMES = ("name", "class", "file")
RANGES = ("range", "ctrlrange", "forcerange", "actrange", "actuatorfrcrange", "actuatorrange")
FOLDERS = {"mesh": "meshdir", "texture": "texturedir", "hfield": "meshdir", "skin": "meshdir"}
FILES = ("file", "fileright", "fileleft", "fileup", "filedown", "filefront", "fileback")
REFUSED = ("plugin", "flexcomp", "flex", "skin", "hfield", "extension", "deformable")
MESHES = (".obj", ".stl")
ONE_MESH = """<mujoco><asset><mesh name="mesh"/></asset>
  <worldbody><geom name="mesh" type="mesh" mesh="mesh"/></worldbody></mujoco>"""
PLACE = "assets"
"""Folder of the assets beside a model that is written."""


class Files(NamedTuple):
    """A robot's model with everything that it needs.

    Attributes:
        root: MJCF without includes; assets name files in `PLACE`.
        assets: Their content, by these names.
        digest: SHA-256 of all of it.
    """

    root: Element
    assets: dict[str, bytes]
    digest: str


def read_files(source: Source) -> Files:
    """Return a model's files.

    Raises:
        RobotError: If one is missing, too large, not what it should be, or outside of the folder.
    """
    name = source.name or source.file
    if source.file:
        file = Path(source.file)
        if file.suffix.lower() in MESHES:
            root = ElementTree.fromstring(ONE_MESH)
            root[0][0].set("file", file.name)
        else:
            root = _parsed(file, _content(file, source, MOST_TEXT, file.name), name)
        _include(root, file.parent, source, (file.resolve(),))
        if found := _excess(root):
            raise RobotError(f"{name}: {found}")
    else:
        file = Path()
        root = _parsed(file, source.text.encode(), name)
    if wrong := next((each for each in root.iter() if each.tag in REFUSED), None):
        raise RobotError(f"{name}: found <{wrong.tag}>; a model has bodies, geoms, joints and actuators")
    assets = _assets(root, file.parent, source)
    digest = hashlib.sha256(ElementTree.tostring(root))
    for each in sorted(assets):
        digest.update(each.encode())
    return Files(root, assets, digest.hexdigest())


def _content(file: Path, source: Source, most: int, written: str) -> bytes:
    """Content of a file of the model."""
    where = source.name or source.file
    if written != where:
        where += f": {shortened(written)}"
    if source.folder and not Path(os.path.realpath(file)).is_relative_to(os.path.realpath(source.folder)):
        raise OutsideError(where, file)
    if kind := irregular(file):
        raise RobotError(f"{where}: is {kind}, not a file")
    try:
        if file.stat().st_size > most:
            size = f"{file.stat().st_size / 1e6:.0f} MB"
            raise RobotError(f"{where}: has {size}; allowed are {most / 1e6:.0f} MB")
        return file.read_bytes()
    except FileNotFoundError:
        beside = [each.name for each in file.parent.glob(f"*{file.suffix}")] if file.parent.is_dir() else []
        guess = did_you_mean(file.name, beside)
        raise RobotError(f"{where}: there is no such file in {shortened(file.parent)}{guess}") from None
    except (OSError, ValueError) as error:
        words = getattr(error, "strerror", None) or error
        raise RobotError(f"{where}: cannot be read: {words}") from None


def _parsed(file: Path, content: bytes, name: str) -> Element:
    """The root of an MJCF file; entities of its own are refused."""
    where = f"{name} ({file.name})" if file.name and not name.endswith(file.name) else name
    if b"<!ENTITY" in content or b"<!DOCTYPE" in content:
        raise RobotError(f"{where}: found a document type; MJCF has none")
    try:
        root = ElementTree.fromstring(content)
    except (ElementTree.ParseError, ValueError, LookupError) as error:  # the last of an unknown encoding
        raise RobotError(f"{where}: this is not XML: {error}") from None
    if found := _excess(root):
        raise RobotError(f"{where}: {found}")
    if root.tag not in ("mujoco", "mujocoinclude"):
        hint = "; URDF is converted by MuJoCo's compiler" if root.tag == "robot" else ""
        raise RobotError(f"{where}: found <{root.tag}>; a model is MJCF, <mujoco>{hint}")
    return root


def _excess(root: Element) -> str:
    """Return what no robot has: too many elements, or a wrong name or number; empty where all is well."""
    left, elements, bodies = [(root, 1, 1)], 0, 0
    while left:
        element, depth, times = left.pop()
        elements += 1
        for key, text in element.items():
            if expected := _expected(key, text):
                wrong = shortened(f'{key}="{text}"')
                return f"found <{element.tag} {wrong}>; expected {expected}"
        bodies += times * (element.tag in ("body", *REPEATING))
        if depth > MOST_NESTED:
            return f"found more than {MOST_NESTED} elements in each other; a model has fewer"
        if elements > MOST_ELEMENTS:
            return f"found more than {MOST_ELEMENTS} elements; a model has fewer"
        if element.tag in REPEATING:
            times *= _repeated(element.get("count", "1"))
            bodies += times
        if bodies > MOST_BODIES:
            return f"found more than {MOST_BODIES} bodies, repeated ones counted; a model has fewer"
        left += [(child, depth + 1, times) for child in element]
    return ""


def _expected(key: str, text: str) -> str:
    """Return what an attribute must be and is not; empty where all is well, or for MuJoCo to say."""
    if key in NAMES:  # MuJoCo writes a line break as it is, which XML reads as a space
        return "a name in one line" if {*text} & {*"\t\n\r"} else ""
    try:
        numbers = [float(word) for word in text.split()[:1000]]
    except ValueError:
        return ""
    if not all(abs(number) <= LARGEST for number in numbers):  # NaN, too
        return f"finite numbers of at most {LARGEST:g}"
    if key in RANGES and len(numbers) == 2 and any(numbers) and numbers[0] >= numbers[1]:
        return "the smaller number first"  # MuJoCo takes it for no range
    return "0 or more" if key in ("density", "viscosity") and min(numbers, default=0.0) < 0.0 else ""


def _repeated(count: str) -> int:
    """Return how often the content of an element is there, by its attribute; 1 where that is no number."""
    words = count.split()[:3]
    return math.prod(int(word) for word in words if word.isascii() and word.isdigit() and len(word) < 10)


def _include(parent: Element, folder: Path, source: Source, files: tuple[Path, ...]) -> None:
    """Put what is included in the place of each include; a file's own paths begin at the main file."""
    for place, child in reversed(list(enumerate(parent))):
        if child.tag != "include":
            _include(child, folder, source, files)
            continue
        name = source.name or source.file
        written = child.get("file", "")
        file = _beside(folder, written, source)
        if file.resolve() in files or len(files) > MOST_DEPTH:
            raise RobotError(f"{name}: {shortened(written)} includes itself")
        included = _parsed(file, _content(file, source, MOST_TEXT, written), name)
        _include(included, folder, source, (*files, file.resolve()))
        parent[place : place + 1] = list(included)


def _beside(folder: Path, written: str, source: Source) -> Path:
    """A file that the model names by a relative path."""
    name = source.name or source.file
    if not source.file:
        raise RobotError(f"{name}: names the file {shortened(written)}; this kind of robot has none")
    if Path(written).is_absolute() or "://" in written:
        raise RobotError(f"{name}: {shortened(written)}: expected a path relative to the file")
    return folder / written


def _assets(root: Element, folder: Path, source: Source) -> dict[str, bytes]:
    """Read all assets; each gets a name of its own and a file name that tells its content."""
    folders: dict[str, str] = {}
    for compiler in root.iter("compiler"):
        for key in ("assetdir", "meshdir", "texturedir"):
            if compiler.get(key) is not None:
                folders[key] = compiler.attrib.pop(key)
        if compiler.attrib.pop("strippath", "false") == "true":
            folders["strippath"] = "true"
    found: dict[str, bytes] = {}
    for section in root.iter("asset"):
        for asset in section:
            if asset.tag == "model":
                name, child = source.name or source.file, shortened(asset.get("file", ""))
                how = "MjSpec.from_file(FILE) of MuJoCo reads both, and its to_xml() writes them as one"
                raise RobotError(f"{name}: attaches the model {child}; expected one model: {how}")
            for key in FILES:
                if (written := asset.get(key)) is None:
                    continue
                if "strippath" in folders:
                    written = Path(written.replace("\\", "/")).name
                inside = folders.get(FOLDERS.get(asset.tag, ""), folders.get("assetdir", ""))
                content = _content(
                    _beside(folder, str(Path(inside) / written), source), source, MOST_ASSET, written
                )
                name, mark = Path(written).name, f"{hashlib.sha256(content).hexdigest()[:12]}_"
                name = name if name.startswith(mark) else mark + name  # a copy is as what it was copied from
                found[f"{PLACE}/{name}"] = content
                asset.set(key, f"{PLACE}/{name}")
                if asset.get("name") is None and key == "file":
                    asset.set("name", Path(written).stem)
    return found
