"""What bodies with a policy want, with NumPy."""

from __future__ import annotations

import math
from functools import singledispatch
from typing import Any

import numpy as np
from numpy.typing import NDArray

from escort_mj.numerics.gaussian import POLICY
from escort_mj.policies import (
    avoid,
    burst,
    learned,
    patient,
    voronoi,
    wander,
)
from escort_mj.policies.avoid import Avoid
from escort_mj.policies.breach import Breach
from escort_mj.policies.burst import Burst
from escort_mj.policies.directions import (
    _TURN,
    IN_PLANE,
    IN_SPACE,
    NEAR,
)
from escort_mj.policies.flee import Flee
from escort_mj.policies.follow import Follow
from escort_mj.policies.learned import LARGEST, ROBOTS, Learned, within_speed
from escort_mj.policies.patient import Patient
from escort_mj.policies.policy import ACTS, RESTS, Policy
from escort_mj.policies.straight import Straight
from escort_mj.policies.voronoi import Voronoi
from escort_mj.policies.wander import Wander
from escort_mj.policies.weave import Weave
from tests.oracle.noise import uniforms

Array = NDArray[np.float64]

UNTIL, CHOSEN = 0, 1  # what is kept in `mover_memory`: of policies that choose again after an interval
DASHES, SINCE, DIRECTION = 0, 1, 2
DRAWN, PLACE = 0, 1
RUNS = 0


@singledispatch
def velocity(policy: Policy, view: Any, body: int) -> int:
    """Write the velocity that a body wants to `mover_wish`; return whether it acts.

    Args:
        policy: The policy.
        view: What policies see (`PolicyView`), with `mover_wish` and `mover_memory` of its own.
        body: Which of the bodies with a drive, from 0.
    """
    raise NotImplementedError


def possible_directions(axes: int) -> Array:
    """Return all directions, shape (directions, axes)."""
    if axes == 2:
        angles = 2.0 * np.pi * np.arange(IN_PLANE) / IN_PLANE
        return np.stack([np.cos(angles), np.sin(angles)], axis=1)
    k = np.arange(IN_SPACE, dtype=float)
    height, angles = 1.0 - (2.0 * k + 1.0) / IN_SPACE, _TURN * k
    across = np.sqrt(1.0 - height**2)
    return np.stack([across * np.cos(angles), across * np.sin(angles), height], axis=1)


def freest(here: Array, others: Array, power: int) -> Array:
    """Return the direction u with the least max_i u . d_i / |d_i|^power, d_i the way to another, shape (p,).

    With the power 1 it is the middle of the largest gap between the others as seen from here. With 2, half
    the reciprocal of the largest is how far u stays within the points that are nearer to here than to any
    of the others: the longest way within the Voronoi cell.

    Args:
        here: Shape (p,) [m].
        others: Shape (n, p) [m].
        power: 1 or 2.
    """
    ways: Array = others - here
    square: Array = np.sum(ways**2, axis=1)
    ways, square = ways[square > 0.0], square[square > 0.0]
    choice: Array = possible_directions(len(here))
    if not len(ways):
        return choice[0]
    most = (choice @ (ways / (square if power == 2 else np.sqrt(square))[:, None]).T).max(axis=1)
    return choice[int(most.argmin())]


@velocity.register
def _velocity_of_learned(policy: Learned, view: Any, body: int) -> int:
    """Write the velocity that the network answers."""
    kept, p = view.mover_memory[body], view.q.shape[1]
    if view.time[0] >= kept[UNTIL] - learned.EARLY:
        kept[UNTIL] = view.time[0] + policy.interval
        values = perceived(view, body, policy.speed)
        for number, layer in enumerate(policy.network, 1):
            values = np.array(layer.weights) @ values + np.array(layer.bias)
            values = np.tanh(values) if number < len(policy.network) else values
        kept[CHOSEN : CHOSEN + p] = within_speed(values[:p] if policy.network else np.zeros(p))
    view.mover_wish[body] = policy.speed * kept[CHOSEN : CHOSEN + p]
    return ACTS


