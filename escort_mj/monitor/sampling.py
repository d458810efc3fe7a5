"""Samples kept natively: the callback copies the record at every sample's step, Python takes many at once.

Between two looks of Python at a mission there are as many samples as the memory for them holds: no lock of
the interpreter is needed for thousands of physics steps, so missions step side by side in threads.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import DOUBLE, inlined, vector_at
from escort_mj.native.lanes import WIDTH, load, store

if TYPE_CHECKING:
    from escort_mj.memory.layout import Plan, State

MOST_SAMPLES = 256  # kept at once; of five robots, they stay in the cache of a core
MOST_NUMBERS = 2**17  # in them: a megabyte a mission
FEW = 32  # fewer are not worth it


class SamplingParameters(Fields):
    """Where in the state a record stands."""

    stretches: Annotated[Array, "stretches", 2, Value("1", "start and length, in the order of a record")]


class SamplingState(Fields):
    """Samples that were not taken off yet: the end of the state."""

    kept_count: Annotated[Array, 1, Value("1", "how many samples there are")]
    samples: Annotated[Array, "kept", "record", Value("1", "one record each")]
    spare: Annotated[Array, WIDTH, Value("1", "past the last sample: lanes are written whole")]


def samples_kept(record: int) -> int:
    """How many samples of so many numbers a mission keeps until Python takes them off.

    Crowds of eighty and more keep one: to save their state before each look would cost more than to look.
    """
    room = min(MOST_SAMPLES, MOST_NUMBERS // record)
    return room if room >= FEW else 1


@inlined
def keep(memory: int, plan: Plan, state: State) -> None:
    """Keeps the record of a watched step, if a sample is taken in it and there is room.

    Args:
        memory: Address of the state.
        plan: Gives where in the state the record stands.
        state: The samples and their number are written.
    """
    row = int(state.kept_count[0])
    if row >= state.samples.shape[0] or state.sampled[0] == 0.0:
        return
    stretches, at = plan.stretches, row * state.samples.shape[1]
    for k in range(stretches.shape[0]):
        first, count = int(stretches[k, 0]), int(stretches[k, 1])
        source = vector_at(memory + DOUBLE * first, count)
        for place in range(0, count, WIDTH):  # what is written past its end the next stretch overwrites
            store(state.samples, at + place, load(source, place))
        at += count
    state.kept_count[0] = row + 1.0
