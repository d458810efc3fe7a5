"""Who hears whom: the graph, the range, silence, loss and delay of messages (docs/knowledge.md)."""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.components.rays import is_between
from escort_mj.components.setup import MissionSetup
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import inlined, stack_memory, vector_at
from escort_mj.numerics.gaussian import RADIO, fractions
from escort_mj.plan import Plan, State

NOBODY = -1.0


class Silence(NamedTuple):
    """A time in which messages do not pass between parts of the team.

    Attributes:
        after: Its start [s].
        before: Its end [s].
        part: Number of each robot's part, shape (n,).
    """

    after: float
    before: float
    part: tuple[int, ...]


class Radio(NamedTuple):
    """How robots communicate.

    Attributes:
        senders: For each robot and slot the robot heard there, from 0; -1 where whoever is nearest is heard,
            shape (n, slots).
        every: Physics steps between two messages of a robot.
        jitter: By how many steps at most a message is sent late.
        delay: Least and greatest number of steps that a message takes.
        reach: How far robots hear each other [m].
        surface: Whether that is measured between surfaces.
        fail: Probability that a link that has passed a message loses the next one.
        recover: Probability that a link that has lost a message passes the next one.
        timeout: Age from which on what was heard does not count [s].
        silences: When parts of the team do not hear each other.
        blocked: Whether messages do not pass through obstacles.
    """

    senders: NDArray[np.int64]
    every: int = 1
    jitter: int = 0
    delay: tuple[int, int] = (0, 0)
    reach: float = math.inf
    surface: bool = False
    fail: float = 0.0
    recover: float = 1.0
    timeout: float = math.inf
    silences: tuple[Silence, ...] = ()
    blocked: bool = False

    @property
    def listed(self) -> bool:
        """Whether it is fixed who is heard in each slot."""
        return bool((self.senders >= 0).any())

    @property
    def depth(self) -> int:
        """How many messages of one robot may be on their way, and one more."""
        return (self.delay[1] + self.jitter) // self.every + 2


class LinkParameters(Fields):
    """How robots communicate."""

    senders: Annotated[Array, "hearing", "slots", Value("1", "robot heard in each slot, from 0; -1: any")]
    radio_listed: Annotated[bool, Value("1", "whether it is fixed who is heard in each slot")]
    radio_every: Annotated[int, Value("1", "physics steps between two messages of a robot")]
    radio_jitter: Annotated[int, Value("1", "by how many steps at most a message is sent late")]
    radio_delay: Annotated[Array, 2, Value("1", "least and greatest number of steps that a message takes")]
    radio_reach: Annotated[float, Value("m", "how far robots hear each other")]
    radio_surface: Annotated[float, Value("1", "1 where that is measured between surfaces, else 0")]
    radio_fail: Annotated[float, Value("1", "probability that a good link loses the next message")]
    radio_recover: Annotated[float, Value("1", "probability that a bad link passes the next message")]
    radio_blocked: Annotated[bool, Value("1", "whether messages do not pass through obstacles")]
    radio_timeout: Annotated[float, Value("s", "age from which on what was heard does not count")]
    silence_after: Annotated[Array, "silences", Value("s", "start of each silence")]
    silence_before: Annotated[Array, "silences", Value("s", "end of each silence")]
    silence_part: Annotated[Array, "silences", "n", Value("1", "number of each robot's part of the team")]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        radio = setup.radio or Radio(np.zeros((0, 0), dtype=np.int64))
        return {
            "senders": radio.senders,
            "radio_listed": radio.listed,
            "radio_every": radio.every,
            "radio_jitter": radio.jitter,
            "radio_delay": radio.delay,
            "radio_reach": radio.reach,
            "radio_surface": radio.surface,
            "radio_fail": radio.fail,
            "radio_recover": radio.recover,
            "radio_blocked": radio.blocked,
            "radio_timeout": radio.timeout,
            "silence_after": [silence.after for silence in radio.silences],
            "silence_before": [silence.before for silence in radio.silences],
            "silence_part": np.reshape([silence.part for silence in radio.silences], (-1, setup.count)),
        }


