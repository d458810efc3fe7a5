"""A simulator that flies the mission of `stage.py`, and how an adapter in another environment offers it.

The driver starts an adapter as `python fly_NAME.py MODE N`. It answers with lines of JSON: first what it is,
then, for each number of steps it reads, the wall time they took.
"""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass


@dataclass
class Flight:
    """A mission under way in some simulator.

    Attributes:
        step: Advances by so many of the simulator's own steps, control included.
        error: How far robots are from where they should be now, on average [m].
        timestep: Simulated time of a step [s].
        robots: Robots advanced by a step, those of all worlds.
        version: Of the simulator.
        chunk: Steps in its smallest call; `step` takes multiples of it.
    """

    step: Callable[[int], None]
    error: Callable[[], float]
    timestep: float
    robots: int
    version: str
    chunk: int = 1


def timed(flight: Flight, count: int) -> tuple[float, float]:
    """Wall time, and processor time of all threads, of so many steps [s]."""
    wall, core = time.perf_counter(), time.process_time()
    flight.step(count)
    return time.perf_counter() - wall, time.process_time() - core


def serve(fly: Callable[[str, int], Flight]) -> None:
    """Flies the mission that the command line names, round by round, as standard input asks for.

    Args:
        fly: Makes the mission, of a mode and a number of robots.
    """
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)  # whatever libraries print goes to standard error
    flight = fly(sys.argv[1], int(sys.argv[2]))

    def answer(**facts: object) -> None:
        answers.write(json.dumps(facts) + "\n")

    answer(timestep=flight.timestep, robots=flight.robots, version=flight.version, chunk=flight.chunk)
    for line in sys.stdin:
        answer(times=timed(flight, int(line)), error=flight.error())
