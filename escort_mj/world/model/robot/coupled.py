"""What couples a robot to bodies that are no part of it: a payload that is welded on, a tether, a mocap body.

A mission copies one tree of bodies of a file. To leave out what holds a payload would let the robot move
without its mass, so such a file is refused.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from xml.etree.ElementTree import Element

import mujoco

from escort_mj.errors import RobotError
from escort_mj.world.model.robot.flat import NAMED

Named = tuple[str, str]
"""Kind of a thing of a model, and its name."""
KINDS = {"jointinparent": "joint", "objname": "objtype", "refname": "reftype", "target": "body"}
SITES = ("cranksite", "slidersite", "sidesite", "refsite")
HOLDING = ("weld", "connect")
ENDS = ("body1", "body2", "site1", "site2")
WORLD = "the world"
CALLED = {
    "spatial": "tendon",
    "fixed": "tendon",
    "joint": "coupling of joints",
    "tendon": "coupling of tendons",
}


def kind_of(tag: str) -> str:
    """Return of which kind a thing is, by its tag or its section: names are unique within a kind."""
    return {"freejoint": "joint", "worldbody": "body"}.get(tag, tag)


def references(element: Element) -> Iterator[Named]:
    """Yield all that an element of a section names, but for itself."""
    for each in element.iter():
        for key, value in each.items():
            if key not in NAMED or key == "name":
                continue
            kind = "site" if key in SITES else KINDS.get(key, key.rstrip("12"))
            if kind in ("objtype", "reftype"):
                kind = each.get(kind, "body")
            yield ("body" if kind == "xbody" else kind), value


def check_coupled(tree: Element, root: Element, own: set[Named], model: mujoco.MjModel, name: str) -> None:
    """Look for what couples the robot to something else.

    Args:
        tree: The whole file.
        root: The robot's outermost body.
        own: All that it holds.
        model: The file, compiled.
        name: What messages call it.

    Raises:
        RobotError: If there is such a thing.
    """
    robot = root.get("name", "")
    outer = dict.fromkeys(own, robot)
    for body in tree.iterfind("worldbody/body"):
        for each in body.iter():
            outer.setdefault((kind_of(each.tag), each.get("name", "")), body.get("name", ""))
    tied: dict[str, str] = {robot: ""}  # each body, and by what
    couplings = list(_couplings(tree, outer))
    while grown := [one for one in couplings if not one[1].isdisjoint(tied) and not one[1] <= tied.keys()]:
        for called, bodies in grown:
            tied |= {body: called for body in sorted(bodies) if body not in tied}
    del tied[robot]
    if not tied:
        return
    said = [
        f"{called} ties it to {WORLD if body == WORLD else f'{body} ({_mass(model, body):.4g} kg)'}"
        for body, called in tied.items()
    ]
    cure = "make what the robot carries a body in it, or take the coupling out"
    raise RobotError(
        f"{name}: {'; '.join(said)}. A mission takes the body {robot} with all in it and nothing else: {cure}"
    )


def _couplings(tree: Element, outer: Mapping[Named, str]) -> Iterator[tuple[str, set[str]]]:
    """Yield everything that couples bodies: what it is called, and their outermost bodies."""
    for element in (*tree.iterfind("equality/*"), *tree.iterfind("tendon/*")):
        if element.get("active") == "false":
            continue
        bodies = {outer.get(each, WORLD) for each in references(element) if each[0] != "tendon"}
        if element.tag in HOLDING and sum(key in ENDS for key in element.attrib) < 2:
            bodies.add(WORLD)
        yield f"the {CALLED.get(element.tag, element.tag)} {element.get('name', '')}".strip(), bodies


def _mass(model: mujoco.MjModel, body: str) -> float:
    """The mass of a body with all that is in it [kg]."""
    return float(model.body(body).subtreemass[0])
