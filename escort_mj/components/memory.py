"""What components integrate of their own, for every robot and axis: declared by them, recorded by name."""

from __future__ import annotations

from typing import Annotated, Any

from escort_mj.components.setup import MissionSetup
from escort_mj.native.fields import Array, Fields, Recorded, Value
from escort_mj.native.kernels import flat, inlined
from escort_mj.native.lanes import WIDTH, load, store
from escort_mj.native.on_demand import on_demand
from escort_mj.native.vectors import Vec, rows_at
from escort_mj.plan import Plan, State

RATE = "_rate"
"""Ends the name of the method that gives the rate of what is integrated."""


class MemoryParameters(Fields):
    """Whose memory is held while it does not rule."""

    memory_phase: Annotated[Array, "memories", Value("1", "phase whose behavior keeps it; -1 for all others")]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        return {"memory_phase": setup.memory_phases}


class MemorySignals(Fields):
    """What is recorded of it, row by row: of laws, disturbances, behaviors and rules."""

    component_memory: Annotated[
        Array,
        "memories",
        "n",
        "p",
        Recorded("1", "what components integrate of their own; see `memory_unit`"),
    ]


class MemoryState(Fields):
    """How it moves on."""

    component_rate: Annotated[Array, "memories", "n", "p", Value("1/s", "rates of `component_memory`")]
    rate_found: Annotated[Array, "remembering", "p", Value("1/s", "one row of them: scratch")]
    memory_row: Annotated[Array, 1, Value("1", "row at which the memory of the component at hand begins")]


@inlined
def keep_rate(view: Any, row: int, i: int, count: int) -> None:
    """Keep what was written to `rate_found` as the rates of a row of the memory of the component at hand.

    Args:
        view: Memory.
        row: Of those of the component.
        i: The first robot of which it is kept.
        count: Of how many, as far as there are so many.
    """
    n, p = view.rate_found.shape
    first = (int(view.memory_row[0]) + row) * n * p
    rates, found = flat(view.component_rate), flat(view.rate_found)
    for at in range(i * p, min(i + count, n) * p):
        rates[first + at] = found[at]


@inlined
def memory_at(view: Any, row: int, i: int) -> Vec:
    """Return a row of the memory of the component at hand, of robots i to i + 7."""
    first = (int(view.memory_row[0]) + row) * view.q.shape[0]
    return rows_at(view, view.component_memory, first + i)


@on_demand
def integrate_memory(plan: Plan, state: State) -> None:
    """Move on what components integrate by a step."""
    for row in range(state.component_memory.shape[0]):
        for i in range(state.q.shape[0] if plan.memory_phase[row] >= 0.0 else 0):
            if state.phase[i] != plan.memory_phase[row]:
                state.component_rate[row, i] = 0.0
    count = state.component_memory.shape[0] * state.q.shape[0] * state.q.shape[1]
    for at in range(0, count, WIDTH):
        rate = plan.timestep * load(state.component_rate, at)
        store(state.component_memory, at, load(state.component_memory, at) + rate)
        store(state.component_rate, at, 0.0)
