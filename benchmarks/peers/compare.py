"""One peer and our loop on the same mission, in turns, each with its own steps."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.peers import ours
from benchmarks.peers.flight import Flight, timed
from benchmarks.peers.modes import Mode
from benchmarks.peers.remote import Remote
from escort_mj.study.engine.parallel import cores
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import World, build

HERE = Path(__file__).parent
ROUND, ROUNDS = 0.2, 9  # wall time to aim at [s], and how many
LONG, FEW = 4.0, 3  # where a single round takes longer than that [s], this many


@cache
def world_of(kind: str, n: int, axes: int) -> World:
    """Our world, built once for all peers that are compared with it."""
    return build(ours.mission(kind, n, axes))


def calibrated(timed: Callable[[int], tuple[float, float]], chunk: int) -> int:
    """How many steps take about a round; the first are not counted, for they may have to be compiled.

    Args:
        timed: Takes so many steps and says how long it took, first of all the wall time [s].
        chunk: What the number must be a multiple of.
    """
    timed(chunk)
    count = chunk
    while (taken := timed(count)[0]) < ROUND / 4:
        count *= 4
    return max(chunk, round(count * ROUND / taken / chunk) * chunk)


def compare(mode: Mode, n: int, python: Path) -> dict[str, Any]:
    """Lets a peer and our loop take turns.

    Args:
        mode: The peer, and how it is used.
        n: Number of robots.
        python: The interpreter of its environment.

    Returns:
        Its version; `theirs` and `own`, medians over rounds; `ratio`, the median of our rate over its rate,
        and `per_core`, the same by processor time.
    """
    world = world_of(mode.kind, n, mode.axes)
    own = ours.fly_many(world, cores()) if mode.many else ours.fly(world)

    def fly_own(count: int) -> tuple[float, float]:
        with native_loop(world):
            return timed(own, count)

    most = calibrated(fly_own, own.chunk)
    with Remote(python, HERE / f"fly_{mode.peer}.py", mode.mode, n) as peer:
        count = calibrated(peer.timed, peer.chunk)
        rounds = FEW if peer.timed(count)[0] > LONG else ROUNDS
        turns = np.array([(peer.timed(count), fly_own(most)) for _ in range(rounds)])  # (round, side, clock)
        theirs, own_times = turns.transpose(1, 2, 0) / np.reshape(
            [count * peer.robots, most * own.robots], (2, 1, 1)
        )
        return {
            "version": peer.version,
            "theirs": _facts(theirs, peer, peer.error),
            "own": _facts(own_times, own, own.error()),
            "ratio": float(np.median(theirs[0] / own_times[0])),
            "per_core": float(np.median(theirs[1] / own_times[1])),
            "rounds": rounds,
        }


def _facts(times: NDArray[np.float64], flight: Flight | Remote, error: float) -> dict[str, float]:
    """Of a flight: robot-steps/s, simulated seconds a second of a world, and how many cores it kept busy.

    Args:
        times: Wall and processor time of a robot-step in each round, shape (2, rounds) [s].
        flight: Whose.
        error: How far its robots were from their places at the end [m].
    """
    wall = float(np.median(times[0]))
    return {
        "robots": flight.robots,
        "timestep": flight.timestep,
        "robot_steps": 1.0 / wall,
        "pace": flight.timestep / (wall * flight.robots),
        "cores": float(np.median(times[1] / times[0])),
        "error": error,
    }
