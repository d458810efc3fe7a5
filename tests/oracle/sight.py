"""Which targets robots see, and what they measure of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.control.setup import Setup
from escort_mj.knowledge.sight import NORMALS, OUTLIERS
from escort_mj.numerics.gaussian import SIGHT
from tests.oracle.noise import normal, uniforms
from tests.oracle.rays import hidden

Array = NDArray[np.float64]


class SightedBody(NamedTuple):
    """A body that robots look at.

    Attributes:
        position: True position, shape (p,) [m].
        radius: [m].
        obstacle: Which obstacle it is, from 0; -1 for none.
    """

    position: Array
    radius: float
    obstacle: int = -1


def look(
    i: int,
    step: int,
    team: tuple[Array, Array | None],
    targets: Sequence[SightedBody],
    shown: tuple[Array, Array],
    setup: Setup,
) -> Sighting | None:
    """Return what a robot measures at a step; None where it does not see the target.

    Args:
        i: The robot, from 0.
        step: Physics step.
        team: True positions of the robots, shape (n, p) [m], and their headings, likewise [1]; None without.
        targets: What it has to see.
        shown: Position and velocity of the target, or of the middle of its targets, as the team's sensors
            show them, shape (p,) each.
        setup: Gives the sight.
    """
    sight, p = setup.sight, setup.axes
    if sight is None or (sight.robots is not None and i + 1 not in sight.robots):
        return None
    if not all(_visible(i, team, each, setup) for each in targets):
        return None
    q = team[0][i]
    missed, odd = uniforms(2, setup.seed, SIGHT, i, step)
    if missed < sight.dropout:
        return None
    drawn = normal(3 * p + 1, setup.seed, SIGHT, i, step, NORMALS)
    errors = np.zeros(p + 1)
    if sight.outliers is not None and odd < sight.outliers.share:
        draws = [uniforms(1, setup.seed, SIGHT, i, step, OUTLIERS + k)[0] for k in range(p + 1)]
        errors = 2.0 * sight.outliers.size * (np.array(draws) - 0.5)
    way = shown[0] - q
    distance = float(np.linalg.norm(way))
    unit = way / max(distance, 1e-300)
    g = drawn[2 * p : 3 * p]
    bearing = unit + sight.noise.bearing * (g - unit * (unit @ g))
    return Sighting(
        shown[0] + sight.noise.position * drawn[:p] + errors[:p],
        shown[1] + sight.noise.velocity * drawn[p : 2 * p],
        distance + sight.noise.range * drawn[3 * p] + errors[p],
        bearing / max(float(np.linalg.norm(bearing)), 1e-150),
    )


def _visible(i: int, team: tuple[Array, Array | None], target: SightedBody, setup: Setup) -> bool:
    """Return whether robot i sees a target; arguments as of `look`."""
    sight, (robots, headings) = setup.sight, team
    assert sight is not None
    way = target.position - robots[i]
    gap = np.linalg.norm(way) - setup.robot_radius[i] - target.radius
    if sight.range is not None and gap > sight.range:
        return False
    if sight.hidden and hidden(robots[i], way, setup, but=target.obstacle):
        return False
    if sight.hidden_by_teammates:
        mates = np.arange(setup.count) != i
        if hidden(robots[i], way, setup, (robots[mates], setup.robot_radius[mates])):
            return False
    if headings is None or sight.field_of_view is None:
        return True
    lengths = np.linalg.norm(way) * np.linalg.norm(headings[i])
    angle = np.arccos(np.clip(way @ headings[i] / max(lengths, 1e-300), -1.0, 1.0))
    return bool(angle <= 0.5 * sight.field_of_view)


class Sighting(NamedTuple):
    """What one robot measures of the target.

    Attributes:
        position: Shape (p,) [m].
        velocity: Shape (p,) [m/s].
        range: Distance of the centers [m].
        bearing: Unit vector to the target, shape (p,).
    """

    position: Array
    velocity: Array
    range: float
    bearing: Array
