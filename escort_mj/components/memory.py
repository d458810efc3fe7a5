"""What components integrate of their own, for every robot and axis: declared by them, recorded by name."""

from __future__ import annotations

from typing import Annotated, Any

from escort_mj.native.fields import Array, Fields, Recorded, Value
from escort_mj.native.kernels import flat, inlined
from escort_mj.native.lanes import WIDTH, load, store
from escort_mj.native.on_demand import on_demand
from escort_mj.plan import Plan, State

RATE = "_rate"
"""Ends the name of the method that gives the rate of what is integrated."""


class MemorySignals(Fields):
    """What is recorded of it, row by row: of the laws, then of the disturbances."""

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
def keep_rate(view: Any, row: int) -> None:
    """Keep what was written to `rate_found` as the rates of a row of the memory of the component at hand."""
    count = view.rate_found.shape[0] * view.rate_found.shape[1]
    first = (int(view.memory_row[0]) + row) * count
    rates, found = flat(view.component_rate), flat(view.rate_found)
    for at in range(count):
        rates[first + at] = found[at]


@on_demand
def integrate_memory(plan: Plan, state: State) -> None:
    """Move on what components integrate by a step."""
    count = state.component_memory.shape[0] * state.q.shape[0] * state.q.shape[1]
    for at in range(0, count, WIDTH):
        rate = plan.timestep * load(state.component_rate, at)
        store(state.component_memory, at, load(state.component_memory, at) + rate)
        store(state.component_rate, at, 0.0)
