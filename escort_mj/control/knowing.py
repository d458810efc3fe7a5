"""What each robot knows, step by step: it looks, tells, hears, and estimates where the target is."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from escort_mj.components.component import block_at, number_of
from escort_mj.components.setup import MissionSetup
from escort_mj.control.custom.calls import custom_estimator
from escort_mj.control.members import asker
from escort_mj.control.messages import NEVER, begin_radio, send
from escort_mj.estimators import ESTIMATORS
from escort_mj.knowledge.auction import begin_auction, hear_bids
from escort_mj.knowledge.belief import LEAST_VARIANCE, carry, target_shown, target_speed_shown
from escort_mj.knowledge.links import NOBODY, radio_of
from escort_mj.knowledge.sight import sight_of, sight_target
from escort_mj.native.fields import Fields, Value
from escort_mj.native.kernels import inlined
from escort_mj.native.lanes import (
    WIDTH,
    copy_numbers,
    load,
    load_rows,
    stack_rows,
)
from escort_mj.native.on_demand import on_demand_unrolled
from escort_mj.native.vectors import numbers_from, part_at, set_numbers, set_rows
from escort_mj.numerics.gaussian import START, normals
from escort_mj.plan import Plan, State

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


UNSURE = -1.0  # in place of a density: there is no covariance


class EstimatorParameters(Fields):
    """Which estimator robots have."""

    estimator: Annotated[int, Value("1", "place in ESTIMATORS")]
    estimator_place: Annotated[int, Value("1", "where its block in `parameters` begins")]
    estimate_moves: Annotated[bool, Value("1", "whether estimates move on between two measurements")]
    estimate_density: Annotated[
        float, Value("m^2/s^3", "of the noise that it expects; -1 where it does not say how sure it is")
    ]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        return {
            "estimator": number_of(setup.estimator, ESTIMATORS),
            "estimator_place": setup.estimator,
            "estimate_moves": setup.estimator.predicts,
            "estimate_density": setup.estimator.density if setup.estimator.has_covariance else UNSURE,
        }


@on_demand_unrolled
def know(plan: Plan, state: State) -> None:
    """Lets robots look, send and hear, as far as that is due, and moves their estimates on.

    Args:
        plan: Gives sight, radio and estimator.
        state: Gives time, truth and measurements; beliefs, messages and estimates are written.
    """
    n, step, talks = state.q.shape[0], int(state.step[0]), state.link_from.shape[0] > 0
    first = state.evaluated[0] == 0.0
    for i in range(n if first else state.told.shape[0]):
        if first or state.told[i] != 0.0:
            _begin(i, 0 if first else step, plan, state)
    if first:
        if talks:
            begin_radio(plan, state)
        if plan.auctioned:
            begin_auction(plan, state)
    if step % max(round(1.0 / (sight_of(plan).rate * plan.timestep)), 1) == 0:
        sight_target(plan, state)
        state.message[0] = -1.0
        for i in range(n):
            if state.target_seen[i] != 0.0:
                _update(plan.estimator, block_at(plan.estimator_place, plan), i, plan, state)
    if talks and step >= state.radio_next[0]:
        send(plan, state)
    for i in range(n):
        state.team_news[i] = 0.0 if talks else 1.0
    if talks and step >= state.radio_next[1]:
        _deliver(step, plan, state)
    _move_estimates(plan, state)
    if state.sampled[0] != 0.0 or state.steps.shape[0] > 0:
        _note(plan, state)


@inlined
def _begin(i: int, draw: int, plan: Plan, state: State) -> None:
    """Starts with what robot i is told of its target, before the mission or when it has another one."""
    p, size = state.q.shape[1], state.belief.shape[1]
    drawn = state.belief_work[0, :size]
    normals(size, plan.seed, 1, START, i, draw, drawn)
    for k in range(size * size):
        state.belief_covariance[i, k] = 0.0
    for k in range(size):
        deviation = plan.start_deviation[k // p]
        state.belief[i, k] = deviation * drawn[k]
        state.belief_covariance[i, (size + 1) * k] = max(deviation * deviation, LEAST_VARIANCE)
    c, c_dot = target_shown(i, plan, state), target_speed_shown(i, plan, state)
    set_numbers(state.belief[i], 0, numbers_from(state, state.belief[i], 0) + c)
    set_numbers(state.belief[i], p, numbers_from(state, state.belief[i], p) + c_dot)
    state.belief_time[i] = state.belief_fix[i] = state.time[0]


@inlined
def _deliver(step: int, plan: Plan, state: State) -> None:
    """Hands messages over that arrive now: slot by slot, the oldest first."""
    (n, slots), depth, upcoming = state.link_from.shape, state.sent_step.shape[1], NEVER
    p = state.q.shape[1]
    for i in range(n):
        for s in range(slots):
            j = int(state.link_from[i, s])
            if j < 0:
                continue
            link, newest = i * slots + s, int(state.messages_sent[j])
            for number in range(max(newest - depth, 0), newest):
                arrival = state.link_arrival[link, number % depth]
                if arrival < 0.0:
                    continue
                if arrival > step:
                    upcoming = min(upcoming, arrival)
                    continue
                state.link_arrival[link, number % depth] = NOBODY
                state.messages_heard[i] += 1.0
                if state.sent_step[j, number % depth] > state.link_step[i, s]:
                    state.link_step[i, s] = state.sent_step[j, number % depth]
                    message = j * depth + number % depth
                    copy_numbers(state.sent_position[message], state.heard_position[link], p)
                    copy_numbers(state.sent_velocity[message], state.heard_velocity[link], p)
                    if plan.team_radius.shape[0] > 0 and not _of_own_targets(i, s, message, state):
                        continue
                    state.team_news[i] = 1.0
                    _agree(i, message, state.link_step[i, s], plan, state)
                    if plan.auctioned:
                        hear_bids(i, message, plan, state)
                    state.message[0] = message
                    _update(plan.estimator, block_at(plan.estimator_place, plan), i, plan, state)
    state.radio_next[1] = upcoming


@inlined
def _of_own_targets(i: int, s: int, message: int, state: State) -> bool:
    """Whether a message, the newest in slot s of robot i, is about the targets that its team has now."""
    team = state.member_of[i]
    return state.sent_team[message] == team and state.link_step[i, s] >= state.team_aimed[int(team) - 1]


@inlined
def _agree(i: int, message: int, sent: float, plan: Plan, state: State) -> None:
    """Turns the figure of robot i toward that of a robot that it hears: a step of a consensus."""
    p, share = state.q.shape[1], 1.0 / (state.link_from.shape[1] + 1.0)
    if plan.team_radius.shape[0] > 0 and sent < state.team_formed[int(state.member_of[i]) - 1]:
        return  # that was another figure
    for a in range(p):
        for b in range(p):
            off = state.sent_rotation[message, a * p + b] - state.rotation[i, a, b]
            state.rotation[i, a, b] += share * off


@inlined
def _move_estimates(plan: Plan, state: State) -> None:
    """Writes where robots believe the target to be now, eight of them at once."""
    n, p = state.q.shape
    size = state.belief.shape[1]
    rows = stack_rows(3 * p)
    moves = 1.0 if plan.estimate_moves else 0.0
    for i in range(0, n, WIDTH):
        load_rows(state.belief, i, rows[:size])
        elapsed = moves * (state.time[0] - load(state.belief_time, i))
        place, speed = part_at(state, rows, 0), part_at(state, rows, p)
        if size > 2 * p:
            bend = part_at(state, rows, 2 * p)
            place = place + elapsed * (speed + 0.5 * elapsed * bend)
            speed = speed + elapsed * bend
        else:
            place = place + elapsed * speed
        set_rows(state.target_estimate, i, place)
        set_rows(state.target_velocity_estimate, i, speed)


@inlined
def _note(plan: Plan, state: State) -> None:
    """Writes what is recorded only: how sure robots are, how old what they know is, and whom they hear."""
    n, p = state.q.shape
    slots, size = state.link_from.shape[1], state.belief.shape[1]
    x, covariance = state.belief_work[0, :size], state.belief_work[1]
    timeout = radio_of(plan).timeout if slots > 0 else 0.0
    for i in range(n):
        state.information_age[i] = state.time[0] - state.belief_fix[i]
        for k in range(size * size):
            covariance[k] = state.belief_covariance[i, k]
        carry(x, covariance, p, state.time[0] - state.belief_time[i], plan.estimate_density)
        for a in range(p):
            for b in range(p):
                sure = plan.estimate_density != UNSURE
                state.target_covariance[i, a * p + b] = covariance[a * size + b] if sure else 0.0
        for s in range(slots):
            age = (state.step[0] - state.link_step[i, s]) * plan.timestep
            known = state.link_step[i, s] >= 0.0 and age <= timeout
            state.heard_from[i, s] = state.link_from[i, s] + 1.0 if known else 0.0


_update = asker(ESTIMATORS, custom_estimator, on_demand_unrolled)
