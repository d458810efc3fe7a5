"""The event trigger: a robot's outer loop runs only when its situation has changed enough."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import NonNegativeFloat, PositiveFloat

from escort_mj.behaviors.robots import robots_at
from escort_mj.components.component import Component, block_at, reader
from escort_mj.components.found import shipped
from escort_mj.components.setup import MissionSetup
from escort_mj.control.nsb import task_of
from escort_mj.knowledge.belief import target_place, target_speed
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import inlined, merged
from escort_mj.native.lanes import WIDTH, any_of, everywhere, load, store
from escort_mj.native.on_demand import on_demand_unrolled
from escort_mj.native.vectors import norm, numbers_at, set_numbers_at, where
from escort_mj.plan import Plan, State

Mask = NDArray[np.bool_]

ALWAYS = -1  # in place of a trigger's block


class Trigger(Component):
    """Condition for updates of a robot's reference velocity, which is held in between (zero-order hold).

    A robot updates its reference velocity when it has moved, relative to the target, by more than `distance
    + share * |w| / gain` since the last update. Here w is the held velocity relative to the target, and
    gain is that of the first escort behavior; |w| / gain approximates the remaining distance. A robot also
    updates while avoidance is active, and when its phase changes or any robot fails. Outer loops that keep
    conditions on velocities keep them at every step.
    """

    distance: PositiveFloat = 0.05
    """Motion that triggers an update where no distance remains [m]; use more than twice the measurement
    noise, so that noise alone triggers no update."""
    share: NonNegativeFloat = 0.1
    """Additional motion required for an update, as a share of the remaining distance [1]."""
    dwell: NonNegativeFloat = 0.02
    """Minimum time between two updates [s]."""
    longest: PositiveFloat = 0.1
    """Maximum time between two updates [s]."""


class TriggerParameters(Fields):
    """When robots compute their reference velocity again: the numbers are those of `Trigger`."""

    trigger_place: Annotated[
        int, Value("1", "where its block in `parameters` begins; -1 where the outer loop runs at every step")
    ]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        return {"trigger_place": setup.trigger or ALWAYS}


shipped.add(Trigger)
read_trigger = reader(Trigger)


class TriggerState(Fields):
    """The situation of each robot at its last update, and whether it updates now."""

    held_place: Annotated[Array, "n", "p", Value("m", "position relative to the target")]
    held_since: Annotated[Array, "n", Value("s", "time of the update")]
    held_in: Annotated[Array, "n", Value("1", "phase that ruled, from 1; 0 before the first update")]
    held_with: Annotated[Array, "n", Value("1", "how many robots were lost")]
    fresh: Annotated[Array, "n", Value("1", "1 where the outer loop runs now")]


@inlined
def refresh(plan: Plan, state: State) -> bool:
    """Decides who runs the outer loop now, and notes the situation of those who do.

    Args:
        plan: Gives the trigger.
        state: `fresh` is written, and `held` for the robots that are to run.

    Returns:
        Whether anybody runs it.
    """
    n = state.q.shape[0]
    if plan.trigger_place == ALWAYS:
        for i in range(n):
            state.fresh[i] = 1.0
        return True
    return _refresh_some(plan, state)


@on_demand_unrolled
def _refresh_some(plan: Plan, state: State) -> bool:
    """Lets those robots run the outer loop that have reason to; returns whether anybody has."""
    n, someone = state.q.shape[0], False
    losses = 0.0
    for i in range(n):
        losses += state.lost[i]
    _note_intrusions(plan, state)
    for i in range(n):
        fires = state.lost[i] != 0.0 or state.held_with[i] != losses or _fires(i, plan, state)
        state.fresh[i] = 1.0 if fires else 0.0
        someone = someone or fires
        if fires:
            place = numbers_at(state, state.q_measured, i) - target_place(i, plan, state)
            set_numbers_at(state.held_place, i, place)
            state.held_since[i] = state.time[0]
            state.held_in[i] = state.phase[i] + 1.0
            state.held_with[i] = losses
    return someone


@merged
def _note_intrusions(plan: Plan, state: State) -> None:
    """Sets `fresh` to 1 for robots into whose safe sphere something intrudes, to 0 for the others."""
    for i in range(0, state.q.shape[0], WIDTH):
        r, found = robots_at(i, plan, state), everywhere(0.0)
        for f in range(plan.phase_first.shape[0]):
            mine = abs(load(state.phase, i) - float(f)) < 0.5
            first = int(plan.phase_first[f])
            for level in range(first, first + int(plan.phase_levels[f])):
                if plan.level_avoids[level] != 0.0 and any_of(mine):
                    found = where(mine & (task_of(level, r).active > 0.5), 1.0, found)
        store(state.fresh, i, found)


@merged
def _fires(i: int, plan: Plan, state: State) -> bool:
    """Whether robot i has reason to compute its reference velocity again."""
    if state.held_in[i] != state.phase[i] + 1.0 or state.avoidance_active[i] != 0.0:
        return True
    if state.fresh[i] != 0.0:  # something intrudes
        return True
    phase, gain = int(state.phase[i]), 0.0
    first = int(plan.phase_first[phase])
    for level in range(first, first + int(plan.phase_levels[phase])):
        if gain == 0.0:
            gain = plan.level_gain[level]
    waited = state.time[0] - state.held_since[i] + 0.5 * plan.timestep
    trigger = read_trigger(block_at(plan.trigger_place, plan), 0)
    if waited < trigger.dwell:
        return False
    if waited >= trigger.longest:
        return True
    place = numbers_at(state, state.q_measured, i) - target_place(i, plan, state)
    drift = where(plan.target_feedforward, target_speed(i, plan, state), 0.0)
    way = norm(numbers_at(state, state.v_d, i) - drift) / gain if gain > 0.0 else 0.0
    moved: float = norm(place - numbers_at(state, state.held_place, i))
    return moved > trigger.distance + trigger.share * way
