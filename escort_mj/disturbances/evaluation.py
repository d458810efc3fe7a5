"""How the equations of a disturbance become forces and rates: for eight robots at a time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from escort_mj.components.memory import RATE, keep_rate
from escort_mj.disturbances.disturbance import Disturbance, robots_of
from escort_mj.native.lanes import WIDTH
from escort_mj.native.vectors import set_rows

Call = Callable[..., Any]


def pushing_by(
    disturbance: type[Disturbance], made: Callable[[Call], Call], equations: Mapping[str, Call]
) -> Call:
    """Return what writes the forces on all robots, and the rates of its own memory: `(parameters, view)`.

    Args:
        disturbance: The disturbance.
        made: Makes a function callable in kernels.
        equations: What `disturbance.equations()` returns, made so.
    """
    robots_at, force = robots_of(disturbance), equations["force"]

    def push(parameters: Any, view: Any) -> None:
        for i in range(0, view.q.shape[0], WIDTH):
            set_rows(view.disturbance_force, i, force(parameters, robots_at(i, view)))

    def after(before: Call, row: int, rate: Call) -> Call:
        def write(parameters: Any, view: Any) -> None:
            before(parameters, view)
            for i in range(0, view.q.shape[0], WIDTH):
                set_rows(view.rate_found, i, rate(parameters, robots_at(i, view)))
            keep_rate(view, row)

        return made(write)

    write = made(push)
    for row, name in enumerate(disturbance.memories()):
        write = after(write, row, equations[name + RATE])

    def run(parameters: Any, view: Any) -> None:
        write(parameters, view)

    return run
