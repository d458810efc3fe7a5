"""From an MJCF tree to a MuJoCo model that carries its addresses: where the compiler has put what."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from xml.etree.ElementTree import Element

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj.errors import Fault, PluginError, ScenarioError
from escort_mj.mjcf import section, set_attributes
from escort_mj.scenario.geometry.placement import Placement, gravity_of
from escort_mj.scenario.mission import Mission
from escort_mj.world.loop.addresses import Counts, addresses_size, faces_of, find_addresses
from escort_mj.world.model.robots import add_start
from escort_mj.world.model.touching import Solids, parts_of
from escort_mj.world.stages import Stage

PAIR = 8  # bytes that MuJoCo takes for each pair of bodies: in the search for pairs and in its result
MOST_NUMBERS = 500  # that MuJoCo's reader takes in one element


def compile_addressed(
    tree: Element, mission: Mission, stages: Sequence[Stage], assets: dict[str, bytes], solids: Solids
) -> mujoco.MjModel:
    """Compile a tree into a model that carries its addresses.

    What is found only in a compiled model is written into it, and into the tree: to compile again would
    double the time. Only what does not start at rest, or is more than the tree shows, is compiled again.

    Args:
        tree: MJCF tree without addresses and start; receives both.
        mission: The mission.
        stages: Where the axes of the mission are.
        assets: Files that the tree names.
        solids: What of the robots can touch others.

    Raises:
        PluginError: If MuJoCo refuses a body that a plugin brings.
    """
    robots, gravity, names = mission.team, gravity_of(mission.scenario), mission.bodies.names
    geoms = sum(1 for _ in section(tree, "worldbody").iter("geom"))
    faces = faces_of(mission.obstacles)
    axes = sum(len(stage.directions) for stage in stages)
    counts = Counts(len(mission.setup.movers), geoms, len(faces), solids.geoms, solids.limbs)
    room = np.zeros(addresses_size(robots, axes, names, counts))
    elements = add_numbers(tree, "escort_addresses", room)
    model = _first_compiled(tree, robots, assets)
    parts = parts_of(model, robots, solids)
    addresses = _normal(find_addresses(model, robots, gravity, stages, names, faces, parts))
    for element in elements:
        section(tree, "custom").remove(element)
    add_numbers(tree, "escort_addresses", addresses)
    more = [add_start(tree, model, robots, gravity), _add_memory(tree, model), len(addresses) != len(room)]
    if any(more):
        return _compiled(tree, assets)
    model.numeric_data[-len(addresses) :] = addresses
    return model


def _compiled(tree: Element, assets: dict[str, bytes]) -> mujoco.MjModel:
    """The model of a tree, without its textures: to make them takes longer than all the rest.

    Raises:
        ScenarioError: If MuJoCo refuses it, as numbers that its reader does not take.
    """
    named = section(tree, "asset")
    place = list(tree).index(named)
    bare = Element("asset")
    for element in named:
        if element.get("texture") or len(element):
            element = Element(
                element.tag, {key: element.attrib[key] for key in element.keys() if key != "texture"}
            )
        if element.tag != "texture":
            bare.append(element)
    tree[place] = bare
    try:
        return mujoco.MjModel.from_xml_string(ElementTree.tostring(tree, "unicode"), assets)
    except ValueError as error:
        words = " ".join(str(error).split())
        raise ScenarioError([Fault(f"MuJoCo refuses the world: {words}")]) from None
    finally:
        tree[place] = named


def _first_compiled(tree: Element, robots: Placement, assets: dict[str, bytes]) -> mujoco.MjModel:
    """The same, the first time.

    Raises:
        PluginError: If MuJoCo refuses a body that a plugin brings.
    """
    try:
        return _compiled(tree, assets)
    except ScenarioError as error:
        own = next((kind.kind for kind in robots.kind if kind.mjcf), None)
        if own is None:
            raise
        words = str(error).replace("refuses the world", "refuses its body")
        raise PluginError(f"the kind {own}: {words}") from None


def _add_memory(tree: Element, model: mujoco.MjModel) -> bool:
    """Enlarge MuJoCo's memory where pairs of bodies take more than a quarter of it; whether that was so.

    MuJoCo ends a step by an error where its memory is too small, and its own guess knows contacts only.
    """
    pairs = PAIR * model.nbody * (model.nbody - 1) // 2
    if 4 * pairs <= model.narena:
        return False
    set_attributes(section(tree, "size"), memory=f"{(model.narena + pairs) // 1024 + 1}K")
    return True


def add_numbers(tree: Element, name: str, numbers: NDArray[np.float64]) -> list[Element]:
    """Add numbers to what the model carries; MuJoCo reads few at once, and keeps all one behind another.

    Args:
        tree: MJCF tree that receives them.
        name: Of the numbers.
        numbers: What is carried; those too small for MuJoCo's reader become 0.

    Returns:
        The elements that carry them.
    """
    numbers, elements = _normal(numbers), []
    for part, first in enumerate(range(0, len(numbers), MOST_NUMBERS), 1):
        elements.append(ElementTree.SubElement(section(tree, "custom"), "numeric", name=f"{name}_{part}"))
        set_attributes(elements[-1], data=numbers[first : first + MOST_NUMBERS])
    return elements


def _normal(numbers: NDArray[np.float64]) -> NDArray[np.float64]:
    """Numbers too small to be normal as none: MuJoCo's reader refuses them."""
    return np.where(np.abs(numbers) < np.finfo(float).tiny, 0.0 * numbers, numbers)
