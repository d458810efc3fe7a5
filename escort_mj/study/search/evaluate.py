"""Runs that a search asks for, point by point: all cells of the study with all its seeds, each made once."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from escort_mj.errors import ScenarioError
from escort_mj.files import write_text
from escort_mj.record.outcome import Verdict
from escort_mj.scenario import dump_scenario
from escort_mj.scenario.findings import parse_key_path
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.study.engine.backends import Backend
from escort_mj.study.engine.store import Row, Store
from escort_mj.study.engine.work import Job
from escort_mj.study.search.optimizer import Optimizer, PointResult
from escort_mj.study.sweeps.design import SEED, Cell, Design, Planned
from escort_mj.study.sweeps.sweep import job_of, make

Point = Mapping[str, float | int]
"""Scenario keys or parameters, and the number that each has; `seed` moves the study's seeds."""
Weigh = Callable[[Point, list[Row] | None], PointResult]
"""What an optimizer is told of a point, given its runs; None where it is impossible."""


class Evaluator:
    """Makes the runs of points and keeps them in the study's store; a search made again finds them there.

    Attributes:
        design: The study's.
        asked: How many runs were asked for, made before or now.
        made: How many of them were made now.
    """

    def __init__(self, design: Design, out: Path, backend: Backend[Job, Row]) -> None:
        """Open the store.

        Args:
            design: The study's.
            out: Folder of its results.
            backend: Where to compute.
        """
        self.design, self.asked, self.made = design, 0, 0
        self._store, self._backend = Store(out), backend

    def __enter__(self) -> Evaluator:
        return self

    def __exit__(self, *_: object) -> None:
        self._store.close()

    def __call__(self, points: Sequence[Point], seeds: Sequence[int] | None = None) -> list[list[Row] | None]:
        """Runs of each point, cell by cell, seed by seed; None for a point that makes a cell impossible.

        Args:
            points: What to set beside each cell.
            seeds: With which seeds; None: the study's.
        """
        jobs = [self._jobs(point, self.design.seeds if seeds is None else seeds) for point in points]
        wanted = {job.key: job for of_point in jobs if of_point is not None for job in of_point}
        known = self._store.known()
        missing = [job for key, job in wanted.items() if key not in known]
        self.asked += len(wanted)
        self.made += make(missing, self._store, self._backend, len(missing))
        rows = self._store.get(wanted)
        return [None if jobs_ is None else [rows[job.key] for job in jobs_] for jobs_ in jobs]

    def follow(self, optimizer: Optimizer, wanted: Callable[[], int], weigh: Weigh) -> Iterator[None]:
        """Evaluate what an optimizer asks for, batch by batch; yields after each.

        Args:
            optimizer: The optimizer.
            wanted: How many points the next batch has; 0 ends the search.
            weigh: What the optimizer is told of a point, given its runs; None where it is impossible.
        """
        while count := wanted():
            points = optimizer.ask(count)
            optimizer.tell([weigh(point, rows) for point, rows in zip(points, self(points), strict=True)])
            yield

    def kept(self) -> str:
        """What a search that is interrupted has left."""
        runs = len(self._store.known())
        return f"{runs} runs are kept in {self._store.path.parent}; the same command goes on from there"

    def scenario(self, point: Point, cell: int = 0, seed: int | None = None) -> Scenario:
        """The scenario of a cell at a point."""
        first = self.design.seeds[0] if seed is None else seed
        return self.design.scenario(*_placed(point, self.design, cell, first))

    def write(self, path: Path, point: Point, scenario: Scenario, title: str) -> Scenario:
        """Write the scenario of a point as a file, with the keys that the search changed at its top.

        Args:
            path: The file; its name is the scenario's.
            point: What the search moved.
            scenario: What comes of it.
            title: A sentence for the first line and the scenario's description.
        """
        moved = [
            f"# {key}: {value:g}; without the search {number_text(base_of(self.design, key))}"
            for key, value in point.items()
        ]
        named = scenario.replace(name=path.stem[:80], description=title[:2000])
        path.parent.mkdir(parents=True, exist_ok=True)
        write_text(path, "\n".join([f"# {title}", *moved, dump_scenario(named)]))
        return named

    def _jobs(self, point: Point, seeds: Sequence[int]) -> list[Job] | None:
        jobs = []
        for index in range(len(self.design.cells)):
            for seed in seeds:
                cell, moved = _placed(point, self.design, index, seed)
                try:
                    self.design.scenario(cell, moved)
                except ScenarioError:
                    return None
                run = Planned(index, moved, self.design.key(cell, moved))
                jobs.append(job_of(self.design, run, cell=cell))
        return jobs


