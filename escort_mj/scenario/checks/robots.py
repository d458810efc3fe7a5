"""Checks of the team: robots that exist, kinds that can be where they are, motors that kinds have."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import numpy as np

from escort_mj.errors import ScenarioError
from escort_mj.robots import RobotKind
from escort_mj.scenario.checks.mission import laws_of
from escort_mj.scenario.findings import Finding, Path
from escort_mj.scenario.geometry.placement import gravity_of, robot_count
from escort_mj.scenario.geometry.shapes import extent
from escort_mj.scenario.mission import Mission
from escort_mj.scenario.schema.robots import Actuators
from escort_mj.scenario.schema.scenario import Scenario

IN_SPACE = 3  # axes
SHARED = 0.05  # of the lesser height of two bodies: so much of it lies beside the other where they can meet
LONGER = 1.0 + 1e-9  # than a tether: as long, to rounding


def check_team(mission: Mission) -> Iterator[Finding]:
    """As many positions as robots, and overrides of robots that exist."""
    robots, count = mission.scenario.robots, mission.count
    if robots.positions is not None and len(robots.positions) != count:
        yield Finding(
            ("robots", "positions"),
            f"found {len(robots.positions)} positions; expected {count}, as robots.count says",
        )
    if robots.velocities is not None and len(robots.velocities) != count:
        yield Finding(
            ("robots", "velocities"),
            f"found {len(robots.velocities)} velocities; expected {count}, one per robot",
        )
    if robots.positions is not None and robots.placement is not None:
        yield Finding(("robots", "placement"), "found both positions and placement; give one of them")
    first: dict[int, int] = {}
    for index, override in enumerate(robots.overrides):
        path: Path = ("robots", "overrides", index, "robot")
        if override.robot > count:
            yield Finding(path, f"found robot {override.robot}; expected 1 to {count}")
        elif override.robot in first:
            yield Finding(
                path, f"found robot {override.robot} again; overrides[{first[override.robot]}] has it"
            )
        first.setdefault(override.robot, index)


def check_tethers(mission: Mission) -> Iterator[Finding]:
    """Tethers are between two bodies that exist."""
    scenario, count = mission.scenario, mission.count
    for index, tether in enumerate(scenario.robots.tethers):
        path: Path = ("robots", "tethers", index)
        robots = [end for end in tether.between if end != "target"]
        if scenario.axes > IN_SPACE:
            yield Finding(path, f"found in {scenario.axes} axes; tethers are MuJoCo's, in 2 or 3")
        if tether.damping > 0.0 and not tether.pushes:
            words = (
                f"found {tether.damping:g} N s/m of a cable, which may be slack; expected 0, or pushes: true"
            )
            yield Finding((*path, "damping"), words)
        if len(set(tether.between)) < len(tether.between):
            yield Finding((*path, "between"), f"found {tether.between[0]} twice; expected two bodies")
        elif wrong := [robot for robot in robots if robot > count]:
            yield Finding((*path, "between"), f"found robot {wrong[0]}; expected 1 to {count}")
        elif "target" in tether.between and scenario.target is None:
            words = "found target; this mission has none"
            yield Finding((*path, "between"), words, related=(("target",), ("teams",)))


def check_taut(mission: Mission) -> Iterator[Finding]:
    """Tethers that do not stretch are long enough at the start."""
    for index, tether in enumerate(mission.scenario.robots.tethers):
        if tether.stiffness is not None:
            continue
        with suppress(ScenarioError):  # no room for robots, which another check says
            places = [mission.target.position(0.0), *mission.team.position]
            one, other = (places[0 if end == "target" else end] for end in tether.between)
            apart = float(np.linalg.norm(one - other))
            if apart > tether.length * LONGER or (tether.pushes and apart * LONGER < tether.length):
                words = f"found {tether.length:g} m, unstretchable; the two start {apart:.4g} m apart"
                path = ("robots", "tethers", index, "length")
                yield Finding(path, words, related=(("robots", "positions"),))


def check_kinds(mission: Mission) -> Iterator[Finding]:
    """Kinds that have room for all axes, and parameters that fit the robot's body."""
    scenario = mission.scenario
    robots = scenario.robots
    cases: list[tuple[Path, RobotKind, float]] = [(("robots", "kind"), robots.kind, robots.radius)]
    for index, override in enumerate(robots.overrides):
        if override.kind is not None or override.radius is not None:
            kind, radius = override.kind or robots.kind, override.radius or robots.radius
            key = "radius" if override.kind is None else "kind"
            cases.append((("robots", "overrides", index, key), kind, radius))
    for path, kind, radius in cases:
        if scenario.axes > kind.most_axes:
            most = f"expected axes 2 to {kind.most_axes}" if kind.most_axes > 2 else "expected axes 2"
            why = "it rolls on a floor: axes 2" if kind.rolls else most
            yield Finding(path, f"found {kind.kind} in {scenario.axes} axes; {why}")
        yield from (Finding(path, words) for words in kind.misfits(radius))


