"""Who takes which vertex: robots that tell each other what they bid agree without anybody who knows all.

The consensus-based auction algorithm (Choi, Brunet, How, Consensus-Based Decentralized Auctions for Robust
Task Allocation, IEEE Transactions on Robotics 25(4), 2009, algorithms 1 and 2): a robot bids for the vertex
that is worth most to it among those that it can win, keeps the highest bid that it knows of for each vertex,
and passes these on. When it hears of a higher bid for its vertex, it bids for another one. What a vertex is
worth does not change, so bids only rise: lost, late and repeated messages do no harm.
"""

from __future__ import annotations

from typing import Annotated, Any

from escort_mj.components.setup import MissionSetup
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import inlined
from escort_mj.native.lanes import copy_numbers
from escort_mj.native.vectors import dot, norm, numbers_at
from escort_mj.plan import Plan, State

ABOVE_ALL = 2.0  # added to the cosine between robot and vertex: bids are positive
NEAR = 1e-9  # m


class AuctionParameters(Fields):
    """Whether robots bid for their vertices."""

    auctioned: Annotated[bool, Value("1", "whether robots bid for their vertices")]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        return {"auctioned": setup.auctioned}


class AuctionState(Fields):
    """What each robot knows of the bids."""

    worth: Annotated[Array, "bidding", "n", Value("1", "of each vertex to the robot")]
    bid: Annotated[Array, "bidding", "n", Value("1", "highest for each vertex that the robot knows of")]
    bidder: Annotated[Array, "bidding", "n", Value("1", "whose it is, from 1; 0 for nobody")]
    won: Annotated[Array, "bidding", Value("1", "vertex that the robot takes, from 1; 0 for none")]
    sent_bid: Annotated[Array, "bidding*depth", "n", Value("1", "highest bids known to the sender")]
    sent_bidder: Annotated[Array, "bidding*depth", "n", Value("1", "whose they are")]
    mate_vertex: Annotated[Array, "bidding", "p", Value("1", "vertex of each robot as one knows it: scratch")]


@inlined
def begin_auction(plan: Plan, state: State) -> None:
    """Let each robot bid for the vertex nearest to its direction from where it believes the target."""
    n = state.q.shape[0]
    for i in range(n):
        way = numbers_at(state, state.q_measured, i) - numbers_at(state, state.belief, i)
        unit = (1.0 / max(norm(way), NEAR)) * way
        for v in range(n):
            state.worth[i, v] = ABOVE_ALL + dot(unit, numbers_at(state, plan.vertices, v))
            state.bid[i, v] = state.bidder[i, v] = 0.0
        _choose(i, plan, state)


@inlined
def tell_bids(j: int, message: int, state: State) -> None:
    """Write the bids that robot j knows of into a message."""
    for v in range(state.bid.shape[1]):
        state.sent_bid[message, v], state.sent_bidder[message, v] = state.bid[j, v], state.bidder[j, v]


@inlined
def hear_bids(i: int, message: int, plan: Plan, state: State) -> None:
    """Take over higher bids from a message, and bid for another vertex where robot i has been outbid."""
    for v in range(state.bid.shape[1]):
        bid, bidder = state.sent_bid[message, v], state.sent_bidder[message, v]
        if _beats(bid, bidder, state.bid[i, v], state.bidder[i, v]):
            state.bid[i, v], state.bidder[i, v] = bid, bidder
    if state.won[i] == 0.0 or state.bidder[i, int(state.won[i]) - 1] != i + 1.0:
        _choose(i, plan, state)


@inlined
def _beats(bid: float, bidder: float, other: float, whose: float) -> bool:
    """Whether a bid is higher than another, or as high and of a robot with a lower number."""
    return bid > other or (bid == other and 0.0 < bidder < whose)


@inlined
def _choose(i: int, plan: Plan, state: State) -> None:
    """Let robot i bid for the vertex that is worth most among those that it can win."""
    best, most = -1, 0.0
    for v in range(state.bid.shape[1]):
        worth = state.worth[i, v]
        if worth > most and _beats(worth, i + 1.0, state.bid[i, v], state.bidder[i, v]):
            best, most = v, worth
    state.won[i] = best + 1.0
    state.vertices[i] = 0.0
    if best >= 0:
        copy_numbers(plan.vertices[best], state.vertices[i], state.q.shape[1])
        state.bid[i, best], state.bidder[i, best] = most, i + 1.0


@inlined
def know_vertices(robot: int, plan: Plan, state: State) -> None:
    """Write which vertices a robot believes others to take; of whom it knows of no bid, it does not know."""
    n, p = state.q.shape
    for j in range(n):
        found = -1
        for v in range(n):
            if state.bidder[robot, v] == j + 1.0:
                found = v
        if found < 0:
            state.mate_unknown[j] = 1.0
        state.mate_vertex[j] = 0.0
        if found >= 0:
            copy_numbers(plan.vertices[found], state.mate_vertex[j], p)
