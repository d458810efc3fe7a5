"""Stands beside a mission with robots from files, and finds distances and touches by MuJoCo alone.

Every physics step is taken by plain MuJoCo, with nothing that watches it: `mj_geomDistance` of all geoms that
can touch tells how near bodies are, MuJoCo's contacts and `mj_contactForce` which of them touch. Only the
world and the law that moves the robots are escort_mj's.

`python -m tests.independent.bystander FIRST COUNT` holds so many drawn missions against the product.
"""

from __future__ import annotations

import json
import re
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj import mission
from escort_mj.errors import EscortError
from escort_mj.scenario import load_file
from escort_mj.scenario.geometry.placement import kinds_of
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import build
from tests.independent.machines import TARGET, Drawn, drawn

Array = NDArray[np.float64]
Pair = tuple[str, str]

SIGHT = 1.5  # surfaces farther apart are known to be so, no more [m]
EXACT = 5e-6  # of distances of shapes without a closed form, found by MuJoCo's iterations in two ways [m]
DEEP = 1e-2  # of the depth of a center inside a shape: MuJoCo is not exact there; flight.py has closed forms
SPHERES = (
    1.0  # clearances at least so large may be those of the spheres around robots, or boxes of shapes [m]
)
FLOOR = "floor"
UNSEEN = "none of its geoms can touch anything"
REASONS = (UNSEEN, "would pass without a touch", "rolls at")
PASSING = re.compile(
    r"(.+?), .*between (\S+) and (\S+) m above the floor, and (.+) between (\S+) and (\S+) m"
)


@dataclass
class Seen:
    """Every physics step of a mission.

    Attributes:
        names: Of the bodies that can touch, the floor left out.
        groups: Group of each, by name.
        times: Of the physics steps, shape (k,) [s].
        places: Controlled points of the robots, shape (k, n, p) [m].
        distances: Of each pair in each step, those beyond `SIGHT` at least, shape (k,) [m].
        touches: Steps in which each pair touches.
        still: Bodies that stand.
        led: Whether the target is put where it is to be.
        fastest: Largest speed of a point of a robot's geoms, from step to step [m/s].
        thinnest: Least extent of a geom [m].
        timestep: [s].
    """

    names: list[str]
    groups: dict[str, str]
    times: Array
    places: Array
    distances: dict[Pair, Array]
    touches: dict[Pair, list[int]]
    still: set[str]
    led: bool
    fastest: float = 0.0
    thinnest: float = np.inf
    timestep: float = 0.0

    def members(self, side: str) -> list[str]:
        """Return the bodies of a group, or the one of that name."""
        return [name for name in self.names if side in (name, self.groups[name])]

    def pairs(self, one: str, other: str) -> set[Pair]:
        """Return the pairs of two sides."""
        order = self.names.index
        found = {
            tuple(sorted((a, b), key=order)) for a in self.members(one) for b in self.members(other) if a != b
        }
        return {pair for pair in found if pair in self.distances}  # type: ignore[misc]

    def inside(self, after: float, before: float | None) -> NDArray[np.bool_]:
        """Return which steps are in a window."""
        end = np.inf if before is None else before
        return (self.times >= after - 1e-9) & (self.times <= end + 1e-9)

    def episodes(self, pair: Pair) -> list[tuple[int, int]]:
        """Return first and last step of each unbroken touch of a pair."""
        steps = self.touches.get(pair, [])
        if self.led and "target" in pair and self.still & set(pair):
            steps = np.flatnonzero(self.distances[pair] < 0.0).tolist()
        found: list[tuple[int, int]] = []
        for step in steps:
            if found and step == found[-1][1] + 1:
                found[-1] = found[-1][0], step
            else:
                found.append((step, step))
        return found


