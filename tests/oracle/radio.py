"""Messages in queues, their losses and delays, and an auction by them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from escort_mj.control.setup import Setup
from escort_mj.knowledge.auction import ABOVE_ALL, NEAR
from escort_mj.knowledge.links import NOBODY
from escort_mj.numerics.gaussian import RADIO
from escort_mj.radios import Periodic
from tests.oracle.estimators import Belief
from tests.oracle.noise import uniforms
from tests.oracle.rays import hidden

Array = NDArray[np.float64]


class Auction:
    """What each robot knows of the bids.

    Attributes:
        bid: Highest for each vertex, by robot, shape (n, n).
        bidder: Whose it is, from 1, 0 for nobody, likewise.
        won: Vertex that each robot takes, from 0, -1 for none, shape (n,).
    """

    def __init__(self, ways: Array, vertices: Array) -> None:
        """Let each robot bid.

        Args:
            ways: From where each robot believes the target to where it measures itself, shape (n, p) [m].
            vertices: Unit vectors, shape (n, p).
        """
        self._vertices = vertices
        size = np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), NEAR)
        self.worth = ABOVE_ALL + ways / size @ vertices.T
        self.bid, self.bidder = np.zeros_like(self.worth), np.zeros(self.worth.shape, dtype=np.int64)
        self.won = np.full(len(ways), -1)
        for i in range(len(ways)):
            self._choose(i)

    def hear(self, i: int, bid: Array, bidder: NDArray[np.int64]) -> None:
        """Take over higher bids, and bid for another vertex where robot i has been outbid."""
        lower = (bidder > 0) & (bidder < self.bidder[i])
        higher = (bid > self.bid[i]) | ((bid == self.bid[i]) & lower)
        self.bid[i][higher], self.bidder[i][higher] = bid[higher], bidder[higher]
        if self.won[i] < 0 or self.bidder[i, self.won[i]] != i + 1:
            self._choose(i)

    def _choose(self, i: int) -> None:
        worth = self.worth[i]
        free = (worth > self.bid[i]) | ((worth == self.bid[i]) & (i + 1 < self.bidder[i]))
        self.won[i] = int(np.where(free, worth, 0.0).argmax()) if free.any() else -1
        if free.any():
            self.bid[i, self.won[i]], self.bidder[i, self.won[i]] = worth[self.won[i]], i + 1

    def taken(self) -> Array:
        """Return the unit vector of each robot's vertex, 0 for none, shape (n, p)."""
        return np.where(self.won[:, None] >= 0, self._vertices[self.won], 0.0)

    def known(self, i: int) -> Array:
        """Return which vertices robot i believes others to take, NaN where it does not know, shape (n, p)."""
        found = np.full(self._vertices.shape, np.nan)
        for vertex, bidder in zip(self._vertices, self.bidder[i], strict=True):
            if bidder > 0:
                found[bidder - 1] = vertex
        return found


def unlimited(value: float | None) -> float:
    """Return a parameter that may be null for no limit."""
    return np.inf if value is None else value


def distances(q: Array, setup: Setup) -> Array:
    """Return the distances of all robots as the range of the radio is measured, shape (n, n) [m]."""
    gaps = np.linalg.norm(q[:, None] - q, axis=2)
    if setup.radio is not None and setup.radio.measure == "surface":
        gaps = gaps - setup.robot_radius[:, None] - setup.robot_radius
    return np.asarray(gaps)


def passes(t: float, q: Array, gaps: Array, setup: Setup) -> NDArray[np.bool_]:
    """Return who may hear whom at a time, from true positions and distances, shape (n, n)."""
    assert setup.radio is not None
    found = gaps <= unlimited(setup.radio.range)
    for each in setup.radio.blackouts:
        if each.after <= t + 0.5 * setup.timestep < unlimited(each.before):
            part = np.array(each.parts(setup.count))
            found &= part[:, None] == part
    if setup.radio.blocked:
        for i, j in np.argwhere(found):
            found[i, j] = not hidden(q[i], q[j] - q[i], setup)
    return found


def fate(sender: int, receiver: int, number: int, bad: bool, setup: Setup) -> tuple[bool, int]:
    """Return whether a message is lost, and how many steps it takes.

    Args:
        sender: From 0.
        receiver: From 0.
        number: Of the message, from 0.
        bad: Whether the link has lost the message before.
        setup: Gives the radio.
    """
    radio = setup.radio
    assert radio is not None
    chance, late = uniforms(2, setup.seed, RADIO, sender, number, 1 + receiver)
    least, most = (round(time / setup.timestep) for time in (radio.least_delay, radio.most_delay))
    lost = chance >= radio.recovers if bad else chance < radio.fails
    return bool(lost), int(least + np.floor(late * (most - least + 1.0)))


