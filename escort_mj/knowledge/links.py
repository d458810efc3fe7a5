"""Who hears whom: the graph, the range, silence, loss and delay of messages (docs/knowledge.md)."""

from __future__ import annotations

import math
from typing import Annotated, Any

import numpy as np

from escort_mj.components.component import block_at, number_of, reader
from escort_mj.components.rays import is_between
from escort_mj.components.setup import MissionSetup
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import inlined
from escort_mj.native.vectors import norm, numbers_at
from escort_mj.plan import Plan, State
from escort_mj.radios import RADIOS, Radio

NOBODY = -1.0


class LinkParameters(Fields):
    """How robots communicate."""

    senders: Annotated[Array, "hearing", "slots", Value("1", "robot heard in each slot, from 0; -1: any")]
    radio: Annotated[int, Value("1", "place in RADIOS; their number for a plugin's")]
    radio_place: Annotated[int, Value("1", "where its block in `parameters` begins")]
    radio_listed: Annotated[bool, Value("1", "whether it is fixed who is heard in each slot")]
    radio_longest: Annotated[int, Value("1", "most steps that a message may take")]
    silence_after: Annotated[Array, "silences", Value("s", "start of each silence")]
    silence_before: Annotated[Array, "silences", Value("s", "end of each silence")]
    silence_part: Annotated[Array, "silences", "n", Value("1", "number of each robot's part of the team")]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        radio, n = setup.radio, setup.count
        senders = radio.senders(n) if radio else np.zeros((0, 0), dtype=np.int64)
        blackouts = radio.blackouts if radio else ()
        return {
            "radio": number_of(radio, RADIOS) if radio else 0,
            "radio_place": radio or 0,
            "radio_listed": bool((senders >= 0).any()),
            "radio_longest": radio.longest_steps(setup.timestep) if radio else 0,
            "senders": senders,
            "silence_after": [each.after for each in blackouts],
            "silence_before": [math.inf if each.before is None else each.before for each in blackouts],
            "silence_part": np.reshape([each.parts(n) for each in blackouts], (-1, n)),
        }


class LinkState(Fields):
    """The links of each robot: whom it hears in which slot, and what is on its way."""

    link_from: Annotated[Array, "hearing", "slots", Value("1", "robot heard there, from 0; -1 for none")]
    link_step: Annotated[
        Array, "hearing", "slots", Value("1", "physics step of the newest message; -1 for none")
    ]
    link_arrival: Annotated[
        Array, "hearing*slots", "depth", Value("1", "step at which each message on its way arrives; -1: none")
    ]
    link_kept: Annotated[
        Array, "hearing*slots", "link_memories", Value("1", "the radio's own numbers for each link")
    ]
    message_sender: Annotated[Array, 1, Value("1", "of the message that the radio is asked about, from 0")]
    message_receiver: Annotated[Array, 1, Value("1", "likewise")]
    message_number: Annotated[Array, 1, Value("1", "its number among those of its sender, from 0")]
    message_distance: Annotated[Array, 1, Value("m", "of the two, as the range is measured")]
    message_draws: Annotated[Array, 2, Value("1", "random numbers for it, uniform in [0, 1)")]
    link_memory: Annotated[Array, "link_memories", Value("1", "the radio's own numbers for the link")]
    link_memory_next: Annotated[Array, "link_memories", Value("1", "what becomes of these")]
    message_due: Annotated[Array, 1, Value("s", "what the radio says: when it is sent")]
    message_lost: Annotated[Array, 1, Value("1", "likewise: 1 if it is lost, else 0")]
    message_delay: Annotated[Array, 1, Value("s", "likewise: how long it is on its way")]


_read = reader(Radio)


@inlined
def radio_of(plan: Plan) -> Any:
    """Return those parameters of the radio that all radios have."""
    return _read(block_at(plan.radio_place, plan), 0)


@inlined
def may_pass(i: int, j: int, plan: Plan, state: State) -> bool:
    """Whether robot i is near enough to hear robot j, and neither silence nor an obstacle is between them."""
    late = state.time[0] + 0.5 * plan.timestep
    for w in range(plan.silence_after.shape[0]):
        if plan.silence_after[w] <= late < plan.silence_before[w]:
            if plan.silence_part[w, i] != plan.silence_part[w, j]:
                return False
    radio = radio_of(plan)
    if apart(i, j, plan, state) > radio.range:
        return False
    if not radio.blocked:
        return True
    q = numbers_at(state, state.q, i)
    return not is_between(q, numbers_at(state, state.q, j) - q, -1, plan, state)


@inlined
def apart(i: int, j: int, plan: Plan, state: State) -> float:
    """Return the distance of two robots as the range of the radio is measured [m]."""
    way = numbers_at(state, state.q, i) - numbers_at(state, state.q, j)
    return norm(way) - radio_of(plan).measure * (plan.robot_radius[i] + plan.robot_radius[j])


@inlined
def slot_for(i: int, j: int, plan: Plan, state: State) -> int:
    """Return the slot in which robot i hears robot j; -1 where all are taken by robots that are nearer.

    A robot that is heard keeps its slot. A new one gets that of a robot that has not been heard for longer
    than the timeout, or else that of the farthest one, if that is farther away.
    """
    slots, free, farthest, distance = state.link_from.shape[1], -1, -1, apart(i, j, plan, state)
    oldest = radio_of(plan).timeout / plan.timestep
    for s in range(slots):
        other = int(state.link_from[i, s])
        if other == j:
            return s
        if other < 0 or (
            state.step[0] - state.link_step[i, s] > oldest and not on_its_way(i * slots + s, state)
        ):
            free = s if free < 0 else free
        elif free < 0:
            away = apart(i, other, plan, state)
            if away > distance:
                farthest, distance = s, away
    return free if free >= 0 else farthest


@inlined
def on_its_way(link: int, state: State) -> bool:
    """Whether some message of a link has not arrived yet."""
    for m in range(state.link_arrival.shape[1]):
        if state.link_arrival[link, m] >= 0.0:
            return True
    return False


@inlined
def take_slot(i: int, s: int, j: int, state: State) -> None:
    """Begin to hear robot j in a slot of robot i."""
    state.link_from[i, s], state.link_step[i, s] = j, NOBODY
    link = i * state.link_from.shape[1] + s
    for m in range(state.link_arrival.shape[1]):
        state.link_arrival[link, m] = NOBODY
    for row in range(state.link_kept.shape[1]):
        state.link_kept[link, row] = 0.0
