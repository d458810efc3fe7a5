"""Base of policies: where a body wants to go that has a will of its own."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, ClassVar, NamedTuple, Self

from pydantic import Field

from escort_mj.components.component import Component
from escort_mj.components.movers import MEMORY
from escort_mj.native.fields import Array
from escort_mj.native.memory import layout_with

RESTS, ACTS = 0, 1
"""What a policy returns: whether it acts on its purpose at the moment."""


class PolicyView(NamedTuple):
    """What a policy sees of the mission, all of it true and at once; n robots, p axes, m obstacles."""

    timestep: float  # [s]
    seed: int  # of the mission's random streams
    radius: float  # of the mission [m]
    time: Annotated[Array, 1]  # [s]
    q: Annotated[Array, "n", "p"]  # position of the robots [m]
    v: Annotated[Array, "n", "p"]  # their velocity [m/s]
    robot_radius: Annotated[Array, "n"]  # [m]
    target_position: Annotated[Array, "p"]  # [m]
    target_velocity: Annotated[Array, "p"]  # [m/s]
    obstacle_position: Annotated[Array, "m", "p"]  # centers [m]
    obstacle_velocity: Annotated[Array, "m", "p"]  # [m/s]
    obstacle_radius: Annotated[Array, "m"]  # 0 for those that are not spheres [m]
    networks: Annotated[Array, "networks"]  # of learned policies
    mover_position: Annotated[Array, "movers", "p"]  # of the bodies with a drive, its own among them [m]
    mover_velocity: Annotated[Array, "movers", "p"]  # [m/s]
    mover_start: Annotated[Array, "movers", "p"]  # where they begin [m]
    mover_wish: Annotated[Array, "movers", "p"]  # written: the velocity that it wants [m/s]
    mover_memory: Annotated[Array, "movers", MEMORY]  # written: what it keeps, at first 0


class Policy(Component):
    """The will of a body with its own drive: a target that escapes, or an opponent that wants to reach it.

    A subclass has a key `policy` with its name, parameters, and its method `velocity`. It writes
    the velocity that one body wants to `mover_wish[body]`, and what it keeps to `mover_memory[body]`. The
    body's drive follows as far as its force limit allows, and MuJoCo's contacts have the last word.
    """

    method: ClassVar[str] = "velocity"
    view: ClassVar[type] = PolicyView
    outputs: ClassVar[tuple[str, ...]] = ("mover_wish", "mover_memory")
    answers: ClassVar[str | None] = "ACTS or RESTS"
    gives: ClassVar[str] = "body {} a velocity"
    seeks: ClassVar[bool] = False
    """Whether it wants to reach the target, as opponents do."""

    policy: str
    speed: Annotated[float, Field(gt=0.0, le=1e3)] = 1.0
    """Speed at which the body moves [m/s]."""

    def among(self, bodies: Sequence[str]) -> Self:
        """Return it in a mission with bodies of these names: robots, the target, then obstacles."""
        return self

    if TYPE_CHECKING:

        def velocity(self, view: PolicyView, body: int) -> int:
            """Write the velocity that a body wants.

            Args:
                view: What it sees.
                body: Which of the bodies with a drive, from 0.

            Returns:
                `ACTS` or `RESTS`.
            """


def policy_view(plan: int, state: int, axes: int) -> PolicyView:
    """View what policies see at the addresses of a plan and a state; nothing is copied or owned."""
    view: PolicyView = layout_with(PolicyView).read(PolicyView, plan, state)
    return view
