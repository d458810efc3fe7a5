"""Which geoms of a world can touch, and which pairs of bodies: worked out in one place for all who judge.

A mission's bodies bear one bit of MuJoCo's masks, the floor another (`robot/flat.py`, `models/`). Two geoms
can touch where `contype` of one and `conaffinity` of the other share a bit, their bodies are not excluded
from each other, and not both stand: MuJoCo lets what is led meet nothing that stands. Touches of a led target
with these are found by geometry (`monitor/contacts.py`); any other pair that cannot touch is an error.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations_with_replacement
from typing import NamedTuple
from xml.etree.ElementTree import Element

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj.errors import Fault, ScenarioError
from escort_mj.mjcf import section
from escort_mj.scenario.geometry.bodies import Bodies
from escort_mj.scenario.geometry.placement import Placement
from escort_mj.world.loop.addresses import geom_bodies
from escort_mj.world.model.robot.effects import found_too_deep
from escort_mj.world.model.robot.flat import BITS, FLOOR_BITS

Masks = frozenset[tuple[int, int]]


class Solids(NamedTuple):
    """What of the robots can touch other bodies than the floor.

    Attributes:
        several: Whether a robot is more than its hull, the sphere around what the law controls, shape (n,).
        limbs: Number of bodies of such robots with geoms that can touch; 0 where there are none.
        geoms: Number of geoms of all robots that can touch; 0 where all robots are their hulls.
    """

    several: tuple[bool, ...]
    limbs: int = 0
    geoms: int = 0

    @property
    def any(self) -> bool:
        """Whether there are such robots."""
        return any(self.several)


def solids_of(tree: Element, robots: int) -> Solids:
    """Return what of the robots in an MJCF tree can touch other bodies than the floor.

    Args:
        tree: MJCF tree with a body `robot_1` ... for each robot, defaults written out.
        robots: Number of robots.
    """
    bodies = {body.get("name"): body for body in section(tree, "worldbody") if body.tag == "body"}
    several, limbs, geoms = [], 0, 0
    for i in range(1, robots + 1):
        root = bodies[f"robot_{i}"]
        solid = {
            body: [geom for geom in body.findall("geom") if _touches(geom)] for body in root.iter("body")
        }
        found = [geom for each in solid.values() for geom in each]
        several.append(bool(found) and [geom.get("name") for geom in found] != [f"robot_{i}_body"])
        limbs += several[-1] * sum(bool(each) for each in solid.values())
        geoms += len(found)
    return Solids(tuple(several), limbs, geoms) if any(several) else Solids(tuple(several))


def _touches(geom: Element) -> bool:
    return bool((int(geom.get("contype", "1")) | int(geom.get("conaffinity", "1"))) & BITS)


def check_pairs(model: mujoco.MjModel, bodies: Bodies, kinds: Sequence[str]) -> None:
    """Make sure that every two bodies of a mission can touch, or that geometry tells of their touches.

    Args:
        model: A compiled world of at most three axes.
        bodies: Robots, target, obstacles and walls, and the floor last.
        kinds: Kind of each robot, for messages.

    Raises:
        ScenarioError: If a robot and another body would pass through each other, or be inside each other
            before that is found.
    """
    masks, names = _masks(model, bodies.names), bodies.names[:-1]
    first: dict[Masks, list[int]] = {}
    for body in range(len(names)):
        if masks[body]:
            same = first.setdefault(masks[body], [])
            if len(same) < 2:
                same.append(body)
    for one, other in combinations_with_replacement(first, 2):
        if _meet(one, other):
            continue
        pair = first[one][:2] if one is other else [first[one][0], first[other][0]]
        if len(pair) == 2 and min(pair) < len(kinds):
            raise ScenarioError([_apart(names, kinds, *sorted(pair))])
    for robot in range(len(kinds)):
        if not masks[robot] or any(not (a | b) & FLOOR_BITS for a, b in masks[robot]):
            raise ScenarioError([_apart(names, kinds, robot, None)])
    owner, solid = geom_bodies(model, names[: len(kinds)]), (model.geom_contype | model.geom_conaffinity) > 0
    for geom in np.flatnonzero((owner >= 0) & solid & ((model.geom_margin < 0.0) | (model.geom_gap != 0.0))):
        if deep := found_too_deep(model, int(geom)):
            robot = int(owner[geom])
            raise ScenarioError([Fault(f"robot {robot + 1}, a {kinds[robot]}: {deep}", "robots.kind")])
    roots = {model.body(name).id: place for place, name in enumerate(names) if masks[place]}
    for signature in model.exclude_signature:
        ends = [roots.get(int(model.body_rootid[body])) for body in divmod(int(signature), 1 << 16)]
        if None not in ends and ends[0] != ends[1]:
            low, high = sorted(end for end in ends if end is not None)
            raise ScenarioError([_apart(names, kinds, low, high)])


def _meet(one: Masks, other: Masks) -> bool:
    """Whether bodies can touch: with all geoms of theirs that are to touch more than the floor."""
    pairs = [((a & d) | (c & b), (a | b) & (c | d) & BITS) for a, b in one for c, d in other]
    return any(meets for meets, _ in pairs) and all(meets for meets, asked in pairs if asked)


def _masks(model: mujoco.MjModel, names: Sequence[str]) -> list[Masks]:
    """`contype` and `conaffinity` of the geoms of each body that can touch anything."""
    found: list[set[tuple[int, int]]] = [set() for _ in names]
    for geom, body in enumerate(geom_bodies(model, names)):
        bits = int(model.geom_contype[geom]), int(model.geom_conaffinity[geom])
        if body >= 0 and any(bits):
            found[body].add(bits)
    return [frozenset(each) for each in found]


def _apart(names: Sequence[str], kinds: Sequence[str], robot: int, other: int | None) -> Fault:
    what = "cannot touch " + names[other] if other is not None else "has geoms that cannot touch anything"
    return Fault(
        f"robot {robot + 1}, a {kinds[robot]}, {what}: the masks contype and conaffinity of "
        f"their geoms share no bit; a body that can be touched has contype {BITS} and conaffinity {BITS}",
        "robots.kind",
    )


def parts_of(model: mujoco.MjModel, team: Placement, solids: Solids) -> dict[str, NDArray[np.float64]]:
    """Return what of the robots can touch, as the loop reads it, see `Addresses`."""
    geoms: list[int] = []
    limbs: list[tuple[float, ...]] = []
    spans = []
    solid = ((model.geom_contype | model.geom_conaffinity) & BITS) > 0
    roots = model.body_rootid[model.geom_bodyid]
    for i in range(len(team.mass) if solids.any else 0):
        root = model.body(f"robot_{i + 1}").id
        own = np.flatnonzero(solid & (roots == root))
        spans.append((len(geoms), len(own), _reach(team, i) if solids.several[i] else team.radius[i]))
        geoms += own.tolist()
        for body in np.unique(model.geom_bodyid[own]) if solids.several[i] else ():
            here = own[model.geom_bodyid[own] == body]
            ways = np.linalg.norm(model.geom_pos[here] - model.body_ipos[body], axis=1)
            limbs.append((i, body, root, float((ways + model.geom_rbound[here]).max())))
    return {
        "part_span": np.array(spans, float).reshape(-1, 3),
        "parts": np.array(geoms, float),
        "limbs": np.array(limbs, float).reshape(-1, 4),
    }


def _reach(team: Placement, robot: int) -> float:
    """Radius of the sphere around what the law controls that a robot never leaves [m]; -1 for none."""
    model = team.model(robot)
    return model.reach if model is not None and math.isfinite(model.reach) else -1.0
