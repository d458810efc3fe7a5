"""The controller on packed memory, without a simulator: what a process calls whose robots are elsewhere."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import cache

from escort_mj.control.conflicts import weigh_tasks
from escort_mj.control.controller import evaluate, follow_time
from escort_mj.memory.layout import axes_of, unpack_plan, unpack_state
from escort_mj.native import artifacts
from escort_mj.native.artifacts import Artifact
from escort_mj.native.kernels import interpreted
from escort_mj.native.on_demand import CLASSES, callback, piece_of
from escort_mj.sensing.measure import take_measurements


@callback(*CLASSES)
def evaluation(axes: int | None) -> Callable[..., None]:
    """Evaluate the law once, as the physics callback does, for the plan and the state at two addresses."""
    if axes is None:

        def of_many(plan: int, state: int) -> None:
            axes = axes_of(plan)
            evaluate(unpack_plan(plan, axes), unpack_state(plan, state, axes))

        return of_many

    def of_few(plan: int, state: int) -> None:
        evaluate(unpack_plan(plan, axes), unpack_state(plan, state, axes))

    return of_few


def interpreted_evaluation(axes: int) -> Callable[[int, int], None]:
    """Return `evaluation` as plain Python, for a debugger; it agrees with the machine code to rounding."""
    return interpreted(evaluation(axes if axes in CLASSES else None))


@cache
def evaluation_of(axes: int) -> Callable[[int, int], None]:
    """Return the machine code of `evaluation` for so many axes, compiled, shipped or read from the cache."""
    pieces = [piece_of(evaluation, axes), *law_pieces(axes)]
    artifacts.have(pieces)
    return ctypes.CFUNCTYPE(None, ctypes.c_ssize_t, ctypes.c_ssize_t)(artifacts.address(pieces[0]))


def law_pieces(axes: int | None) -> list[Artifact]:
    """Return what most missions evaluate the law with, for so many axes; None for more than are unrolled."""
    return [piece_of(each, axes) for each in (evaluate, take_measurements, weigh_tasks, follow_time)]
