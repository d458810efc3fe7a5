"""Where robots take their teammates to be."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.components.parameters import UNLIMITED
from escort_mj.control.setup import Setup
from tests.oracle.radio import Mail

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


class Heard(NamedTuple):
    """What each robot has heard of its teammates.

    Attributes:
        place: Centers of the balls that these are in, the measured positions of those that it does not know
            of, shape (n, n, p) [m].
        ball: Radii of the balls, shape (n, n) [m].
        velocity: What they have sent, shape (n, n, p) [m/s].
        known: Which teammates it knows of, shape (n, n).
    """

    place: Array
    ball: Array
    velocity: Array
    known: Mask


def ball(age: Array, speed: Array, acceleration: Array, most: float, timestep: float) -> tuple[Array, Array]:
    """Return for how long what teammates sent carries the center of the ball [s], and its radius [m].

    Args:
        age: Of what they sent [s].
        speed: That they sent [m/s].
        acceleration: The most that their motors give [m/s^2].
        most: Speed limit [m/s].
        timestep: For which a force holds [s].
    """
    fastest, acceleration = np.maximum(min(most, UNLIMITED), speed), np.minimum(acceleration, UNLIMITED)
    carried = np.minimum(age, fastest / acceleration)
    return carried, 0.5 * acceleration * carried * (carried + timestep) + fastest * (age - carried)


def places_known(
    t: float, q: Array, lost: Mask, members: NDArray[np.int64] | None = None, mail: Mail | None = None
) -> Array:
    """Return where each robot knows its teammates to be, NaN for robots that it does not know of.

    Args:
        t: Time [s].
        q: Measured positions, shape (n, p) [m].
        lost: Robots that have failed, shape (n,).
        members: Team of each robot, shape (n,); None where all are one team.
        mail: What robots have heard; None where they know these positions.

    Returns:
        Shape (n, n, p) [m].
    """
    n, p = q.shape
    found = np.broadcast_to(q, (n, n, p)).copy()
    if mail is not None:
        found[~np.eye(n, dtype=bool)] = np.nan
        for i in range(n):
            for j, age, message in mail.known(i, t):
                found[i, j] = message.position + age * message.velocity
    found[:, lost] = np.nan
    if members is not None:
        found[members[:, None] != members] = np.nan
    return found


def places_heard(t: float, q: Array, lost: Mask, setup: Setup, mail: Mail) -> Heard:
    """Return where robots of all teams may be by now after what they have sent; arguments as above."""
    n, p = q.shape
    place, velocity = np.broadcast_to(q, (n, n, p)).copy(), np.zeros((n, n, p))
    age, known = np.zeros((n, n)), np.zeros((n, n), dtype=bool)
    for i in range(n):
        for j, old, said in mail.known(i, t):
            if not lost[j]:
                age[i, j], known[i, j] = old, True
                place[i, j], velocity[i, j] = said.position, said.velocity
    speed, bounds = np.linalg.norm(velocity, axis=2), (setup.acceleration, setup.max_speed)
    carried, radius = ball(age, speed, *bounds, setup.timestep)
    return Heard(place + carried[..., None] * velocity, radius, velocity, known)
