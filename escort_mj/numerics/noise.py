"""Measurement noise from a counter-based generator: the same bits in any order, on any number of threads.

Philox4x64-10 (Salmon et al., "Parallel random numbers: as easy as 1, 2, 3", SC 2011), keyed by the seed
and counted by (block, use, robot, step). Points are drawn uniformly from a ball by rejection, which needs
no transcendental function and so gives the same bits on every machine: first the position's, then the
velocity's, from one stream of coordinates, two to each word.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from escort_mj.native.kernels import high_product, inlined, kernel, merged, stack_memory, vector_at
from escort_mj.native.lanes import WIDTH, any_of, everywhere, row_of, set_row, stack_rows, where
from escort_mj.native.uint64_lanes import double_of, words_from

Array = NDArray[np.float64]

TAG = np.uint64(0x6573636F72745F6D)  # second word of the key: "escort_m" in ASCII

_M0, _M1 = np.uint64(0xD2E7470EE14C6C93), np.uint64(0xCA5A826395121157)
_W0, _W1 = np.uint64(0x9E3779B97F4A7C15), np.uint64(0xBB67AE8584CAA73B)
_ONE, _SIGN, _HALF = np.uint64(1), np.uint64(63), np.uint64(32)
_UP, _DOWN = np.uint64(20), np.uint64(12)  # from a word's lower, upper half to where a fraction begins
_FRACTION = np.uint64(0x000FFFFFFFF00000)  # the upper 32 bits of a double's
_MIDDLE = np.uint64(0x4000000000080000)  # between 2 and 4, in the middle of what lower bits can be
_UNUSED = np.uint64(11)  # bits of a word beyond what a double holds
PER_BLOCK = 8  # coordinates
_ROUNDS, _BEGUN = 10, 3  # of these, what `_begin` does
OF_ROBOT, OF_TARGET = 0, 1  # uses of a stream: noise of whom
_DROPOUTS = 2  # added to these: whether their measurements arrive
_FORCES = 2**32  # block where a stream's second use begins, out of the reach of the first
_NONE = 2.0  # stands for a coordinate that is not found
_MOST_IN_LANES = 3  # axes; in more of them too few of the candidates are inside


@inlined
def _round(counter: Any, k0: Any, k1: Any) -> tuple[Any, Any, Any, Any]:
    """One round of Philox."""
    c0, c1, c2, c3 = counter
    return high_product(_M1, c2) ^ c1 ^ k0, _M1 * c2, high_product(_M0, c0) ^ c3 ^ k1, _M0 * c0


@inlined
def _begin(seed: int, block: Any, use: Any, robot: Any, step: Any) -> tuple[Any, Any, Any, Any]:
    """The first rounds: as long as something is the same in all lanes, it is a single word."""
    k0, k1 = np.uint64(seed), TAG
    once = _round((block, use, robot, step), k0, k1)
    twice = _round(once, k0 + _W0, k1 + _W1)
    return _round(twice, k0 + _W0 + _W0, k1 + _W1 + _W1)


@inlined
def philox(seed: int, block: Any, use: Any, robot: Any, step: Any) -> tuple[Any, Any, Any, Any]:
    """The four words of one block of a robot's stream for some use at a step."""
    words = _begin(seed, np.uint64(block), np.uint64(use), np.uint64(robot), np.uint64(step))
    k0, k1 = np.uint64(seed) + _W0 + _W0, TAG + _W1 + _W1
    for _ in range(_BEGUN, _ROUNDS):
        k0 += _W0
        k1 += _W1
        words = _round(words, k0, k1)
    return words


@inlined
def _coordinates(word: Any) -> tuple[Any, Any]:
    """Middles of two of 2^32 equal parts of (-1, 1): that of a word's lower half, then that of its upper."""
    lower, upper = (word << _UP) & _FRACTION, (word >> _DOWN) & _FRACTION
    return double_of(lower | _MIDDLE) - 3.0, double_of(upper | _MIDDLE) - 3.0


@inlined
def _fill(coordinates: Array, seed: int, block: int, use: int, robot: int, step: int) -> None:
    """The next coordinates of a stream, uniform in (-1, 1), two of each word."""
    w0, w1, w2, w3 = philox(seed, block, use, robot, step)
    coordinates[0], coordinates[1] = _coordinates(w0)
    coordinates[2], coordinates[3] = _coordinates(w1)
    coordinates[4], coordinates[5] = _coordinates(w2)
    coordinates[6], coordinates[7] = _coordinates(w3)


@merged
def draw_points(
    points: Array, per_robot: int, for_target: int, seed: int, first: int, n: int, step: int
) -> None:
    """Draws points uniformly from the unit ball for some bodies: robots and, behind the last, the target.

    The candidates of a stream's first blocks, eight of them, are judged at once, in lanes of bodies. In two
    axes they fail one draw of 7000, in three one of 38: these go on alone, as all do in more axes.

    Args:
        points: Result, shape (2 p, WIDTH), a column for each body: its first point, then its second.
        per_robot: How many of the two each robot needs.
        for_target: How many of them the target needs.
        seed: Key of the streams.
        first: Number of the first body.
        n: Number of robots.
        step: Physics step.
    """
    p = points.shape[0] // 2
    blocks = p if p <= _MOST_IN_LANES else 0
    if blocks > 0:
        _judge_in_lanes(points, seed, first, n, step)
    else:
        for k in range(2 * p):
            set_row(points, k, everywhere(_NONE))
    if any_of(row_of(points, p) > 1.0):
        for lane in range(min(n + 1 - first, WIDTH)):
            found = 0 if points[0, lane] > 1.0 else 1 if points[p, lane] > 1.0 else 2
            count = per_robot if first + lane < n else for_target
            if found < count:
                _draw_alone(points, lane, found, count, blocks, seed, first + lane, n, step)


