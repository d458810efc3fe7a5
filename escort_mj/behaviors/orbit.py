"""Circle the target at a given rate: the even figure of `vertices`, which turns."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from escort_mj.behaviors.robots import Robots
from escort_mj.behaviors.task import Task, across
from escort_mj.behaviors.vertices import Vertices
from escort_mj.native.kernels import inlined_once
from escort_mj.native.vectors import quarter_turn

toward_vertex = inlined_once(Vertices.task)


class Orbit(Vertices):
    """Spread the robots evenly, as `vertices` does, and let them circle the target.

    With q the position of the robot and c that of the target, the behavior adds rate * A (q - c) to the
    velocity that `vertices` demands. A is the quarter turn in the plane of the first two axes, so the added
    motion is a rigid rotation and the formation stays even. Robots on the axis of rotation stay there.
    """

    behavior: Literal["orbit"] = "orbit"  # type: ignore[assignment]
    rate: Annotated[float, Field(ge=-100.0, le=100.0)] = 0.2
    """Angular rate, counterclockwise from the first axis to the second [rad/s]."""

    def task(self, r: Robots) -> Task:
        """Return the task of `vertices` with the rotation added: it is across q - c, as the task is."""
        task: Task = toward_vertex(self, r)
        return across(task.x, task.velocity + self.rate * quarter_turn(task.x), task.error)
