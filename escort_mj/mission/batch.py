"""Many missions in the threads of one process: each has the bits that it has alone, and no trace is kept.

A mission is stepped natively, hundreds of samples at a time, without the interpreter's lock. What a thread
needs Python for is to build the mission's world and to sum it up: one does while another steps. A thread more
than cores would take the core from who holds the lock, and all would wait. MuJoCo's own `mujoco.batch` steps
states of one layout; missions here differ in anything, and each has its own model, its own length and its own
end.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from itertools import islice
from typing import TypeVar

from escort_mj import stopping
from escort_mj.mission import Flight, Room, failed, fly
from escort_mj.scenario.schema.scenario import Scenario

Item = TypeVar("Item")
Result = TypeVar("Result")

AHEAD = 2  # missions that each thread may be ahead of who takes the results


def fly_many(scenarios: Iterable[Scenario], threads: int, traces: bool = False) -> Iterator[Flight]:
    """Runs scenarios side by side; whatever goes wrong with one is its own outcome.

    Args:
        scenarios: Checked scenarios, taken as they are needed.
        threads: How many cores to keep busy; 1 stays in this thread.
        traces: Whether runs keep what was recorded.

    Yields:
        A run for each scenario, in their order.

    Raises:
        KeyboardInterrupt: If it comes; missions under way end with it.
    """
    rooms = threading.local()

    def one(scenario: Scenario) -> Flight:
        if traces:
            return _flown(scenario, None)
        if not hasattr(rooms, "mine"):
            rooms.mine = Room()
        return replace(_flown(scenario, rooms.mine), recording=None)

    yield from in_threads(one, scenarios, threads)


def _flown(scenario: Scenario, room: Room | None) -> Flight:
    try:
        return fly(scenario, room=room)
    except Exception as error:
        return failed(scenario, error)


def in_threads(function: Callable[[Item], Result], items: Iterable[Item], threads: int) -> Iterator[Result]:
    """Call a function for every item, a few ahead of who takes the results.

    When results are no longer taken, missions that are under way end.

    Args:
        function: Mostly native.
        items: What to call it with, taken as they are needed.
        threads: How many cores to keep busy; 1 stays in this thread.

    Yields:
        One result per item, in the order of the items.
    """
    if threads == 1:
        yield from map(function, items)
        return
    waiting = iter(items)
    flying: deque[Future[Result]] = deque()
    unwanted = threading.Event()
    pool = ThreadPoolExecutor(threads, "mission", stopping.end_with, (unwanted,))
    try:
        while True:
            for item in islice(waiting, AHEAD * threads - len(flying)):
                flying.append(pool.submit(function, item))
            if not flying:
                return
            yield flying.popleft().result()
    finally:
        unwanted.set()
        pool.shutdown(cancel_futures=True)
