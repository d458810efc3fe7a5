"""`python -m benchmarks.safety`: every mission of scenarios/studies/safety.yaml, for docs/avoidance.md."""

from __future__ import annotations

import os
import sys
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from multiprocessing import get_context
from typing import Any, NamedTuple

from benchmarks.document import parser_for, publish, table
from escort_mj.api import scenarios_folder
from escort_mj.errors import Fault
from escort_mj.metrics.causes import CAUSES, UNEXPLAINED, Touch, causes_of
from escort_mj.mission import fly
from escort_mj.study.sweeps.definition import load_study
from escort_mj.study.sweeps.design import Design, Planned

PAGE = "avoidance.md"


class Flown(NamedTuple):
    """What came of a mission."""

    case: str
    completed: bool
    touches: list[Touch]


class _Missions(Design):
    """A design that checks each cell as it is flown: all of them at the start take minutes."""

    def _cell_faults(self) -> Iterator[Fault]:
        return iter(())


@cache
def design() -> Design:
    """The missions."""
    folder = scenarios_folder()
    return _Missions(load_study(folder / "studies" / "safety.yaml"), folder)


@cache
def planned() -> list[Planned]:
    """The same with their seeds."""
    return list(design().runs())


def attempt(index: int) -> Flown:
    """Flies one mission."""
    run = planned()[index]
    cell = design().cells[run.cell]
    flight = fly(design().scenario(cell, run.seed))
    found = [] if flight.recording is None else causes_of(flight.recording)
    if not flight.outcome.good or any(touch.cause == UNEXPLAINED for touch in found):
        print(
            index, flight.outcome, *(t for t in found if t.cause == UNEXPLAINED), file=sys.stderr, flush=True
        )
    return Flown(cell.labels["case"], flight.outcome.good, found)


def rows(flown: list[Flown]) -> Iterator[list[str]]:
    """One row per case and one for all."""
    cases = list(dict.fromkeys(each.case for each in flown))
    for name in [*cases, "all"]:
        some = [each for each in flown if name in (each.case, "all")]
        found = Counter(touch.cause for each in some for touch in each.touches)
        touched = sum(bool(each.touches) for each in some)
        counts = [len(some), sum(each.completed for each in some), touched, sum(found.values())]
        yield [name, *map(str, counts), *(str(found[cause]) for cause in (*CAUSES, UNEXPLAINED))]


def main(arguments: Any = None) -> None:
    """Flies the missions, prints the table, and writes it into the docs if asked."""
    parser, every = parser_for(__doc__, PAGE), len(design())
    parser.add_argument(
        "--missions", type=int, default=every, help=f"how many of the {every}, spread evenly (default: all)"
    )
    asked = parser.parse_args(arguments)
    if not 0 < asked.missions <= every:
        parser.error(f"--missions is {asked.missions}: it takes 1 to {every}")
    picked = [k * every // asked.missions for k in range(asked.missions)]
    workers = int(os.environ.get("SAFETY_WORKERS", "1"))
    with ProcessPoolExecutor(workers, get_context("forkserver")) as pool:
        flown = list(pool.map(attempt, picked))
    head = ["missions of", "flown", "completed", "with touches", "touches", *CAUSES, UNEXPLAINED]
    publish(PAGE, {"safety": table(head, rows(flown))}, asked.docs)


if __name__ == "__main__":
    main()