def perceived(view: Any, body: int, speed: float) -> NDArray[np.float64]:
    """Return what a body perceives, shape (inputs,).

    Args:
        view: Of the mission.
        body: Which of the bodies with a drive, from 0.
        speed: That velocities are shares of [m/s].
    """
    p, here = view.q.shape[1], view.mover_position[body]
    found = np.zeros((3 + 2 * ROBOTS, p))
    found[0] = (view.target_position - here) / view.radius
    found[1], found[2] = view.target_velocity / speed, view.mover_velocity[body] / speed
    ways = view.q - here
    nearest = np.argsort(np.sum(ways**2, axis=1), kind="stable")[:ROBOTS]
    found[3 : 3 + 2 * len(nearest) : 2] = ways[nearest] / view.radius
    found[4 : 4 + 2 * len(nearest) : 2] = view.v[nearest] / speed
    return np.clip(found.ravel(), -LARGEST, LARGEST)


@velocity.register
def _velocity_of_avoid(policy: Avoid, view: Any, body: int) -> int:
    """Write the velocity past the robots."""
    kept, here, p = view.mover_memory[body], view.mover_position[body], view.q.shape[1]
    if view.time[0] >= kept[UNTIL]:
        kept[UNTIL] = view.time[0] + policy.interval
        way = view.target_position - here
        straight = way / max(float(np.linalg.norm(way)), 1e-9)
        choice, ways = np.vstack([possible_directions(p), straight]), view.q - here
        along, far = choice @ ways.T, np.sum(ways**2, axis=1)
        blocked = (along > 0.0) & (far - along**2 < policy.berth**2) & (far < policy.sight**2)
        value = choice @ straight - avoid.BLOCKED * blocked.any(axis=1)
        kept[CHOSEN : CHOSEN + p] = choice[int(value.argmax())]
    view.mover_wish[body] = policy.speed * kept[CHOSEN : CHOSEN + p]
    return ACTS


@velocity.register
def _velocity_of_breach(policy: Breach, view: Any, body: int) -> int:
    """Write the velocity toward the point."""
    kept, p = view.mover_memory[body], view.q.shape[1]
    away = view.mover_position[body] - view.target_position
    if view.time[0] >= kept[UNTIL]:
        kept[UNTIL] = view.time[0] + policy.interval
        choice, ways = possible_directions(p), view.q - view.target_position
        ways = ways / np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), NEAR)
        arc = np.arccos(np.clip(choice @ ways.T, -1.0, 1.0)).min(axis=1) * policy.perimeter
        own = np.linalg.norm(policy.perimeter * choice - away, axis=1)
        ahead = arc / policy.rival_speed - own / policy.speed
        ahead[choice @ away < policy.perimeter] = -np.inf
        best = int(ahead.argmax())
        kept[CHOSEN : CHOSEN + p] = policy.perimeter * choice[best] if np.isfinite(ahead[best]) else 0.0
    way = kept[CHOSEN : CHOSEN + p] - away
    view.mover_wish[body] = policy.speed * way / max(float(np.linalg.norm(way)), NEAR)
    return ACTS


@velocity.register
def _velocity_of_burst(policy: Burst, view: Any, body: int) -> int:
    """Write the velocity of the dash, or 0."""
    time, kept, p = float(view.time[0]), view.mover_memory[body], view.q.shape[1]
    if kept[DASHES] and time >= kept[SINCE] + policy.dash:
        kept[DASHES], kept[SINCE] = 0.0, time
    if not kept[DASHES] and time >= kept[SINCE] + policy.wait:
        kept[DASHES], kept[SINCE] = 1.0, time
        kept[DIRECTION : DIRECTION + p] = freest(view.mover_position[body], view.q, burst.IN_ANGLE)
    view.mover_wish[body] = policy.speed * kept[DASHES] * kept[DIRECTION : DIRECTION + p]
    return ACTS if kept[DASHES] else RESTS


@velocity.register
def _velocity_of_flee(policy: Flee, view: Any, body: int) -> int:
    """Write the velocity away from the nearest robot."""
    ways = view.mover_position[body] - view.q
    distance = np.linalg.norm(ways, axis=1)
    nearest = int(distance.argmin())
    alarmed = bool(0.0 < distance[nearest] <= policy.sight)
    view.mover_wish[body] = policy.speed * ways[nearest] / distance[nearest] if alarmed else 0.0
    return ACTS if alarmed else RESTS


