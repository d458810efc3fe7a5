"""What robots tell each other: where they are, and what they believe of the target (docs/knowledge.md).

A message waits at its sender until all have it whom it reaches. Each is stamped with the physics step in
which it was sent; what arrives late counts as what it is.
"""

from __future__ import annotations

from typing import Annotated

from escort_mj.components.component import block_at
from escort_mj.control.custom.calls import NEVER, custom_radio
from escort_mj.control.members import asker
from escort_mj.knowledge.auction import tell_bids
from escort_mj.knowledge.links import apart, may_pass, slot_for, take_slot
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import inlined
from escort_mj.native.lanes import copy_numbers
from escort_mj.numerics.gaussian import RADIO, fractions
from escort_mj.plan import Plan, State
from escort_mj.radios import RADIOS
from escort_mj.radios.radio import PASSES, SENDS

LOST = -1


_ask = asker(RADIOS, custom_radio)


@inlined
def schedule(j: int, number: int, plan: Plan, state: State) -> None:
    """Ask when robot j sends a message of a number."""
    state.message_sender[0] = state.message_receiver[0] = j
    state.message_number[0], state.message_distance[0] = number, 0.0
    _draw(1 + plan.robots, j, number, plan, state)
    _ask(plan.radio, block_at(plan.radio_place, plan), SENDS, plan, state)
    state.next_message[j] = state.message_due[0]


@inlined
def next_step(j: int, plan: Plan, state: State) -> float:
    """Return the step at which robot j sends next; never where it is lost."""
    return round(state.next_message[j] / plan.timestep) if state.lost[j] == 0.0 else NEVER


@inlined
def steps_taken(j: int, i: int, s: int, number: int, plan: Plan, state: State) -> int:
    """Return how many steps a message of robot j takes to slot s of robot i; LOST if it is lost."""
    link = i * state.link_from.shape[1] + s
    state.message_sender[0], state.message_receiver[0] = j, i
    state.message_number[0], state.message_distance[0] = number, apart(i, j, plan, state)
    _draw(1 + i, j, number, plan, state)
    for row in range(state.link_kept.shape[1]):
        state.link_memory[row] = state.link_kept[link, row]
    _ask(plan.radio, block_at(plan.radio_place, plan), PASSES, plan, state)
    for row in range(state.link_kept.shape[1]):
        state.link_kept[link, row] = state.link_memory[row]
    taken = round(state.message_delay[0] / plan.timestep)
    return LOST if state.message_lost[0] != 0.0 or taken > plan.radio_longest else taken


@inlined
def _draw(block: int, sender: int, number: int, plan: Plan, state: State) -> None:
    """Draw the random numbers of a message."""
    draws = fractions(plan.seed, block, RADIO, sender, number)
    state.message_draws[0], state.message_draws[1] = draws[0], draws[1]


class MessageState(Fields):
    """Messages sent of late, `depth` of each robot, and what came of those that arrived."""

    next_message: Annotated[Array, "hearing", Value("s", "when the next message is sent")]
    radio_next: Annotated[Array, 2, Value("1", "step at which the next one is sent, or arrives, anywhere")]
    sent_step: Annotated[Array, "hearing", "depth", Value("1", "physics step at which it was sent")]
    sent_position: Annotated[Array, "hearing*depth", "p", Value("m", "where the sender measured itself")]
    sent_velocity: Annotated[Array, "hearing*depth", "p", Value("m/s", "how it measured itself to move")]
    sent_belief: Annotated[Array, "hearing*depth", "believed", Value("m, m/s, m/s^2", "what it believed")]
    sent_covariance: Annotated[
        Array, "hearing*depth", "believed*believed", Value("1", "and how sure it was of it")
    ]
    sent_rotation: Annotated[Array, "hearing*depth", "p*p", Value("1", "how its figure was turned")]
    sent_team: Annotated[
        Array, "hearing*depth", Value("1", "team whose targets that belief is of, from 1; 0 without teams")
    ]
    sent_belief_time: Annotated[Array, "hearing*depth", Value("s", "when that held")]
    sent_fix: Annotated[Array, "hearing*depth", Value("s", "time of the newest measurement in it")]
    heard_position: Annotated[Array, "hearing*slots", "p", Value("m", "of the robot heard in each slot")]
    heard_velocity: Annotated[Array, "hearing*slots", "p", Value("m/s", "likewise")]


@inlined
def begin_radio(plan: Plan, state: State) -> None:
    """Start with nothing heard and nothing on its way."""
    n, slots = state.link_from.shape
    for i in range(n):
        for s in range(slots):
            take_slot(i, s, int(plan.senders[i, s]), state)
        state.next_message[i] = -plan.timestep
        schedule(i, 0, plan, state)
    state.radio_next[0], state.radio_next[1] = 0.0, NEVER


@inlined
def send(plan: Plan, state: State) -> None:
    """Send the messages that are due at the present step, and find out whom they reach, and when."""
    n, p = state.q.shape
    step, depth = int(state.step[0]), state.sent_step.shape[1]
    upcoming = NEVER
    for j in range(n):
        if next_step(j, plan, state) <= step:
            number = int(state.messages_sent[j])
            _compose(j, j * depth + number % depth, plan, state)
            state.sent_step[j, number % depth] = step
            state.messages_sent[j] = number + 1.0
            schedule(j, number + 1, plan, state)
            _spread(j, number, step, plan, state)
        upcoming = min(upcoming, next_step(j, plan, state))
    state.radio_next[0] = upcoming


@inlined
def _compose(j: int, message: int, plan: Plan, state: State) -> None:
    """Write a message: what a robot knows of itself and of the target."""
    p, size = state.q.shape[1], state.belief.shape[1]
    copy_numbers(state.q_measured[j], state.sent_position[message], p)
    copy_numbers(state.v_measured[j], state.sent_velocity[message], p)
    copy_numbers(state.belief[j], state.sent_belief[message], size)
    copy_numbers(state.belief_covariance[j], state.sent_covariance[message], size * size)
    copy_numbers(state.rotation[j], state.sent_rotation[message], p * p)
    state.sent_belief_time[message], state.sent_fix[message] = state.belief_time[j], state.belief_fix[j]
    if plan.team_radius.shape[0] > 0:
        state.sent_team[message] = state.member_of[j]
    if plan.auctioned:
        tell_bids(j, message, state)


@inlined
def _spread(j: int, number: int, step: int, plan: Plan, state: State) -> None:
    """Send a message of robot j on its way to everybody whom it reaches."""
    (n, slots), depth = state.link_from.shape, state.sent_step.shape[1]
    for i in range(n):
        if i == j or state.lost[i] != 0.0:
            continue
        s = -1
        if plan.radio_listed:
            for slot in range(slots):
                if int(state.link_from[i, slot]) == j:
                    s = slot
            if s < 0 or not may_pass(i, j, plan, state):
                continue
        else:
            if not may_pass(i, j, plan, state):
                continue
            s = slot_for(i, j, plan, state)
            if s < 0:
                continue
            if int(state.link_from[i, s]) != j:
                take_slot(i, s, j, state)
        taken = steps_taken(j, i, s, number, plan, state)
        if taken == LOST:
            state.messages_lost[i] += 1.0
        else:
            state.link_arrival[i * slots + s, number % depth] = step + taken
            state.radio_next[1] = min(state.radio_next[1], step + taken)
