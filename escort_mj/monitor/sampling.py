"""Samples kept natively: the callback copies the record at every sample's step, Python takes many at once.

Between two looks of Python at a mission there are as many samples as the memory for them holds: no lock of
the interpreter is needed for thousands of physics steps, so missions step side by side in threads.
"""

from __future__ import annotations

from typing import Annotated

from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import DOUBLE, inlined, vector_at
from escort_mj.native.lanes import WIDTH, load, store
from escort_mj.native.on_demand import on_demand
from escort_mj.plan import Plan, State

MOST_SAMPLES = 256  # kept at once; of five robots, they stay in the cache of a core
MOST_NUMBERS = 2**17  # in them: a megabyte a mission
FEW = 32  # fewer are not worth it
MOST_STEPS = 4096  # kept at once where expectations ask about every step


class SamplingParameters(Fields):
    """Where in the state a record stands."""

    stretches: Annotated[Array, "stretches", 2, Value("1", "start and length, in the order of a record")]
    step_stretches: Annotated[
        Array, "step_stretches", 2, Value("1", "likewise, of what expectations ask about every step")
    ]


class SamplingState(Fields):
    """Samples and steps that were not taken off yet: the end of the state."""

    kept_count: Annotated[Array, 1, Value("1", "how many samples there are")]
    steps_count: Annotated[Array, 1, Value("1", "how many steps there are")]
    watch_ended: Annotated[Array, 1, Value("1", "whether a sample was taken in the last step taken off")]
    samples: Annotated[Array, "kept", "record", Value("1", "one record each")]
    spare: Annotated[Array, WIDTH, Value("1", "past the last sample: lanes are written whole")]
    steps: Annotated[
        Array, "kept_steps", "step_record", Value("1", "whether it is a sample, and what is asked of each")
    ]
    steps_spare: Annotated[Array, WIDTH, Value("1", "past the last step, likewise")]


def samples_kept(record: int) -> int:
    """How many samples of so many numbers a mission keeps until Python takes them off.

    Crowds of eighty and more keep one: to save their state before each look would cost more than to look.
    """
    room = min(MOST_SAMPLES, MOST_NUMBERS // record)
    return room if room >= FEW else 1


def steps_kept(numbers: int) -> int:
    """How many steps of so many numbers a mission keeps until Python takes them off; none of no numbers.

    Unlike samples, they are taken off at any step.
    """
    return min(MOST_STEPS, max(MOST_NUMBERS // numbers, 1)) if numbers else 0


@on_demand
def keep_step(memory: int, plan: Plan, state: State) -> None:
    """Keeps what expectations ask about every step of a watched one, as long as there is room.

    Args:
        memory: Address of the state.
        plan: Gives where in the state it stands.
        state: The steps and their number are written.
    """
    row = int(state.steps_count[0])
    if row >= state.steps.shape[0]:
        return
    stretches, at = plan.step_stretches, row * state.steps.shape[1]
    state.steps[row, 0] = state.sampled[0]
    at += 1
    for k in range(stretches.shape[0]):
        first, count = int(stretches[k, 0]), int(stretches[k, 1])
        source = vector_at(memory + DOUBLE * first, count)
        for place in range(0, count, WIDTH):
            store(state.steps, at + place, load(source, place))
        at += count
    state.steps_count[0] = row + 1.0


@inlined
def keep(memory: int, plan: Plan, state: State) -> None:
    """Keeps what is asked of a watched step, and its record if a sample is taken in it and there is room.

    Args:
        memory: Address of the state.
        plan: Gives where in the state the record stands.
        state: The samples and their number are written.
    """
    if state.steps.shape[0] > 0:
        keep_step(memory, plan, state)
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