def watch(scenario: Scenario) -> Seen:
    """Fly a scenario step by step, and look."""
    world = build(scenario)
    model = mujoco.MjModel.from_xml_string(world.xml, world.assets)
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    names = [name for name in world.bodies.names[:-1] if name != "target" or scenario.target is not None]
    groups = dict(zip(world.bodies.names, world.bodies.groups, strict=True))
    geoms = _solid(model, names)
    still = {name for name in names if model.body(name).weldid[0] == 0 and groups[name] != "target"}
    led = scenario.target is not None and scenario.target.body is None
    movers = [name for name in names if groups[name] in ("robots", "target")]
    pairs = [pair for pair in combinations(names, 2) if set(pair) & set(movers)]
    steps = round(scenario.duration / scenario.physics.timestep) + 1
    robots = [name for name in names if groups[name] == "robots"]
    times = np.arange(steps) * scenario.physics.timestep
    places = np.empty((steps, len(robots), scenario.axes))
    distances = {pair: np.empty(steps) for pair in pairs}
    rolling = {name for name, kind in zip(robots, kinds_of(scenario), strict=True) if kind.rolls}
    seen = Seen(names, groups, times, places, distances, {}, still, led, timestep=scenario.physics.timestep)
    seen.thinnest = min(2.0 * model.geom_aabb[geom, 3:].min() for each in geoms.values() for geom in each)
    hulls = [model.geom(f"{name}_body").id for name in robots]
    own = [
        geom
        for name, hull in zip(robots, hulls, strict=True)
        if geoms[name] != [hull]
        for geom in geoms[name]
    ]
    before: Array | None = None
    with native_loop(world):
        mujoco.set_mjcb_sensor(None)
        for step in range(steps):
            mujoco.mj_step(model, data)  # leaves geometry, contacts and forces of before the step
            seen.places[step] = data.geom_xpos[hulls][:, : scenario.axes]
            for pair in pairs:
                sides = geoms[pair[0]], geoms[pair[1]]
                flat = rolling.intersection(pair) and _are_spheres(model, *sides)
                seen.distances[pair][step] = (_in_plane if flat else _distance)(model, data, *sides)
            for pair in _touching(model, data, names):
                seen.touches.setdefault(pair, []).append(step)
            tips = _tips(model, data, own)
            if before is not None and len(tips):
                moved = float(np.linalg.norm(tips - before, axis=1).max())
                seen.fastest = max(seen.fastest, moved / seen.timestep)
            before = tips
    return seen


def _solid(model: mujoco.MjModel, names: list[str]) -> dict[str, list[int]]:
    """Geoms of each body that can touch what has one bit, as all but the floor."""
    found: dict[str, list[int]] = {name: [] for name in names}
    for geom in range(model.ngeom):
        root = model.body(model.body_rootid[model.geom_bodyid[geom]]).name
        if root in found and (model.geom_contype[geom] | model.geom_conaffinity[geom]) & 1:
            found[root].append(geom)
    return found


def _distance(model: mujoco.MjModel, data: mujoco.MjData, one: list[int], other: list[int]) -> float:
    """Least distance of two sets of geoms [m]."""
    ways = data.geom_xpos[one][:, None] - data.geom_xpos[other][None]
    around = model.geom_rbound[one][:, None] + model.geom_rbound[other][None]
    apart = np.sqrt((ways * ways).sum(axis=2)) - around
    least, ends = np.inf, np.zeros(6)
    for place in np.argsort(apart, axis=None):
        a, b = divmod(int(place), len(other))
        if apart[a, b] >= least:
            break
        if apart[a, b] >= SIGHT:
            return float(min(least, apart[a, b]))
        least = min(least, mujoco.mj_geomDistance(model, data, one[a], other[b], 100.0, ends))
    return float(least)


def _are_spheres(model: mujoco.MjModel, one: list[int], other: list[int]) -> bool:
    return (
        len(one) == len(other) == 1 and (model.geom_type[one + other] == mujoco.mjtGeom.mjGEOM_SPHERE).all()
    )


def _in_plane(model: mujoco.MjModel, data: mujoco.MjData, one: list[int], other: list[int]) -> float:
    """Distance of two spheres in the mission's plane: those that roll sink into the floor, and tip [m]."""
    apart = float(np.linalg.norm((data.geom_xpos[one[0]] - data.geom_xpos[other[0]])[:2]))
    return apart - float(model.geom_size[one[0], 0] + model.geom_size[other[0], 0])


def _touching(model: mujoco.MjModel, data: mujoco.MjData, names: list[str]) -> set[Pair]:
    """Pairs whose surfaces meet, or between which a force acts."""
    found, force = set(), np.zeros(6)
    for number in range(data.ncon):
        contact = data.contact[number]
        roots = [model.body(model.body_rootid[model.geom_bodyid[geom]]).name for geom in contact.geom]
        if roots[0] == roots[1] or any(root not in names for root in roots):
            continue
        mujoco.mj_contactForce(model, data, number, force)
        if contact.dist <= 0.0 or force[0] > 0.0:
            found.add(tuple(sorted(roots, key=names.index)))
    return found  # type: ignore[return-value]


def _tips(model: mujoco.MjModel, data: mujoco.MjData, geoms: list[int]) -> Array:
    """Middle and six points of the surface of each geom, shape (k, 3) [m]."""
    found = []
    for geom in geoms:
        box, turn = model.geom_aabb[geom], data.geom_xmat[geom].reshape(3, 3)
        ways = box[:3] + np.vstack([np.zeros(3), np.diag(box[3:]), -np.diag(box[3:])])
        if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH:
            mesh = model.geom_dataid[geom]
            first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
            ways = model.mesh_vert[first : first + count].astype(float)
        found.append(ways @ turn.T + data.geom_xpos[geom])
    return np.vstack(found) if found else np.zeros((0, 3))


