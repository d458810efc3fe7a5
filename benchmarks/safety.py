"""`python -m benchmarks.safety`: every mission of scenarios/studies/safety.yaml, for docs/avoidance.md."""

from __future__ import annotations

import os
import sys
from collections import Counter
from collections.abc import Iterator
from functools import cache
from typing import Any, NamedTuple

os.environ.setdefault("MUJOCO_GL", "disable")

from benchmarks.document import publish, table, wants_docs  # noqa: E402
from escort_mj.api import scenarios_folder  # noqa: E402
from escort_mj.metrics.causes import CAUSES, UNEXPLAINED, Touch, causes_of  # noqa: E402
from escort_mj.mission import fly  # noqa: E402
from escort_mj.study.engine.parallel import side_by_side  # noqa: E402
from escort_mj.study.sweeps.definition import load_study  # noqa: E402
from escort_mj.study.sweeps.design import Design  # noqa: E402

PAGE = "avoidance.md"


class Flown(NamedTuple):
    """What came of a mission."""

    case: str
    completed: bool
    touches: list[Touch]


@cache
def design() -> Design:
    """The missions."""
    folder = scenarios_folder()
    return Design(load_study(folder / "studies" / "safety.yaml"), folder)


def attempt(index: int) -> Flown:
    """Flies one mission."""
    run = list(design().runs())[index]
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
    """Flies all missions, prints the table, and writes it into the docs if asked."""
    write = wants_docs(__doc__, PAGE, arguments)
    flown = list(side_by_side(attempt, range(len(design())), int(os.environ.get("SAFETY_WORKERS", "1"))))
    head = ["missions of", "flown", "completed", "with touches", "touches", *CAUSES, UNEXPLAINED]
    publish(PAGE, {"safety": table(head, rows(flown))}, write)


if __name__ == "__main__":
    main()