def check_motors(mission: Mission) -> Iterator[Finding]:
    """One gain for each motor that a robot has, given or drawn, and commands that are obeyed."""
    scenario = mission.scenario
    robots = scenario.robots
    everyone: tuple[Path, Actuators] = (("robots", "actuators"), robots.actuators)
    owners = [everyone] * mission.count
    for index, override in enumerate(robots.overrides):
        if override.actuators is not None:
            owners[override.robot - 1] = ("robots", "overrides", index, "actuators"), override.actuators
    cases = {
        (path, kind.kind): (actuators, kind)
        for (path, actuators), kind in zip(owners, mission.kinds, strict=True)
    }
    for (path, own), limit in zip(owners, _each(scenario, "force_limit"), strict=True):
        if limit is not None and own.dead_zone >= limit:
            words = f"found {own.dead_zone:g} N; expected less than force_limit, {limit:g} N"
            yield Finding((*path, "dead_zone"), words)
            break
    for (path, name), (actuators, kind) in cases.items():
        if actuators.gains is None:
            continue
        if actuators.gain_error > 0.0:
            yield Finding((*path, "gains"), "found both gains and gain_error; give one of them")
        if len(actuators.gains) != kind.motors(scenario.axes):
            yield Finding(
                (*path, "gains"),
                f"found {len(actuators.gains)} gains; expected {kind.motors(scenario.axes)}, one for each "
                f"motor of a {name}",
            )


def check_models(mission: Mission) -> Iterator[Finding]:
    """Robots with actuators of their own are asked for nothing that only the built-in motors have."""
    scenario = mission.scenario
    kinds = mission.kinds
    driven = [robot for robot, kind in enumerate(kinds) if kind.modeled]
    if not driven:
        return
    name = f"robot {driven[0] + 1} is of the kind {kinds[driven[0]].kind}, with actuators of its own"
    if scenario.recording.truth:
        yield Finding(
            ("recording", "truth"), f"found true; {name}, whose mass matrix is not that of its hull"
        )
    for path, law in laws_of(scenario):
        if law.needs_model:
            words = f"found {law.law}, which is given each robot's mass matrix; {name}"
            yield Finding((*path, "law"), words)
    plain = Actuators()
    for robot in driven:
        path, own = _actuators(scenario, robot)
        if own != plain and not kinds[robot].motors(scenario.axes):
            yield Finding(path, f"found errors of motors; servos move robot {robot + 1}")
            break
    for index, failure in enumerate(scenario.robots.failures):
        kind = kinds[failure.robot - 1] if failure.robot <= len(kinds) else None
        if kind is not None and kind.modeled and failure.motors == "obey":
            drive = kind.drive_model(1.0, 0.2)
            if drive is not None and not drive.pushes:
                words = f"found {failure.kind}; servos move robot {failure.robot}, not forces: dead or stuck"
                yield Finding(("robots", "failures", index, "kind"), words)


def _actuators(scenario: Scenario, robot: int) -> tuple[Path, Actuators]:
    """Errors of the motors of a robot, from 0, and where the scenario says them."""
    for index, override in enumerate(scenario.robots.overrides):
        if override.robot == robot + 1 and override.actuators is not None:
            return ("robots", "overrides", index, "actuators"), override.actuators
    return ("robots", "actuators"), scenario.robots.actuators


