"""What `docs/avoidance.md` promises of set_based, from positions and velocities alone, body by body.

Nothing is left out because it is far, slow or unlikely to matter, and nothing of the product is used: one
half plane r . v >= b for each body that a robot sees or hears, from the sentences of that page.
"""

from dataclasses import dataclass

import numpy as np

Array = np.ndarray


@dataclass
class World:
    """Everything that robots keep clear of.

    Attributes:
        q, v: Robots, shape (n, p) [m], [m/s].
        radius: Of the robots, shape (n,) [m].
        lost: Whether each has failed, shape (n,).
        team: Which team each is of, shape (n,).
        frame: Velocity of the target that each follows, shape (n, p); 0 for robots with goals [m/s].
        bodies: Position, velocity and radius of each obstacle.
        target: Position, velocity and radius of the target; None without one.
        safe, mates, target_distance: Distances to keep, surface to surface [m].
        rate, braking: Of `approach` [1/s], [m/s^2].
        most: Speed limit [m/s].
        sight: How far robots see, surface to surface [m].
        heard: By robot and teammate, where this is at most how far from where, and the velocity that it
            sent; None where teammates are seen.
    """

    q: Array
    v: Array
    radius: Array
    lost: Array
    team: Array
    frame: Array
    bodies: list[tuple[Array, Array, float]]
    target: tuple[Array, Array, float] | None
    safe: float
    mates: float
    target_distance: float
    rate: float
    braking: float
    most: float
    sight: float
    heard: dict[tuple[int, int], tuple[Array, float, Array]] | None = None


@dataclass
class Condition:
    """r . v >= b for one body.

    Attributes:
        r: Unit vector away from the body.
        b: [m/s].
        mate: Whether it is a teammate that has not failed.
        who: For messages.
        outrun: Velocity of a body that is too fast to be outrun, whose path is kept clear of; else None.
    """

    r: Array
    b: float
    mate: bool
    who: str
    outrun: Array | None = None


def approach(margin: float, world: World) -> float:
    """Return the largest closing speed at a margin."""
    near = world.braking / world.rate**2
    if margin <= near:
        return world.rate * margin
    return float(np.sqrt(world.braking * (2.0 * margin - near)))


def conditions(i: int, world: World) -> list[Condition]:
    """Return every condition on robot i's velocity."""
    found = []
    for j in range(len(world.q)):
        if j == i:
            continue
        away, distance = _from(world.q[i], world.q[j])
        gap, velocity = distance - world.radius[i] - world.radius[j], world.v[j]
        who = f"robot {i + 1} of robot {j + 1}"
        if world.lost[j]:
            safe = max(world.safe, world.mates if world.heard is None else 0.0)
            if gap <= world.sight:
                found.append(_single(world.q[i] - world.q[j], gap, safe, velocity, world, f"failed: {who}"))
            continue
        if world.heard is None and gap > world.sight:
            continue
        if world.heard is not None:
            if (i, j) not in world.heard:
                continue
            place, ball, velocity = world.heard[i, j]
            away, distance = _from(world.q[i], place)
            gap = distance - ball - world.radius[i] - world.radius[j]
        allowed = approach(gap - world.mates, world)
        shared = 0.5 * (world.frame[i] + world.frame[j])
        b = max(away @ shared - 0.5 * allowed, away @ velocity - allowed)
        found.append(Condition(away, float(b), True, who))
    for number, (place, velocity, radius) in enumerate(world.bodies):
        gap = _from(world.q[i], place)[1] - world.radius[i] - radius
        if gap <= world.sight:
            who = f"robot {i + 1} of body {number}"
            found.append(_single(world.q[i] - place, gap, world.safe, velocity, world, who))
    if world.target is not None and world.target_distance > 0.0:
        place, velocity, radius = world.target
        gap = _from(world.q[i], place)[1] - world.radius[i] - radius
        who = f"robot {i + 1} of the target"
        found.append(_single(world.q[i] - place, gap, world.target_distance, velocity, world, who))
    return found


def _single(x: Array, gap: float, safe: float, u: Array, world: World, who: str) -> Condition:
    """Return the condition of a body that does not avoid anything."""
    away = x / np.linalg.norm(x)
    outrun = np.linalg.norm(u) > 1.001 * world.most and away @ u > 0.0
    b = float(away @ u) - approach(gap - safe, world)
    return Condition(away, b, False, who, u if outrun else None)


def _from(q: Array, place: Array) -> tuple[Array, float]:
    distance = float(np.linalg.norm(q - place))
    return (q - place) / distance, distance