@velocity.register
def _velocity_of_follow(policy: Follow, view: Any, body: int) -> int:
    """Write the velocity along the line to the leader."""
    places = np.vstack([view.q, view.target_position, view.obstacle_position])
    speeds = np.vstack([view.v, view.target_velocity, view.obstacle_velocity])
    way = places[policy._place] - view.mover_position[body]
    far = float(np.linalg.norm(way))
    rate = speeds[policy._place] @ way / max(far, NEAR) + policy.gain * (far - policy.distance)
    view.mover_wish[body] = min(max(rate, -policy.speed), policy.speed) * way / max(far, NEAR)
    return ACTS


@velocity.register
def _velocity_of_patient(policy: Patient, view: Any, body: int) -> int:
    """Write the velocity around the target, or toward it."""
    kept, away = view.mover_memory[body], view.mover_position[body] - view.target_position
    far = max(float(np.linalg.norm(away)), NEAR)
    ways = view.q - view.target_position
    size = np.maximum(np.linalg.norm(ways, axis=1), NEAR)
    nearest = float((ways @ away / (far * size)).max())
    if abs(far - policy.distance) < 0.1 * policy.distance and nearest < math.cos(policy.gap):
        kept[RUNS] = 1.0
    around = np.zeros_like(away)
    around[0], around[1] = -away[1], away[0]
    wish = around / far * policy.speed - patient.GAIN * (far - policy.distance) * away / far
    wish *= policy.speed / max(float(np.linalg.norm(wish)), policy.speed)
    view.mover_wish[body] = -policy.speed * away / far if kept[RUNS] else wish
    return ACTS if kept[RUNS] else RESTS


@velocity.register
def _velocity_of_straight(policy: Straight, view: Any, body: int) -> int:
    """Write the velocity toward the target."""
    way = view.target_position - view.mover_position[body]
    view.mover_wish[body] = policy.speed * way / max(float(np.linalg.norm(way)), NEAR)
    return ACTS


@velocity.register
def _velocity_of_voronoi(policy: Voronoi, view: Any, body: int) -> int:
    """Write the velocity along the longest way."""
    kept, p = view.mover_memory[body], view.q.shape[1]
    if view.time[0] < policy.wait:
        view.mover_wish[body] = 0.0
        return RESTS
    if view.time[0] >= kept[UNTIL]:
        kept[UNTIL] = view.time[0] + policy.interval
        kept[CHOSEN : CHOSEN + p] = freest(view.mover_position[body], view.q, voronoi.IN_CELL)
    view.mover_wish[body] = policy.speed * kept[CHOSEN : CHOSEN + p]
    return ACTS


@velocity.register
def _velocity_of_wander(policy: Wander, view: Any, body: int) -> int:
    """Write the velocity toward the place."""
    kept, here, p = view.mover_memory[body], view.mover_position[body], view.q.shape[1]
    place = kept[PLACE : PLACE + p]
    if not kept[DRAWN] or np.linalg.norm(place - here) <= wander.ARRIVED * policy.reach:
        kept[DRAWN] += 1.0
        drawn = uniforms(p, view.seed, POLICY, body, int(kept[DRAWN]))
        place[:] = view.mover_start[body] + policy.reach * (2.0 * drawn - 1.0)
    way = place - here
    view.mover_wish[body] = policy.speed * way / max(float(np.linalg.norm(way)), 1e-9)
    return ACTS


@velocity.register
def _velocity_of_weave(policy: Weave, view: Any, body: int) -> int:
    """Write the velocity along the wavy line."""
    way = view.target_position - view.mover_position[body]
    turn = policy.angle * np.sin(2.0 * np.pi * view.time[0] / policy.period)
    turned = np.array(way)
    turned[0], turned[1] = (
        np.cos(turn) * way[0] - np.sin(turn) * way[1],
        np.sin(turn) * way[0] + np.cos(turn) * way[1],
    )
    view.mover_wish[body] = policy.speed * turned / max(float(np.linalg.norm(way)), NEAR)
    return ACTS