def differences(one: Drawn, folder: Path) -> Iterator[str]:
    """Yield where the product's word on a mission differs from what was seen; of a refusal, if untrue.

    Args:
        one: The mission.
        folder: For its files.
    """
    path = one.write(folder)
    try:
        scenario = load_file(path)
    except EscortError as error:
        yield from _untrue(one, str(error))
        return
    run, seen = mission.fly(scenario), watch(scenario)
    trace = run.trace
    if run.outcome.value != "completed":
        yield f"ended as {run.outcome.value}: {run.message}"
        return
    rows = np.rint(trace["time"].values / seen.timestep).astype(int)
    off = np.abs(seen.places[rows] - trace["q"].values).max()
    if off > 1e-9:
        yield f"robots are {off:.3g} m off where the trace has them"
    yield from _clearances(trace, seen, rows, scenario.axes == 2)
    yield from _episodes(trace, seen)
    yield from _verdicts(run, scenario, seen)
    wanted = seen.fastest * seen.timestep / seen.thinnest
    tunneling = next(m for name, m in run.metrics.items() if name == "tunneling")["value"]
    if tunneling < 0.98 * wanted:
        yield f"tunneling {tunneling:.4g}; a point of a robot alone moves {wanted:.4g} thicknesses a step"


def _clearances(trace: Any, seen: Seen, rows: NDArray[np.int64], planar: bool) -> Iterator[str]:
    """Yield samples whose clearances are wrong."""
    columns = [str(group) for group in trace["group"].values]
    robots = [name for name in seen.names if seen.groups[name] == "robots"]
    first = np.concatenate([[0], rows[:-1] + 1])
    watched = [(name, trace["clearance"].values[:, i]) for i, name in enumerate(robots)]
    if "target" in seen.names:
        watched.append(("target", trace["target_clearance"].values))
    for name, values in watched:
        for column, group in enumerate(columns):
            pairs = seen.pairs(name, group) if group in {*seen.groups.values(), *seen.names} else set()
            if not pairs or (name == "target" and group == "target"):
                continue
            true = np.minimum.reduce([seen.distances[pair] for pair in pairs])
            for sample, (begin, end) in enumerate(zip(first, rows, strict=True)):
                found, least = float(values[sample, column]), float(true[begin : end + 1].min())
                exact = found < SPHERES and abs(found - least) <= EXACT
                if name == "target" and group != "robots" and least < 0.0:
                    deeper = found <= least + EXACT  # the way out of a shape leads along the plane
                    inside = least < -TARGET and abs(found - least) < DEEP * -least
                    exact = exact or inside or (planar and deeper)
                beyond = found >= SPHERES and least >= min(found - EXACT, SIGHT)
                if not exact and not beyond:
                    at = seen.times[end]
                    yield f"clearance of {name} to {group} at {at:.3f} s: {found:.7f} m, seen {least:.7f} m"
                    break


def _episodes(trace: Any, seen: Seen) -> Iterator[str]:
    """Yield pairs whose touches are wrong."""
    bodies, theirs = trace["body"].values, {}
    numbers = [trace[f"episode_{name}"].values for name in ("first", "second", "start", "end")]
    for a, b, start, end in zip(*numbers, strict=True):
        pair = str(bodies[a]), str(bodies[b])
        if FLOOR not in pair:
            step = round(start / seen.timestep), round(end / seen.timestep) - 1
            theirs.setdefault(pair, []).append(step)
    for pair in seen.distances:
        mine, found = seen.episodes(pair), sorted(theirs.get(pair, []))
        if mine != found:
            yield f"touches of {pair[0]} and {pair[1]}: {found[:4]}, seen {mine[:4]}"


def _verdicts(run: Any, scenario: Scenario, seen: Seen) -> Iterator[str]:
    """Yield expectations that are judged otherwise than what was seen says."""
    for place, one in enumerate(scenario.expect):
        verdict = next(each for each in run.verdicts if each.expectation == place)
        keys = one.model_dump()
        window = seen.inside(float(keys.get("after") or 0.0), keys.get("before"))
        sides = keys.get("clearance") or keys.get("contacts")
        metric = keys.get("metric")
        if sides is None and metric != "contacts":
            sides = ("robots", "robots" if metric == "robot_clearance_min" else "obstacles")
        if "clearance" in keys or (metric is not None and metric != "contacts"):
            least = min(float(seen.distances[pair][window].min()) for pair in seen.pairs(*sides))
            if abs(least - keys["at_least"]) > EXACT and verdict.held != (least >= keys["at_least"]):
                yield f"{verdict.metric} {verdict.demanded}: {verdict.message}; seen {least:.7f} m"
            continue
        pairs = set(seen.distances) if sides in (None, "none", "any") else seen.pairs(*sides)
        count = sum(window[first : last + 1].any() for pair in pairs for first, last in seen.episodes(pair))
        if verdict.held != (count <= (keys.get("at_most") or 0)):
            yield f"{verdict.metric} {verdict.demanded}: {verdict.message}; seen {count}"


