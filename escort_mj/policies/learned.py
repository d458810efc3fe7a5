"""Learned: what a small network of a file makes of the robots and the target, found by training."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from escort_mj.components.component import OfMission
from escort_mj.components.equations import Memory
from escort_mj.components.facts import Facts, Misfit
from escort_mj.components.network import WIDEST, Network, evaluate_network, networks_of
from escort_mj.native.fields import Array
from escort_mj.native.kernels import inlined, stack_memory, vector_at
from escort_mj.native.vectors import Vec, dot, norm, numbers_from, set_numbers
from escort_mj.policies.body import Body
from escort_mj.policies.policy import Policy

ROBOTS = 4  # that a body sees, the nearest ones
LARGEST = 10.0  # size of a number that a network is given
EARLY = 1e-9  # s


class Learned(Network, Policy):
    """Move at a velocity that a network computes as a share of `speed`.

    The network's inputs are the vector to the target, the target's velocity, the body's own velocity, and,
    for each of the four nearest robots, the vector to it and its velocity. Distances are divided by the
    mission's radius and velocities by `speed`; inputs are limited to the range from -10 to 10. With fewer
    than four robots, the remaining inputs are 0.
    """

    python_only: ClassVar[frozenset[str]] = Policy.python_only | {"network"}
    of_teams: ClassVar[bool] = False
    until: ClassVar[Memory] = Memory("s", "time of the next evaluation")
    share: ClassVar[Memory] = Memory("1", "velocity as a share of the speed", vector=True)
    policy: Literal["learned"] = "learned"
    interval: Annotated[float, Field(ge=0.0, le=1e3)] = 0.02
    """Time between evaluations of the network [s]."""

    def misfits(self, mission: Facts) -> Iterator[Misfit]:
        """Yield a network of other inputs and outputs, or none."""
        axes = mission.axes
        yield from self.network_misfits(inputs(axes), axes, f"in {axes} axes")

    @OfMission
    def place(self, setup: Any) -> float:
        """Where the network lies among those of the mission."""
        return networks_of(setup)[1].get(self, 0) if setup is not None else 0

    def until_next(self, r: Body) -> float:
        """Return the time of the next evaluation."""
        return r.time + self.interval if r.time >= r.until - EARLY else r.until

    def share_next(self: Any, r: Body) -> Vec:
        """Return what the network answers, cut off at the length 1."""
        if r.time < r.until - EARLY:
            return r.share
        found = answered(int(self.place), self.speed, r)
        return found / max(norm(found), 1.0)

    def velocity(self, r: Body) -> Vec:
        """Return the velocity of which the network has found the share."""
        return self.speed * r.share


def inputs(axes: int) -> int:
    """Return how many numbers a network is given."""
    return (3 + 2 * ROBOTS) * axes


def within_speed(share: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return shares of the speed, shape (..., p), cut off at the length 1."""
    return np.asarray(share / np.maximum(np.linalg.norm(share, axis=-1, keepdims=True), 1.0))


@inlined
def answered(place: int, speed: float, r: Body) -> Vec:
    """Return what a network answers to what a body perceives, layer by layer.

    Args:
        place: Where the network begins among those of the mission.
        speed: That velocities are shares of [m/s].
        r: The body.
    """
    buffer, scratch = vector_at(stack_memory(), WIDEST), vector_at(stack_memory(), WIDEST)
    perceive(r, speed, buffer)
    layers = evaluate_network(r.seen.networks, place, buffer, scratch)
    found = numbers_from(r.seen, buffer, 0)
    return found if layers > 0 else 0.0 * found


@inlined
def perceive(r: Body, speed: float, found: Array) -> None:
    """Write what a network is given: of each quantity a vector, none larger than LARGEST.

    Args:
        r: The body.
        speed: That velocities are shares of [m/s].
        found: Written, shape (inputs,) or more.
    """
    p = len(r.q)
    for k in range((3 + 2 * ROBOTS) * p):
        found[k] = 0.0
    set_numbers(found, 0, (r.target - r.q) / r.radius)
    set_numbers(found, p, r.target_velocity / speed)
    set_numbers(found, 2 * p, r.v / speed)
    reached, last = -1.0, -1  # the robot that was found before, and its distance squared
    for place in range(min(r.robots, ROBOTS)):
        nearest, least = -1, math.inf
        for i in range(r.robots):
            square = dot(r.robot(i) - r.q, r.robot(i) - r.q)
            if (square > reached or (square == reached and i > last)) and square < least:
                nearest, least = i, square
        if nearest < 0:
            break
        set_numbers(found, (3 + 2 * place) * p, (r.robot(nearest) - r.q) / r.radius)
        set_numbers(found, (4 + 2 * place) * p, r.robot_velocity(nearest) / speed)
        reached, last = least, nearest
    for k in range((3 + 2 * ROBOTS) * p):
        found[k] = min(max(found[k], -LARGEST), LARGEST)