def _placed(point: Point, design: Design, index: int, seed: int) -> tuple[Cell, int]:
    """A cell at a point, and the seed that a run of it has there."""
    cell = design.cells_at({key: value for key, value in point.items() if key != SEED})[index]
    return cell, seed if SEED not in point else int(point[SEED]) + seed - design.seeds[0]


def base_of(design: Design, key: str) -> float | None:
    """The number that a key or parameter has without a search, in the first cell; None if it has none."""
    if key == SEED:
        return design.seeds[0]
    if key in design.study.parameters:
        return design.study.parameters[key]
    value: Any = design.scenario(design.cells[0], design.seeds[0]).model_dump()
    for name in parse_key_path(key) or ():
        try:
            value = value[name]
        except (KeyError, IndexError, TypeError):
            return None
    return value if isinstance(value, int | float) and not isinstance(value, bool) else None


def number_text(value: float | None) -> str:
    """Return the number that a key has, or that it has none."""
    return "no number" if value is None else f"{value:g}"


def mean_of(rows: Sequence[Row], metric: str) -> float:
    """Mean of a metric over runs; not a number where a run has none."""
    values = [row.metrics.get(metric) for row in rows]
    return sum(math.nan if value is None else value for value in values) / len(values)


BEST, WORST = 1.0, -2.0


class Robustness(NamedTuple):
    """The verdict that is nearest to breaking, or broken worst.

    Attributes:
        value: Its margin by its own scale, from -2 to 1; negative if and only if it is broken.
        verdict: What it looks at and demands, in words.
    """

    value: float
    verdict: str


def robustness(row: Row, duration: float) -> Robustness:
    """The least margin of all verdicts of a run.

    A verdict's margin is divided by the sum of its size and of the value's, which makes it a number from -1
    to 1 of the same sign whatever its unit. Verdicts without a margin, and those that hold with none to spare
    because nothing happened (no contact where none may be), say nothing as long as they hold, and -1 once
    they fail. A run that broke off has from -2 to -1, the less the sooner.

    Args:
        row: The run.
        duration: How long it was to be [s].
    """
    if not row.passed and row.simulated_time < duration - 1e-6:
        return Robustness(WORST + row.simulated_time / duration, f"outcome completed: {row.outcome}")
    least = min((Robustness(_scaled(v), v.title) for v in row.verdicts), default=Robustness(BEST, "none"))
    return least if row.passed or least.value < 0.0 else Robustness(-1.0, f"outcome completed: {row.outcome}")


def broken_by(rows: Iterable[Row], duration: float) -> set[str]:
    """What several runs break, in the words of `robustness`."""
    words = {title for row in rows for title in row.failed}
    return words | {weakest.verdict for row in rows if (weakest := robustness(row, duration)).value < 0.0}


def _scaled(verdict: Verdict) -> float:
    """A verdict's margin by its own scale."""
    margin, value, passed = verdict.margin, verdict.value, verdict.passed
    if margin is None or value is None or passed != (margin >= 0.0):  # or it was known to fail
        return BEST if passed else -1.0
    if math.isinf(margin):
        return math.copysign(1.0, margin)
    size = abs(margin) + abs(value)
    return margin / size if margin else BEST
