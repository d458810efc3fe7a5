"""How fast a robot may come nearer to a body, and how it lets one pass that it cannot outrun."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.behaviors.avoid_obstacles import POLAR
from escort_mj.behaviors.behavior import Avoidance
from escort_mj.native.kernels import inlined
from escort_mj.native.lanes import Lanes, where
from escort_mj.native.vectors import Vec, dot, norm, turned, unit_of

Array = NDArray[np.float64]

OUTRUNS = 1.001  # times the speed limit: a body that goes as fast as that is outrun, whatever rounding says
HEAD_ON = 1e-9  # share of a distance that is no offset to either side


class Rules(NamedTuple):
    """How fast a robot may come nearer to what it keeps clear of: r . (v - u) >= -approach(margin).

    Attributes:
        rate: Share of the margin that may be used up, or is recovered, per second [1/s].
        braking: Deceleration that ends at the safe distance [m/s^2]; UNLIMITED for any.
        cone: Whether there is a constraint only within the safe distance (1 or 0).
        foresees: Whether the velocity u of what is met counts (1 or 0).
        target_distance: Safe distance to the target [m]; 0 where it is not avoided.
        target_radius: [m].
    """

    rate: float
    braking: float
    cone: float
    foresees: float
    target_distance: float
    target_radius: float


class Clearance(NamedTuple):
    """What distances a robot keeps, and how fast it may come nearer.

    Attributes:
        level: Which one avoidance is.
        avoid: Its parameters.
        rules: How fast the robot may come nearer.
    """

    level: int
    avoid: Avoidance
    rules: Rules


@inlined
def approach(margin: float, rules: Rules) -> float:
    """Return the largest closing speed at a margin: proportional, then as far as braking stops in time [m/s].

    Both parts meet with one slope. Within the safe distance it is negative: the distance has to grow.
    """
    if rules.rate * rules.rate * margin <= rules.braking:
        return rules.rate * margin
    return math.sqrt(rules.braking * (2.0 * margin - rules.braking / (rules.rate * rules.rate)))


@inlined
def horizon(speed: float, rules: Rules) -> float:
    """Return the margin at which `approach` allows a speed [m]."""
    if rules.cone != 0.0:
        return 0.0
    if speed * rules.rate <= rules.braking:
        return speed / rules.rate
    return 0.5 * (speed * speed / rules.braking + rules.braking / (rules.rate * rules.rate))


@inlined
def horizon_lanes(speed: Lanes, rules: Rules) -> Lanes:
    """Return the same for eight speeds [m]."""
    if rules.cone != 0.0:
        return 0.0 * speed
    per_rate = 1.0 / rules.rate  # a division of lanes costs as much as ten products
    far = speed * speed * (0.5 / rules.braking) + 0.5 * rules.braking * per_rate * per_rate
    return where(speed * rules.rate > rules.braking, far, speed * per_rate)


@inlined
def lead_of(speed: float, most: float) -> float:
    """Return how far a body that a robot cannot outrun goes while the robot goes a meter out of its way.

    Args:
        speed: Of the body [m/s].
        most: Speed limit of the robot [m/s].

    Returns:
        [1]; 0 where the body is slower.
    """
    return speed / most if speed > OUTRUNS * most else 0.0


@inlined
def breadth(extent: Array, motion: Array, speed: float) -> float:
    """Return how far a box around the middle of a path reaches to the side of it, at most [m].

    Args:
        extent: Half of the box, which stands upright, shape (p,) [m].
        motion: Velocity along the path, likewise [m/s].
        speed: Its length [m/s].
    """
    wide = 0.0
    for k in range(extent.shape[0]):
        wide += extent[k] * math.sqrt(max(1.0 - (motion[k] / speed) ** 2, 0.0))
    return wide


@inlined
def breadth_of(extent: Array) -> float:
    """Return the most that `breadth` can be, whichever way the body goes [m]."""
    wide = 0.0
    for k in range(extent.shape[0]):
        wide += extent[k]
    return wide


@inlined
def aside_of(straight: float, most: float) -> float:
    """Return the speed that the limit leaves across the path of a body before which a robot flees [m/s]."""
    return math.sqrt(max(most * most - max(straight, 0.0) ** 2, 0.0))


@inlined
def leave_path(
    apart: float, reach: float, v: Vec, motion: Vec, rules: Rules, direction: Vec
) -> tuple[float, Vec]:  # fmt: skip
    """Find what a robot's velocity has to satisfy to leave the path of a body that comes faster than it can.

    The condition is that of a body at rest, with the distance from the path in place of that from the body.
    It holds from when the body needs as long as the robot needs to leave its path.

    Args:
        apart: Distance from the body [m].
        reach: The least that it may be [m].
        v: Velocity of the robot [m/s].
        motion: Velocity of the body [m/s].
        rules: How fast it may come nearer to the path.
        direction: Unit vector away from the body.

    Returns:
        How fast it has to go away from the path [m/s], and the unit vector that way: to the side where the
        robot would come to rest, or will be when the body arrives.
    """
    heading, speed = unit_of(motion)
    across, ahead = v - dot(v, heading) * heading, apart * dot(direction, heading)
    side = norm(across)
    soon = min(horizon(side, rules) / max(side, 1e-300), ahead / speed)
    aside = apart * direction - ahead * heading
    later = aside + soon * across
    length = norm(later)
    if length <= HEAD_ON * apart:
        return -approach(-reach, rules), turn(motion)
    return -approach(dot(aside, later) / length - reach, rules), later / length


@inlined
def turn(r: Vec) -> Vec:
    """Return the unit vector counterclockwise across another, in pairs of axes as `sidestep` turns them."""
    tangent = turned(r, 1 if len(r) % 2 == 1 and abs(r[-1]) > POLAR * norm(r) else 0)
    return tangent / norm(tangent)