def _untrue(one: Drawn, message: str) -> Iterator[str]:
    """Yield a refusal that is not true of what was drawn."""
    if UNSEEN in message:
        name = next(name for name in one.files if name in message)
        model = mujoco.MjModel.from_xml_string(one.files[name])
        if (model.geom_contype | model.geom_conaffinity).any():
            yield f"refused: {message}"
        return
    if "rolls at" in message:  # what rises by itself hovers, what rolls cannot
        kinds = json.dumps(one.keys["robots"])
        if not any('name="z"' in text for text in one.files.values()) or not re.search(
            "rolling|drive", kinds
        ):
            yield f"refused: {message}"
        return
    found = PASSING.search(message.rpartition(": robot")[2])
    if found is None:
        yield f"refused: {message}"
        return
    low, high, other_low, other_high = (float(found.group(k)) for k in (2, 3, 5, 6))
    shared = min(high, other_high) - max(low, other_low)
    if shared > 0.06 * min(high - low, other_high - other_low):
        yield f"refused: {message}"
    yield from _other_spans(one, message, [(low, high), (other_low, other_high)])


def _other_spans(one: Drawn, message: str, spans: list[tuple[float, float]]) -> Iterator[str]:
    """Yield that a robot that cannot rise is not where a refusal says: MuJoCo tells of its file alone."""
    known = []
    for text in one.files.values():
        model = mujoco.MjModel.from_xml_string(text)
        data = mujoco.MjData(model)
        if model.nkey:
            mujoco.mj_resetDataKeyframe(model, data, 0)
        mujoco.mj_forward(model, data)
        solid = np.flatnonzero(model.geom_contype | model.geom_conaffinity)
        low, high = _vertical(model, data, solid)
        known.append((low + max(-low, 0.0), high + max(-low, 0.0)))
    told = [span for span in spans if any(np.allclose(span, each, atol=6e-3) for each in known)]
    rising = any('name="z"' in text for text in one.files.values())
    if not told and not rising:
        yield f"refused: {message}; the files' robots reach over {known}"


def _vertical(model: mujoco.MjModel, data: mujoco.MjData, geoms: NDArray[np.int64]) -> tuple[float, float]:
    """Lowest and highest point of geoms, each found by a plane far below or above [m]."""
    ends = []
    for side in (-1.0, 1.0):
        best = -np.inf
        for geom in geoms:
            up = side * data.geom_xmat[geom].reshape(3, 3)[2]
            center, size = side * data.geom_xpos[geom][2], model.geom_size[geom]
            kind = mujoco.mjtGeom(model.geom_type[geom]).name.removeprefix("mjGEOM_").lower()
            if kind == "mesh":
                mesh = model.geom_dataid[geom]
                first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
                reach = float((model.mesh_vert[first : first + count] @ up).max())
            else:
                reach = {
                    "sphere": size[0],
                    "capsule": size[0] + size[1] * abs(up[2]),
                    "cylinder": size[0] * np.hypot(up[0], up[1]) + size[1] * abs(up[2]),
                    "box": float(np.abs(up) @ size),
                    "ellipsoid": float(np.linalg.norm(up * size)),
                }[kind]
            best = max(best, center + reach)
        ends.append(side * best)
    return ends[0], ends[1]


def compared(seed: int) -> list[str]:
    """Return the differences in the mission of a seed."""
    with tempfile.TemporaryDirectory() as folder:
        return list(differences(drawn(seed), Path(folder)))


def main(first: int, count: int) -> int:
    """Compare so many missions from a seed on, and print what differs."""
    tally: Counter[str] = Counter()
    for seed in range(first, first + count):
        with tempfile.TemporaryDirectory() as folder:
            one = drawn(seed)
            found = list(differences(one, Path(folder)))
            try:
                load_file(Path(folder) / "drawn.yaml")
                tally["flown"] += 1
            except EscortError as error:
                tally["refused: " + next((why for why in REASONS if why in str(error)), str(error))] += 1
        tally["with differences"] += bool(found)
        print(seed, *found or ["as seen"], sep=": ", flush=True)
    print(", ".join(f"{name} {number}" for name, number in tally.items()), f"of {count}")
    return int(tally["with differences"] > 0)


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]), int(sys.argv[2])))
