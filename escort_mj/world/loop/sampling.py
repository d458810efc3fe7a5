"""Samples kept natively: the callback copies the record at every sample's step, Python takes many at once.

Between two looks of Python at a mission there are as many samples as the memory for them holds: no lock of
the interpreter is needed for thousands of physics steps, so missions step side by side in threads.
"""

from __future__ import annotations

from escort_mj.components.plan import KEPT, SAMPLED, Plan, State
from escort_mj.native.kernels import DOUBLE, inlined, vector_at
from escort_mj.native.lanes import WIDTH, load, store

MOST_SAMPLES = 256  # kept at once; of five robots, they stay in the cache of a core
MOST_NUMBERS = 2**17  # in them: a megabyte a mission
FEW = 32  # fewer are not worth it


def room_for(record: int) -> int:
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
    row = int(state.clock[KEPT])
    if row >= state.samples.shape[0] or state.clock[SAMPLED] == 0.0:
        return
    stretches, at = plan.stretches, row * state.samples.shape[1]
    for k in range(stretches.shape[0]):
        first, count = int(stretches[k, 0]), int(stretches[k, 1])
        source = vector_at(memory + DOUBLE * first, count)
        for place in range(0, count, WIDTH):  # what is written past its end the next stretch overwrites
            store(state.samples, at + place, load(source, place))
        at += count
    state.clock[KEPT] = row + 1.0
