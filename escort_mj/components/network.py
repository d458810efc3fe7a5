"""Networks that a scenario names: layers of numbers, how kernels read them, and what they answer."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import chain, pairwise
from typing import Annotated, Any

from pydantic import Field, model_validator

from escort_mj.components.facts import Misfit
from escort_mj.components.parameters import Parameters
from escort_mj.components.setup import MissionSetup
from escort_mj.native.fields import Array
from escort_mj.native.kernels import inlined

WIDEST, MOST_LAYERS = 64, 4

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


class Network(Parameters):
    """A component that has a network."""

    network: Annotated[tuple[Layer, ...], Field(max_length=MOST_LAYERS, json_schema_extra=_or_file)] = ()
    """Layers, or the name of a .npz file in the scenario's folder; the file contains weights_1, bias_1,
    weights_2 and so on."""

    @model_validator(mode="after")
    def _chained(self) -> Network:
        for number, (one, other) in enumerate(pairwise(self.network), 2):
            if len(other.weights[0]) != len(one.weights):
                raise ValueError(
                    f"layer {number} of the network: found rows of {len(other.weights[0])} weights; expected "
                    f"{len(one.weights)}, a weight for each number of the layer before"
                )
        return self

    def network_misfits(self, inputs: int, outputs: int, where: str) -> Iterator[Misfit]:
        """Yield a network of other inputs and outputs, or none.

        Args:
            inputs: How many numbers it is given.
            outputs: How many it is to answer.
            where: What these follow from, in words.
        """
        if not self.network:
            yield Misfit("found none; give the name of a .npz file with one", "network")
            return
        given, answered = len(self.network[0].weights[0]), len(self.network[-1].weights)
        if (given, answered) != (inputs, outputs):
            words = f"found {given} inputs and {answered} outputs; expected {inputs} and {outputs} {where}"
            yield Misfit(words, "network")


def networks_of(setup: MissionSetup) -> tuple[list[float], dict[Network, int]]:
    """Return the networks of a mission as kernels read them, and where each begins.

    A network is the number of its layers and, of each, its rows, its columns, its weights and its biases.
    """
    found: list[float] = []
    places: dict[Network, int] = {}
    for each in (*(mover.policy for mover in setup.movers), *setup.all_behaviors):
        if isinstance(each, Network) and each not in places:
            places[each] = len(found)
            found.append(len(each.network))
            for layer in each.network:
                found += [len(layer.weights), len(layer.weights[0]), *chain(*layer.weights), *layer.bias]
    return found, places


@inlined
def evaluate_network(networks: Array, place: int, buffer: Array, scratch: Array) -> int:
    """Evaluate a network in place, layer by layer.

    Args:
        networks: Those of the mission, see `networks_of`.
        place: Where the network begins among them.
        buffer: Its inputs, and then its outputs, shape (WIDEST,).
        scratch: Of the same shape.

    Returns:
        The number of its layers; without any, the buffer is left as it is.
    """
    layers, at = int(networks[place]), place + 1
    for number in range(layers):
        rows, columns = int(networks[at]), int(networks[at + 1])
        at += 2
        for row in range(rows):
            answer = networks[at + rows * columns + row]
            for column in range(columns):
                answer += networks[at + row * columns + column] * buffer[column]
            scratch[row] = math.tanh(answer) if number < layers - 1 else answer
        at += rows * (columns + 1)
        for row in range(rows):
            buffer[row] = scratch[row]
    return layers
