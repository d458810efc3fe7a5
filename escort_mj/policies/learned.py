"""Learned: what a small network of a file makes of the robots and the target, found by training."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from itertools import chain, pairwise
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from escort_mj.components.equations import Memory
from escort_mj.components.facts import Facts, Misfit
from escort_mj.components.parameters import Parameters
from escort_mj.native.fields import Array
from escort_mj.native.kernels import inlined, stack_memory, vector_at
from escort_mj.native.vectors import Vec, dot, norm, numbers_from, set_numbers
from escort_mj.policies.body import Body
from escort_mj.policies.policy import Policy

ROBOTS = 4  # that a body sees, the nearest ones
LARGEST = 10.0  # size of a number that a network is given
WIDEST, MOST_LAYERS = 64, 4
EARLY = 1e-9  # s

Numbers = Annotated[tuple[float, ...], Field(min_length=1, max_length=WIDEST)]


class Layer(Parameters):
    """One layer of a network: tanh(weights x + bias) of its input x; the last layer has no tanh."""

    weights: Annotated[tuple[Numbers, ...], Field(min_length=1, max_length=WIDEST)]
    """Weights, one row per output."""
    bias: Numbers
    """Biases, one per output."""

    @model_validator(mode="after")
    def _shaped(self) -> Layer:
        rows = {len(row) for row in self.weights}
        if len(rows) > 1 or len(self.bias) != len(self.weights):
            raise ValueError(
                f"found {len(self.weights)} rows of {sorted(rows)} weights and {len(self.bias)} biases; "
                "expected rows of one length, and a bias for each"
            )
        return self


def _or_file(schema: dict[str, Any]) -> None:
    """Let editors accept the name of a file, which the reader replaces by its layers."""
    listed = {key: schema.pop(key) for key in ("type", "items", "maxItems") if key in schema}
    schema["anyOf"] = [listed, {"type": "string", "pattern": r"\.npz$"}]


class Learned(Policy):
    """Move at a velocity that a network computes as a share of `speed`.

    The network's inputs are the vector to the target, the target's velocity, the body's own velocity, and,
    for each of the four nearest robots, the vector to it and its velocity. Distances are divided by the
    mission's radius and velocities by `speed`; inputs are limited to the range from -10 to 10. With fewer
    than four robots, the remaining inputs are 0.
    """

    python_only: ClassVar[frozenset[str]] = Policy.python_only | {"network"}
    until: ClassVar[Memory] = Memory("s", "time of the next evaluation")
    share: ClassVar[Memory] = Memory("1", "velocity as a share of the speed", vector=True)
    policy: Literal["learned"] = "learned"
    network: Annotated[tuple[Layer, ...], Field(max_length=MOST_LAYERS, json_schema_extra=_or_file)] = ()
    """Layers, or the name of a .npz file in the scenario's folder; the file contains weights_1, bias_1,
    weights_2 and so on."""
    interval: Annotated[float, Field(ge=0.0, le=1e3)] = 0.02
    """Time between evaluations of the network [s]."""

    def misfits(self, mission: Facts) -> Iterator[Misfit]:
        """Yield a network of other inputs and outputs, or none."""
        if not self.network:
            yield Misfit("found none; give the name of a .npz file with one", "network")
            return
        axes, needed = mission.axes, inputs(mission.axes)
        given, answered = len(self.network[0].weights[0]), len(self.network[-1].weights)
        if (given, answered) != (needed, axes):
            words = (
                f"found {given} inputs and {answered} outputs; expected {needed} and {axes} in {axes} axes"
            )
            yield Misfit(words, "network")

    @model_validator(mode="after")
    def _chained(self) -> Learned:
        for number, (one, other) in enumerate(pairwise(self.network), 2):
            if len(other.weights[0]) != len(one.weights):
                raise ValueError(
                    f"layer {number} of the network: found rows of {len(other.weights[0])} weights; expected "
                    f"{len(one.weights)}, a weight for each number of the layer before"
                )
        return self

    @classmethod
    def numbers(cls) -> dict[str, type]:
        """Return what kernels read: also where the network lies among those of the mission."""
        return super().numbers() | {"place": int}

    def packed(self, setup: Any = None) -> dict[str, float]:
        """Return its parameters as numbers."""
        places = packed_networks(mover.policy for mover in setup.movers)[1] if setup is not None else {}
        return {"speed": self.speed, "interval": self.interval, "place": float(places.get(self, 0))}

    def until_next(self, r: Body) -> float:
        """Return the time of the next evaluation."""
        return r.time + self.interval if r.time >= r.until - EARLY else r.until

    def share_next(self: Any, r: Body) -> Vec:
        """Return what the network answers, cut off at the length 1."""
        if r.time < r.until - EARLY:
            return r.share
        found = answered(self.place, self.speed, r)
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


def packed_networks(policies: Iterable[Policy | None]) -> tuple[list[float], dict[Learned, int]]:
    """Return the networks of policies as kernels read them, and where each begins.

    A network is the number of its layers and, of each, its rows, its columns, its weights and its biases.
    """
    found: list[float] = []
    places: dict[Learned, int] = {}
    for policy in policies:
        if isinstance(policy, Learned) and policy not in places:
            places[policy] = len(found)
            found.append(len(policy.network))
            for layer in policy.network:
                found += [len(layer.weights), len(layer.weights[0]), *chain(*layer.weights), *layer.bias]
    return found, places


@inlined
def answered(place: int, speed: float, r: Body) -> Vec:
    """Return what a network answers to what a body perceives, layer by layer.

    Args:
        place: Where the network begins among those of the mission.
        speed: That velocities are shares of [m/s].
        r: The body.
    """
    networks = r.seen.networks
    values, answers = vector_at(stack_memory(), WIDEST), vector_at(stack_memory(), WIDEST)
    perceive(r, speed, values)
    layers, at = int(networks[place]), place + 1
    for number in range(layers):
        rows, columns = int(networks[at]), int(networks[at + 1])
        at += 2
        for row in range(rows):
            answer = networks[at + rows * columns + row]
            for column in range(columns):
                answer += networks[at + row * columns + column] * values[column]
            answers[row] = math.tanh(answer) if number < layers - 1 else answer
        at += rows * (columns + 1)
        for row in range(rows):
            values[row] = answers[row]
    found = numbers_from(r.seen, values, 0)
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