@merged
def _judge_in_lanes(points: Array, seed: int, first: int, n: int, step: int) -> None:
    """The first two candidates inside, for bodies in lanes; what is not among those at hand is _NONE."""
    p = points.shape[0] // 2
    coordinates, found = stack_rows(PER_BLOCK * p), stack_rows(2 * p)
    _fill_in_lanes(coordinates, seed, first, n, step)
    for k in range(2 * p):
        set_row(found, k, everywhere(_NONE))
    for candidate in range(PER_BLOCK - 1, -1, -1):
        square = everywhere(0.0)
        for k in range(p):
            x = row_of(coordinates, candidate * p + k)
            square = square + x * x
        outside = square > 1.0
        for k in range(p):
            before = row_of(found, k)
            set_row(found, p + k, where(outside, row_of(found, p + k), before))
            set_row(found, k, where(outside, before, row_of(coordinates, candidate * p + k)))
    for k in range(2 * p):
        set_row(points, k, row_of(found, k))


@merged
def _fill_in_lanes(coordinates: Array, seed: int, first: int, n: int, step: int) -> None:
    """The coordinates of a stream's first blocks, as many as there are axes, for bodies in lanes."""
    body = words_from(np.uint64(first))
    of_target = (np.uint64(n - 1) - body) >> _SIGN  # 1 in its lane: below zero a word's highest bit is set
    robot = body & ((of_target - _ONE) >> _HALF)  # an upper half known to be 0 saves half of a product
    now = np.uint64(step)
    # Round by round, so that the processor has something to do while it waits for the one before.
    a = _begin(seed, np.uint64(1), of_target, robot, now)
    b = _begin(seed, np.uint64(2), of_target, robot, now)
    c = _begin(seed, np.uint64(3), of_target, robot, now)
    k0, k1 = np.uint64(seed) + _W0 + _W0, TAG + _W1 + _W1
    for _ in range(_BEGUN, _ROUNDS):
        k0 += _W0
        k1 += _W1
        a, b, c = _round(a, k0, k1), _round(b, k0, k1), _round(c, k0, k1)
    _keep(coordinates, 0, a)
    _keep(coordinates, PER_BLOCK, b)
    if coordinates.shape[0] > 2 * PER_BLOCK:
        _keep(coordinates, 2 * PER_BLOCK, c)


@inlined
def _keep(coordinates: Array, at: int, words: tuple[Any, Any, Any, Any]) -> None:
    """The coordinates of a block, rows from `at` on."""
    w0, w1, w2, w3 = words
    _keep_two(coordinates, at, w0)
    _keep_two(coordinates, at + 2, w1)
    _keep_two(coordinates, at + 4, w2)
    _keep_two(coordinates, at + 6, w3)


@inlined
def _keep_two(coordinates: Array, at: int, word: Any) -> None:
    lower, upper = _coordinates(word)
    set_row(coordinates, at, lower)
    set_row(coordinates, at + 1, upper)


@kernel
def _draw_alone(
    points: Array, lane: int, found: int, count: int, block: int, seed: int, body: int, n: int, step: int
) -> None:
    """Draws a body's other points from what follows so many blocks, for as many candidates as it takes."""
    p = points.shape[0] // 2
    use, robot = (OF_ROBOT, body) if body < n else (OF_TARGET, 0)
    coordinates, used = vector_at(stack_memory(), PER_BLOCK), PER_BLOCK
    for point in range(found, count):
        square = 2.0
        while square > 1.0:
            square = 0.0
            for k in range(p):
                if used == PER_BLOCK:
                    block, used = block + 1, 0
                    _fill(coordinates, seed, block, use, robot, step)
                x = coordinates[used]
                used += 1
                points[point * p + k, lane] = x
                square += x * x


@inlined
def chance(seed: int, use: int, robot: int, step: int, channel: int) -> float:
    """A number uniform in [0, 1) that decides whether a measurement arrives.

    Args:
        seed: Key of the stream.
        use: `OF_ROBOT` or `OF_TARGET`.
        robot: Which robot, from 0; 0 for the target.
        step: Physics step.
        channel: 0 for its position, 1 for its velocity.
    """
    w0, w1, _, _ = philox(seed, 1, use + _DROPOUTS, robot, step)
    word = w0 if channel == 0 else w1
    return float(np.int64(word >> _UNUSED)) * 2.0**-53


@inlined
def uniform(robot: int, most: float, seed: int, draw: int, result: Array) -> None:
    """Draws numbers uniform in (-most, most) from a robot's stream, apart from its measurement noise.

    Args:
        robot: Which robot, from 0.
        most: Their largest magnitude.
        seed: Key of the stream.
        draw: Number of the draw, from 0; the same draw gives the same numbers.
        result: Result, shape (p,).
    """
    coordinates = vector_at(stack_memory(), PER_BLOCK)
    for k in range(result.shape[0]):
        if k % PER_BLOCK == 0:
            _fill(coordinates, seed, _FORCES + k // PER_BLOCK, OF_ROBOT, robot, draw)
        result[k] = most * coordinates[k % PER_BLOCK]
