"""Where a robot knows its teammates to be: as it has heard, or as the team's sensors show them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import inlined

if TYPE_CHECKING:
    from escort_mj.memory.layout import Plan, State


class TeammateState(Fields):
    """The team as one robot knows it, scratch, and who has learned of teammates."""

    mate_position: Annotated[Array, "informed", "p", Value("m", "of each robot")]
    mate_unknown: Annotated[Array, "informed", Value("1", "1 for robots that it does not know of")]
    team_news: Annotated[Array, "informed", Value("1", "1 where a robot learned of teammates in this step")]


@inlined
def know_teammates(robot: int, plan: Plan, state: State) -> None:
    """Write where a robot knows its teammates to be: `mate_position`, `mate_unknown`.

    With a radio, these are the teammates that it has heard within the timeout, moved on with their
    velocities; without one, all that are left.
    """
    n, p, slots = state.q.shape[0], state.q.shape[1], state.link_from.shape[1]
    heard = state.link_from.shape[0] > 0
    for j in range(n):
        state.mate_unknown[j] = 1.0 if heard and j != robot else state.lost[j]
        for k in range(p):
            state.mate_position[j, k] = state.q_measured[j, k]
    if not heard:
        return
    for s in range(slots):
        j, link = int(state.link_from[robot, s]), robot * slots + s
        age = (state.step[0] - state.link_step[robot, s]) * plan.timestep
        if j >= 0 and state.link_step[robot, s] >= 0.0 and age <= plan.radio_timeout:
            state.mate_unknown[j] = state.lost[j]
            for k in range(p):
                moved = age * state.heard_velocity[link, k]
                state.mate_position[j, k] = state.heard_position[link, k] + moved