def check_heights(mission: Mission) -> Iterator[Finding]:
    """Gravity to fly against; and in the plane one height for all, where distances are measured."""
    scenario = mission.scenario
    kinds, gravity = mission.kinds, gravity_of(scenario)
    flying = next((robot for robot, kind in enumerate(kinds) if kind.flies), None)
    if flying is not None and not (gravity[2] < 0.0 and gravity[0] == gravity[1] == 0.0):
        yield Finding(
            ("physics", "gravity"),
            f"found {list(gravity)} m/s^2; robot {flying + 1} is a {kinds[flying].kind}, which hovers "
            "against gravity that pulls straight down",
            related=(_kind_path(scenario, flying),),
        )
    if scenario.axes != 2:
        return
    models = [i for i, kind in enumerate(kinds) if kind.modeled]
    grounded = next((i for i in models if kinds[i].most_axes == 2), None)
    if grounded is not None and flying is not None:
        yield Finding(
            _kind_path(scenario, flying),
            f"robot {flying + 1} flies and robot {grounded + 1} stays on the floor; planar missions happen "
            "at one height",
        )
    pairs = zip(kinds, _each(scenario, "radius"), strict=True)
    heights = [0.0 if kind.stays else kind.height(radius) for kind, radius in pairs]
    high = heights.index(max(heights))
    low = next((i for i, kind in enumerate(kinds) if kind.rolls and heights[i] != heights[high]), None)
    if low is not None:
        yield Finding(
            _kind_path(scenario, high),
            f"robot {high + 1}, a {kinds[high].kind}, is at least {heights[high]:g} m above the floor, and "
            f"robot {low + 1}, a {kinds[low].kind}, rolls at {heights[low]:g} m; planar missions happen at "
            "one height",
        )


def check_spans(mission: Mission) -> Iterator[Finding]:
    """In the plane every two bodies are beside each other: none passes above or below another."""
    scenario = mission.scenario
    if scenario.axes != 2 or any(True for _ in check_heights(mission)):
        return
    height = scenario.robots.height
    spans: list[tuple[str, Path, tuple[float, float]]] = []
    known: dict[tuple[RobotKind, float], tuple[float, float]] = {}
    kinds = mission.kinds
    for robot, pair in enumerate(zip(kinds, _each(scenario, "radius"), strict=True)):
        span = known.setdefault(pair, pair[0].span(pair[1], height))
        spans.append((f"robot {robot + 1}, a {pair[0].kind},", _kind_path(scenario, robot), span))
    if scenario.target is not None:
        radius = scenario.target.radius
        spans.append(("the target", ("target",), (height - radius, height + radius)))
    for body in mission.obstacles:
        low, high = extent(body.solid)
        spans.append((body.name, body.path, (height + float(low[2]), height + float(high[2]))))
    bodies = list({each[2]: each for each in reversed(spans)}.values())
    low, high = np.array([span for *_, span in bodies]).T
    shared = np.minimum.outer(high, high) - np.maximum.outer(low, low)
    apart = np.argwhere(shared < SHARED * np.minimum.outer(high - low, high - low))
    for pair in apart[:1]:
        first, second = sorted(
            (bodies[body] for body in pair), key=lambda each: (each[1][0] != "robots", each[2])
        )
        yield Finding(
            first[1],
            f"{first[0]} can touch something between {first[2][0]:.3g} and {first[2][1]:.3g} m above the "
            f"floor, and {second[0]} between {second[2][0]:.3g} and {second[2][1]:.3g} m: they would pass "
            "without a touch; planar missions happen at one height",
            related=(second[1],),
        )


def check_weights(mission: Mission) -> Iterator[Finding]:
    """In space motors can hold what gravity pulls, unless the scenario itself asks for that gravity."""
    scenario = mission.scenario
    if scenario.axes != 3 or scenario.physics.gravity is not None:
        return
    pull = -gravity_of(scenario)[2]
    masses, limits = _each(scenario, "mass"), _each(scenario, "force_limit")
    for robot, (kind, mass, limit) in enumerate(zip(mission.kinds, masses, limits, strict=True)):
        weight = (mass + kind.burden()) * pull
        if not kind.flies and not kind.driven and limit is not None and weight >= limit:
            yield Finding(
                ("robots", "force_limit"),
                f"robot {robot + 1}, a {kind.kind}, weighs {weight:.3g} N and has motors of {limit:g} N, "
                "which cannot hold it; give a larger force_limit, or physics.gravity",
                related=(_kind_path(scenario, robot),),
            )
            return


def _each(scenario: Scenario, key: str) -> list[Any]:
    """A value of each robot."""
    values = [getattr(scenario.robots, key)] * robot_count(scenario)
    for override in scenario.robots.overrides:
        values[override.robot - 1] = getattr(override, key) or values[override.robot - 1]
    return values


def _kind_path(scenario: Scenario, robot: int) -> Path:
    """Where a scenario says what a robot is, or else how large."""
    for index, override in enumerate(scenario.robots.overrides):
        if override.robot == robot + 1:
            for key in ("radius", "kind"):
                if getattr(override, key) is not None:
                    return ("robots", "overrides", index, key)
    return ("robots", "kind")
