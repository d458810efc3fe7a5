"""Samples kept natively: the callback copies the record at every sample's step, Python takes many at once.

Between two looks of Python at a mission there are as many samples as the memory for them holds: no lock of
the interpreter is needed for thousands of physics steps, so missions step side by side in threads.
"""

from __future__ import annotations

from escort_mj.control.plan import KEPT, WATCHED_STEP, Plan, State
from escort_mj.kernels import inlined, vector_at

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
        memory: Address of the state, with which the record begins.
        plan: Gives the sampling stride.
        state: The samples and their number are written.
    """
    row = int(state.clock[KEPT])
    if row >= state.samples.shape[0] or (int(state.clock[WATCHED_STEP]) - 1) % plan.stride != 0:
        return
    record = vector_at(memory, state.samples.shape[1])
    for place in range(record.shape[0]):
        state.samples[row, place] = record[place]
    state.clock[KEPT] = row + 1.0