def lateness(sender: int, number: int, setup: Setup) -> int:
    """Return by how many steps a message is sent late."""
    radio = setup.radio
    assert isinstance(radio, Periodic)
    late = uniforms(1, setup.seed, RADIO, sender, number, 1 + setup.count)[0]
    return int(np.floor(late * (round(radio.jitter / setup.timestep) + 1.0)))


@dataclass
class Message:
    """One message.

    Attributes:
        sender: From 0.
        step: Physics step in which it was sent.
        position: Of the sender, as it measured it, shape (p,) [m].
        velocity: Likewise [m/s].
        belief: What the sender believes of the target.
        rotation: How it has turned its figure, shape (p, p).
        team: Of the sender, from 0, of whose targets it tells.
        bids: The highest bids for vertices that it knows of, and whose they are, shape (n,) each.
    """

    sender: int
    step: int
    position: Array
    velocity: Array
    belief: Belief
    rotation: Array
    team: int = 0
    bids: tuple[Array, NDArray[np.int64]] | None = None


@dataclass
class Link:
    """What one robot hears of another.

    Attributes:
        sender: The other one, from 0; -1 for nobody yet.
        bad: Whether the last message was lost.
        newest: The newest message that arrived; None for none.
        coming: Messages on their way, with the steps at which they arrive.
    """

    sender: int
    bad: bool = False
    newest: Message | None = None
    coming: list[tuple[int, Message]] = field(default_factory=list)


class Mail:
    """All messages of a team."""

    def __init__(self, setup: Setup) -> None:
        assert isinstance(setup.radio, Periodic)
        self.setup, self._radio, n = setup, setup.radio, setup.count
        senders = setup.radio.senders(n)
        self._listed = bool((senders >= 0).any())
        self._every = max(round(1.0 / (unlimited(setup.radio.rate) * setup.timestep)), 1)
        self.links = [[Link(int(sender)) for sender in row] for row in senders]
        self._next = [lateness(j, 0, setup) for j in range(n)]
        self.sent, self.heard, self.lost = np.zeros(n), np.zeros(n), np.zeros(n)

    def send(self, t: float, q: Array, write: Callable[[int, int], Message], gone: NDArray[np.bool_]) -> None:
        """Send what is due.

        Args:
            t: Time [s].
            q: True positions, shape (n, p) [m].
            write: Makes the message of a robot at a step.
            gone: Robots that have failed, shape (n,).
        """
        setup, step = self.setup, round(t / self.setup.timestep)
        gaps = distances(q, setup)
        reached = passes(t, q, gaps, setup)
        for j in range(setup.count):
            if self._next[j] > step or gone[j]:
                continue
            number, message = int(self.sent[j]), write(j, step)
            self.sent[j] += 1
            self._next[j] = (number + 1) * self._every + lateness(j, number + 1, setup)
            for i in range(setup.count):
                if i == j or gone[i] or not reached[i, j]:
                    continue
                link = self._link(i, j, gaps[i], t)
                if link is None:
                    continue
                link.bad, taken = fate(j, i, number, link.bad, setup)
                if link.bad:
                    self.lost[i] += 1
                else:
                    link.coming.append((step + taken, message))

    def _link(self, i: int, j: int, gaps: Array, t: float) -> Link | None:
        """Return the link on which robot i hears robot j; None where it does not."""
        links, dt = self.links[i], self.setup.timestep
        known = [link for link in links if link.sender == j]
        if known or self._listed:
            return known[0] if known else None
        for place, link in enumerate(links):
            stamp = link.newest.step if link.newest else int(NOBODY)
            stale = round(t / dt) - stamp > unlimited(self._radio.timeout) / dt and not link.coming
            if link.sender < 0 or stale:
                links[place] = Link(j)
                return links[place]
        place = int(np.argmax([gaps[link.sender] for link in links]))
        if gaps[links[place].sender] <= gaps[j]:
            return None
        links[place] = Link(j)
        return links[place]

    def deliver(self, i: int, t: float) -> list[Message]:
        """Return the messages that reach robot i now: slot by slot, the oldest first."""
        step, found = round(t / self.setup.timestep), []
        for link in self.links[i]:
            due = [message for arrival, message in link.coming if arrival <= step]
            link.coming = [each for each in link.coming if each[0] > step]
            for message in sorted(due, key=lambda message: message.step):
                self.heard[i] += 1
                if link.newest is None or message.step > link.newest.step:
                    link.newest = message
                    found.append(message)
        return found

    def known(self, i: int, t: float) -> list[tuple[int, float, Message]]:
        """Return who counts as heard by robot i, the age of its newest message [s], and this message."""
        found = []
        for link in self.links[i]:
            if link.newest is not None:
                dt = self.setup.timestep
                age = (round(t / dt) - link.newest.step) * dt
                if age <= unlimited(self._radio.timeout):
                    found.append((link.sender, age, link.newest))
        return found
