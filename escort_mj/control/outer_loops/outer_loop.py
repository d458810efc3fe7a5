"""Base of outer loops: how a robot's behaviors become one velocity."""

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from escort_mj.components.component import Component
from escort_mj.components.parameters import UNLIMITED
from escort_mj.components.setup import MissionSetup
from escort_mj.native.kernels import merged
from escort_mj.native.vectors import dot, norm, numbers_at, set_numbers_at
from escort_mj.plan import Plan, State

Mask = NDArray[np.bool_]


class OuterLoop(Component):
    """How a robot's behaviors become one velocity.

    A subclass has a key `loop` with its name and parameters. What it does beyond composing behaviors by
    priority is `velocity_lanes(self, i, phase, plan, state)`, which writes `v_d` and `avoidance_active` of
    robots i to i + 7, as far as the phase rules them.
    """

    plural: ClassVar[str] = "outer-loops"
    named_by: ClassVar[str] = "loop"
    default_name: ClassVar[str | None] = "set_based"
    of_plugins: ClassVar[bool] = False
    title: ClassVar[str]
    """What tables and figures call it."""
    composes: ClassVar[bool] = True
    """Whether behaviors are composed by priority first."""
    avoids: ClassVar[bool] = False
    """Whether it keeps distances to bodies itself, in place of the tasks of behaviors that keep some."""
    looks_far: ClassVar[bool] = False
    """Whether it matters how far away an obstacle is, however far that is."""
    meets: ClassVar[bool] = False
    """Whether the velocities of teammates matter to it."""

    loop: str

    def target_margin(self, setup: MissionSetup) -> float:
        """Return the distance that it keeps to the target [m]."""
        return 0.0


@merged
def has_stack(robot: int, phase: int, plan: "Plan", state: "State") -> bool:
    """Whether a robot is left and has the priority stack of a phase, be its velocity new or held."""
    return (plan.alike or int(state.phase[robot]) == phase) and state.lost[robot] == 0.0


@merged
def slow_down(robot: int, plan: "Plan", state: "State") -> None:
    """Keeps the speed limit, along the same direction."""
    v = numbers_at(state, state.v_d, robot)
    if plan.max_speed < UNLIMITED and dot(v, v) > plan.max_speed * plan.max_speed:
        set_numbers_at(state.v_d, robot, (plan.max_speed / norm(v)) * v)