class LinkState(Fields):
    """The links of each robot: whom it hears in which slot, and what is on its way."""

    link_from: Annotated[Array, "hearing", "slots", Value("1", "robot heard there, from 0; -1 for none")]
    link_bad: Annotated[Array, "hearing", "slots", Value("1", "1 after a lost message")]
    link_step: Annotated[
        Array, "hearing", "slots", Value("1", "physics step of the newest message; -1 for none")
    ]
    link_arrival: Annotated[
        Array, "hearing*slots", "depth", Value("1", "step at which each message on its way arrives; -1: none")
    ]


@inlined
def may_pass(i: int, j: int, plan: Plan, state: State) -> bool:
    """Whether robot i is near enough to hear robot j, and neither silence nor an obstacle is between them."""
    late = state.time[0] + 0.5 * plan.timestep
    for w in range(plan.silence_after.shape[0]):
        if plan.silence_after[w] <= late < plan.silence_before[w]:
            if plan.silence_part[w, i] != plan.silence_part[w, j]:
                return False
    if apart(i, j, plan, state) > plan.radio_reach:
        return False
    if not plan.radio_blocked:
        return True
    p = state.q.shape[1]
    way = vector_at(stack_memory(), p)
    for k in range(p):
        way[k] = state.q[j, k] - state.q[i, k]
    return not is_between(state.q[i], way, -1, plan, state)


@inlined
def apart(i: int, j: int, plan: Plan, state: State) -> float:
    """Return the distance of two robots as the range of the radio is measured [m]."""
    square = 0.0
    for k in range(state.q.shape[1]):
        square += (state.q[i, k] - state.q[j, k]) ** 2
    return math.sqrt(square) - plan.radio_surface * (plan.robot_radius[i] + plan.robot_radius[j])


@inlined
def slot_for(i: int, j: int, plan: Plan, state: State) -> int:
    """Return the slot in which robot i hears robot j; -1 where all are taken by robots that are nearer.

    A robot that is heard keeps its slot. A new one gets that of a robot that has not been heard for longer
    than the timeout, or else that of the farthest one, if that is farther away.
    """
    slots, free, farthest, distance = state.link_from.shape[1], -1, -1, apart(i, j, plan, state)
    oldest = plan.radio_timeout / plan.timestep
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
    state.link_from[i, s], state.link_bad[i, s], state.link_step[i, s] = j, 0.0, NOBODY
    for m in range(state.link_arrival.shape[1]):
        state.link_arrival[i * state.link_from.shape[1] + s, m] = NOBODY


@inlined
def is_lost(i: int, s: int, chance: float, plan: Plan, state: State) -> bool:
    """Whether a message to a slot is lost: a chain of a good and a bad state (Gilbert 1960, Elliott 1963)."""
    bad = chance >= plan.radio_recover if state.link_bad[i, s] != 0.0 else chance < plan.radio_fail
    state.link_bad[i, s] = 1.0 if bad else 0.0
    return bad


@inlined
def way_of(sender: int, receiver: int, number: int, plan: Plan) -> tuple[float, int]:
    """Return what decides whether a message is lost, uniform in [0, 1), and how many steps it takes."""
    chance, late, _, _ = fractions(plan.seed, 1 + receiver, RADIO, sender, number)
    least, most = plan.radio_delay[0], plan.radio_delay[1]
    return chance, int(least + math.floor(late * (most - least + 1.0)))


@inlined
def late_by(sender: int, number: int, plan: Plan) -> int:
    """Return by how many steps a message is sent late."""
    if plan.radio_jitter == 0:
        return 0
    late, _, _, _ = fractions(plan.seed, 1 + plan.robot_radius.shape[0], RADIO, sender, number)
    return int(math.floor(late * (plan.radio_jitter + 1.0)))
