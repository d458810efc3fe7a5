"""How the equation of a behavior becomes a task: for eight robots at a time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from escort_mj.behaviors.behavior import Behavior
from escort_mj.behaviors.robots import robots_at
from escort_mj.behaviors.task import as_task, keep_task

Call = Callable[..., Any]


def asking_by(behavior: type[Behavior], equations: Mapping[str, Call]) -> Call:
    """Return what keeps the task of robots i to i + 7 in a view: `(parameters, view, i)`.

    Args:
        behavior: The behavior.
        equations: What `behavior.equations()` returns, callable in kernels.
    """
    task = equations["task"]

    def ask(parameters: Any, view: Any, i: int) -> None:
        keep_task(task(parameters, robots_at(i, view, view)), view, i)

    def ask_limit(parameters: Any, view: Any, i: int) -> None:
        keep_task(as_task(task(parameters, robots_at(i, view, view))), view, i)

    return ask_limit if behavior.limits else ask
