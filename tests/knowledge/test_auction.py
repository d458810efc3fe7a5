"""Auctions of vertices: who gets what, by hand and by any order of messages."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from escort_mj.numerics.thomson import even_points
from tests.oracle.radio import Auction


def start(count: int, axes: int, seed: int) -> Auction:
    return Auction(np.random.default_rng(seed).normal(size=(count, axes)), even_points(count, axes))


def greedy(worth: np.ndarray) -> np.ndarray:
    """What bids that only rise lead to: the highest of all first, then of what is left."""
    left, found = worth.copy(), np.full(len(worth), -1)
    for _ in worth:
        robot, vertex = np.unravel_index(left.argmax(), left.shape)
        found[robot] = vertex
        left[robot], left[:, vertex] = -np.inf, -np.inf
    return found


@settings(max_examples=60)
@given(count=st.integers(1, 7), axes=st.sampled_from([2, 3]), seed=st.integers(0, 10**6), data=st.data())
def test_robots_agree_however_late_messages_come(
    count: int, axes: int, seed: int, data: st.DataObject
) -> None:
    auction, said = start(count, axes, seed), []
    pairs = st.tuples(st.integers(0, count - 1), st.integers(0, max(count * count, 1)))
    for robot, old in data.draw(st.lists(pairs, max_size=30)):  # some message of the past, to anybody
        said.append((auction.bid[robot].copy(), auction.bidder[robot].copy()))
        auction.hear((robot + 1) % count, *said[old % len(said)])
        for i in range(count):
            held = auction.won[i]
            assert held < 0 or (
                auction.bidder[i, held] == i + 1 and auction.bid[i, held] == auction.worth[i, held]
            )
    for _ in range(count * count):  # then along a ring that hears each other
        for robot in range(count):
            auction.hear((robot + 1) % count, auction.bid[robot].copy(), auction.bidder[robot].copy())
    assert sorted(auction.won) == list(range(count))
    assert (auction.won == greedy(auction.worth)).all()
    for i in range(count):
        assert np.array_equal(auction.known(i), auction.taken())


def test_a_robot_that_is_outbid_takes_the_next() -> None:
    square = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
    auction = Auction(np.array([[3.0, 1.0], [5.0, 0.1], [-2.0, 0.0], [0.0, -1.0]]), square)
    assert auction.won.tolist() == [0, 0, 2, 3]
    auction.hear(1, auction.bid[0], auction.bidder[0])
    assert auction.won.tolist() == [0, 0, 2, 3]  # the lower bid changes nothing
    auction.hear(0, auction.bid[1].copy(), auction.bidder[1].copy())
    assert auction.won.tolist() == [1, 0, 2, 3]
    assert np.isnan(auction.known(1)[2:]).all()  # nobody has told it of these


def test_nothing_is_left_for_a_robot_that_believes_all_taken() -> None:
    auction = start(3, 2, 0)
    auction.hear(0, np.full(3, 4.0), np.array([2, 2, 3]))
    assert auction.won[0] == -1 and not auction.taken()[0].any()
