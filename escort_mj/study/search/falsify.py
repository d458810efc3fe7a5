"""A search for runs that break a verdict, and the smallest scenarios that still do."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from escort_mj import stopping
from escort_mj.errors import ScenarioError
from escort_mj.files import write_json
from escort_mj.mission import fly
from escort_mj.progress import Progress, unseen
from escort_mj.recognize import COUNTEREXAMPLES
from escort_mj.record.folder import STUDY, RunFolder
from escort_mj.study.engine.backends import Backend
from escort_mj.study.engine.store import Row
from escort_mj.study.engine.work import Job
from escort_mj.study.search.evaluate import (
    BEST,
    Evaluator,
    Point,
    base_of,
    broken_by,
    number_text,
    robustness,
)
from escort_mj.study.search.optimizer import Optimizer, PointResult
from escort_mj.study.sweeps.definition import Falsify
from escort_mj.study.sweeps.design import Design

HOPELESS = 50  # impossible points for each that is possible, beyond which a search gives up
SUMMARY = "falsify.json"


@dataclass(frozen=True)
class Counterexample:
    """A scenario that fails.

    Attributes:
        broken: The verdict that the search broke worst, and that shrinking kept broken, in words.
        found: The point as the search found it.
        point: The point after shrinking.
        base: What its keys have without it; None for what is no number there.
        message: The failed verdicts of its run, or how it ended.
        scenario: The scenario file.
        folder: Its run folder.
    """

    broken: str
    found: dict[str, float]
    point: dict[str, float]
    base: dict[str, float | None]
    message: str
    scenario: Path
    folder: Path


@dataclass(frozen=True)
class Falsified:
    """What a search came to.

    Attributes:
        runs: Runs until the search ended.
        until_first: Runs until the first failure; None without one.
        shrinking: Runs that shrinking took beside them.
        made: How many of all of them were made now.
        points: Points tried.
        impossible: Points passed over, because no scenario is possible there.
        least: Least robustness found, and where.
        counterexamples: One for every verdict that was broken worst anywhere.
    """

    runs: int
    until_first: int | None
    shrinking: int
    made: int
    points: int
    impossible: int
    least: tuple[float, dict[str, float]]
    counterexamples: tuple[Counterexample, ...]


def falsify_design(
    design: Design, out: Path, backend: Backend[Job, Row], progress: Progress = unseen
) -> Falsified:
    """Searches a study's box for points where a verdict breaks, and shrinks what it finds.

    The study's cells without the search are tried first: a scenario that fails as it stands needs no search.

    Args:
        design: A study with a section `falsify`.
        out: Folder of its results; a search made again finds its runs there.
        backend: Where to compute.
        progress: Called with the runs made and the most that may be.

    Raises:
        ScenarioError: If the study has no such section, or a key of it is none.
        UsageError: If Optuna is not installed.
    """
    search = design.study.falsify
    if search is None:
        raise ScenarioError([design.file.fault("has no section falsify, which says what to search", "study")])
    with Evaluator(design, out, backend) as evaluator, stopping.keeping(evaluator.kept):
        hunt = _Hunt(evaluator, search)
        hunt.go(progress)
        runs = evaluator.asked
        found = tuple(
            _write(evaluator, number, words, point, out / COUNTEREXAMPLES)
            for number, (words, point) in enumerate(hunt.failures.items(), 1)
        )
        result = Falsified(
            runs, hunt.until_first, evaluator.asked - runs, evaluator.made, hunt.points, hunt.impossible,
            hunt.least, found,
        )  # fmt: skip
    write_json(out / SUMMARY, asdict(result))
    return result


class _Hunt:
    """The search itself."""

    def __init__(self, evaluator: Evaluator, search: Falsify) -> None:
        self.evaluator, self.search = evaluator, search
        self.failures: dict[str, Point] = {}  # the first of each kind
        self.failed = self.points = self.impossible = 0
        self.until_first: int | None = None
        self.least: tuple[float, dict[str, float]] = (BEST, {})

    def go(self, progress: Progress) -> None:
        """Searches until enough is found or enough was tried."""
        search, evaluator = self.search, self.evaluator
        optimizer = Optimizer(search.over, search.method, search.seed, search.batch)
        self.look({}, evaluator([{}])[0])
        if self.failed:
            return
        for _ in evaluator.follow(optimizer, self.wanted, self.look):
            if self.impossible > HOPELESS * self.points:
                words = f"{self.impossible} of {self.impossible + self.points} points are impossible"
                raise ScenarioError(
                    [evaluator.design.file.fault(f"{words}; narrow the bounds", "falsify", "over")]
                )
            progress(min(evaluator.asked, search.runs), search.runs)

    def wanted(self) -> int:
        """How many points are to be tried next."""
        enough = self.failed >= self.search.collect or self.evaluator.asked >= self.search.runs
        return 0 if enough else self.search.batch

    def look(self, point: Point, rows: list[Row] | None) -> PointResult:
        """Record the result of a point; return its robustness."""
        if rows is None:
            self.impossible += 1
            return PointResult(None)
        self.points += 1
        duration = self.evaluator.scenario(point).duration
        weakest = min(robustness(row, duration) for row in rows)
        if weakest.value < self.least[0]:
            self.least = weakest.value, dict(point)
        if weakest.value < 0.0:
            self.failed += 1
            self.failures.setdefault(weakest.verdict, point)
            self.until_first = self.until_first or self.evaluator.asked
        return PointResult([weakest.value])


def _write(evaluator: Evaluator, number: int, words: str, point: Point, folder: Path) -> Counterexample:
    """Shrinks a point, writes its scenario, and makes its run."""

    def failing(candidate: Point) -> int | None:
        rows = evaluator([candidate])[0] or ()
        duration = evaluator.scenario(candidate).duration if rows else 0.0
        broken = (place for place, row in enumerate(rows) if words in broken_by([row], duration))
        return next(broken, None)

    base = {key: base_of(evaluator.design, key) for key in point}
    small = shrink(point, base, lambda candidate: failing(candidate) is not None)
    place = failing(small)
    assert place is not None, "what is shrunk fails still"
    study, seeds = evaluator.design.study.study, evaluator.design.seeds
    path = folder / f"{study}_{number}.yaml"
    own = evaluator.scenario(small, place // len(seeds), seeds[place % len(seeds)])
    scenario = evaluator.write(path, small, own, f"Found by escort-mj falsify {study}: {words}")
    with RunFolder.create(folder / scenario.name, STUDY) as kept:
        run = fly(scenario, kept)
    failed = [verdict.message for verdict in run.verdicts if not verdict.passed]
    return Counterexample(
        words, dict(point), small, {key: base[key] for key in small}, "; ".join(failed), path, kept.path
    )


def falsification_lines(found: Falsified) -> list[str]:
    """What is to be said of a search, for a terminal."""
    said = []
    for one in found.counterexamples:
        said.append(f"{one.scenario}: {one.message}")
        said += _moves(one)
    tried = f"{found.points} points, {found.runs} runs"
    if found.impossible:
        tried += f", {found.impossible} points passed over as impossible"
    if found.until_first is None:
        where = "at" if found.least[1] else "as the study stands"
        said.append(f"nothing found in {tried}; least robustness {found.least[0]:.3g} (0 is failure) {where}")
        said += [f"  {key} = {value:.6g}" for key, value in found.least[1].items()]
    else:
        said.append(f"first failure after {found.until_first} runs; {tried}, and"
                    f" {found.shrinking} to shrink")  # fmt: skip
    return said


def _moves(one: Counterexample) -> list[str]:
    if not one.point:
        return ["  as the study stands, without anything moved"]
    return [
        f"  {key} = {value:.6g} (without the search {number_text(one.base[key])})"
        for key, value in one.point.items()
    ]


HALVINGS = 7
DIGITS = 3


def shrink(
    point: Point, base: Mapping[str, float | None], fails: Callable[[Point], bool]
) -> dict[str, float]:
    """Shrinks a point that fails, and keeps it failing.

    First every key that is not needed goes back to its base; then, key by key, bisection moves what is left
    as near to its base as it goes; then numbers lose the digits that they do not need.

    Args:
        point: Keys and numbers with which it fails.
        base: The number that each key has without the search; None for what is no number there.
        fails: Whether a point fails; keys that it leaves out are at their base.
    """
    small = dict(point)
    for key in sorted(small, key=lambda key: _distance(small[key], base[key])):
        without = {name: value for name, value in small.items() if name != key}
        if fails(without):
            small = without
    for key, origin in base.items():
        if key in small and origin is not None:
            small[key] = _nearest(small, key, origin, fails)
    for key in small:
        shorter = small | {key: _rounded(small[key])}
        if shorter != small and fails(shorter):
            small = shorter
    return small


def _distance(value: float, origin: float | None) -> float:
    """How far a number is from its base, relative to both."""
    return 1.0 if origin is None else abs(value - origin) / (abs(value) + abs(origin) or 1.0)


def _nearest(point: Point, key: str, origin: float, fails: Callable[[Point], bool]) -> float | int:
    """The number nearest to a key's base with which it still fails, by bisection."""
    failing, passing = point[key], origin
    for _ in range(HALVINGS):
        middle = 0.5 * (failing + passing)
        if isinstance(point[key], int):
            middle = round(middle)
        if middle in (failing, passing):
            break
        if fails({**point, key: middle}):
            failing = middle
        else:
            passing = middle
    return failing


def _rounded(value: float | int) -> float | int:
    return value if isinstance(value, int) else float(f"{value:.{DIGITS}g}")
