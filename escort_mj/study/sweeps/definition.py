"""A study as its YAML tells it: one scenario, what is varied, how often, and what is kept."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from functools import reduce
from operator import getitem
from pathlib import Path as FilePath
from typing import Annotated, Any, Literal

from pydantic import Field, PositiveFloat, PositiveInt, ValidationError

from escort_mj.components.parameters import TEXT, Parameters
from escort_mj.errors import Fault, ScenarioError
from escort_mj.scenario.findings import (
    Finding,
    Path,
    did_you_mean,
    instead,
    key_path,
    listed,
    nearest,
    parse_key_path,
    shortened,
    shown,
)
from escort_mj.scenario.reader import explain
from escort_mj.scenario.reader.document import Document, read_document
from escort_mj.scenario.reader.dump import flow
from escort_mj.scenario.reader.load import read_text
from escort_mj.scenario.reader.overrides import read_overrides
from escort_mj.scenario.reader.plain import document_of, tuples
from escort_mj.scenario.schema.fields import LABEL, PATTERNS, RUN_NAME
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.study.sweeps.quantities import ChosenMetric, MetricOver
from escort_mj.study.sweeps.values import NAME, Box, Draw, Levels, Range, Steps, names_in_braces

PLAIN = dict, list, str, int, float, type(None)  # what a file can have
Where = dict[str, Any]
"""Factors, and the level of each, or a list of levels, in the words of tables."""


class CellBound(MetricOver):
    """A bound on a cell's median of a metric."""

    at_most: float | None = None
    """Upper bound, in the metric's unit."""
    at_least: float | None = None
    """Lower bound, in the metric's unit."""


class Better(Parameters):
    """A comparison of each cell with another one."""

    than: Annotated[Where, Field(min_length=1)]
    """What is different in the other cell: factors, and the level of each."""
    quantities: Annotated[tuple[ChosenMetric, ...], Field(min_length=1)]
    """Metrics. Medians count; one of them must be better, and none worse by more than 5 %."""
    by: Annotated[float, Field(gt=0, lt=1)] = 0.05
    """By which share one must be better at least."""


class CellsExpectation(Parameters):
    """What is expected of some cells: that their runs complete, and more."""

    claim: Annotated[str, Field(pattern=LABEL)]
    """What is claimed."""
    source: Annotated[str, Field(max_length=200, pattern=TEXT)] = ""
    """Who says so, and where."""
    where: Where = {}
    """Which cells it is about; empty: all."""
    bounds: tuple[CellBound, ...] = ()
    """What must hold in each of these cells."""
    better: Better | None = None
    """Than which other cells each of them must be better."""

    def asked(self) -> Iterator[tuple[Path, MetricOver]]:
        """Every metric that it names, and where."""
        yield from ((("bounds", place), one) for place, one in enumerate(self.bounds))
        if self.better is not None:
            yield from (
                (("better", "quantities", place), one) for place, one in enumerate(self.better.quantities)
            )

    def findings(self, path: Path) -> Iterator[Finding]:
        """What is wrong between its keys, which stand at a path."""
        for where, one in self.asked():
            yield from one.findings((*path, *where))
        for place, bound in enumerate(self.bounds):
            if bound.at_most is None and bound.at_least is None:
                yield Finding((*path, "bounds", place), "has no bound; give at_most or at_least")


class KeptFigure(Parameters):
    """A figure of runs that are kept, side by side."""

    name: Annotated[str, Field(pattern=RUN_NAME)]
    """Name of its file."""
    title: Annotated[str, Field(max_length=200, pattern=TEXT)] = ""
    """What stands above it."""
    draw: str
    """Which figure of a run, such as `panels` or `paths`."""
    where: Annotated[Where, Field(min_length=1)]
    """Which cells, up to four; the run with the first seed of each is shown."""


class Search(Parameters):
    """What tuning and falsifying have in common."""

    over: Box
    """Scenario keys or parameters, and the bounds within which each is searched."""
    seed: Annotated[int, Field(ge=0, lt=2**32)] = 0
    """Seed of the search."""
    batch: Annotated[int, Field(ge=1, le=1000)] = 8
    """Points that are chosen at once, before any of them is known; not the number of workers, so that the
    search is the same on every machine."""


class Falsify(Search):
    """A search for a run that breaks a verdict."""

    method: Literal["cmaes", "tpe", "random"] = "cmaes"
    """CMA-ES, Bayesian (tree-structured Parzen estimators), or evenly at random."""
    runs: Annotated[int, Field(ge=1, le=1_000_000)] = 1000
    """Runs of the search, which completes its last batch; shrinking what it finds takes some more."""
    collect: PositiveInt = 1
    """How many points that break a verdict end the search."""


class Objective(MetricOver):
    """A metric that is to become small, or large: its mean over cells and seeds counts."""

    goal: Literal["minimize", "maximize"] = "minimize"
    """Which way."""


class MetricBound(CellBound):
    """A bound on the mean of a metric over cells and seeds."""

    at_most_own: PositiveFloat | None = None
    """Upper bound as a multiple of what the scenario's own values come to, with the same seeds."""


class Tune(Search):
    """A search for better values, among those with which every verdict holds."""

    objectives: Annotated[tuple[Objective, ...], Field(min_length=1, max_length=4)]
    """What is to be reached; with several, the front of what cannot be bettered in all of them is sought."""
    bounds: tuple[MetricBound, ...] = ()
    """What must hold beside the scenario's own expectations."""
    verdicts: bool = True
    """Whether every verdict of every run must hold."""
    trials: Annotated[int, Field(ge=1, le=100_000)] = 200
    """Points to try; each takes a run for every cell and seed."""
    sampler: Literal["tpe", "nsga2", "random"] | None = None
    """Bayesian (tree-structured Parzen estimators), evolutionary (NSGA-II) or evenly at random; null: `tpe`
    for one objective, `nsga2` for several."""
    held_out: Annotated[int, Field(ge=0, le=100_000)] = 20
    """Seeds beyond the study's own, with which the best values and the scenario's own are compared."""

    @property
    def method(self) -> str:
        """The sampler that is used."""
        return self.sampler or ("tpe" if len(self.objectives) == 1 else "nsga2")

    def findings(self) -> Iterator[Finding]:
        """What is wrong between its keys."""
        for part, measured in (("objectives", self.objectives), ("bounds", self.bounds)):
            for place, one in enumerate(measured):
                yield from one.findings(("tune", part, place))
        for place, bound in enumerate(self.bounds):
            if bound.at_most is None and bound.at_least is None and bound.at_most_own is None:
                message = f"has no bound; give at_most, at_least or at_most_own to {bound.metric}"
                yield Finding(("tune", "bounds", place), message)
        metrics = [objective.key for objective in self.objectives]
        for place, metric in enumerate(metrics):
            if metric in metrics[:place]:
                yield Finding(("tune", "objectives", place, "metric"), f"{metric} is an objective already")


MOST_CELLS = 10_000  # each is tried before anything runs, 10 ms
MOST_RUNS = 1_000_000  # laid out at once, half a kilobyte each
SCENARIO = "scenario"  # of a case
PARAMETER = rf"^{NAME}$"
PATTERNS[PARAMETER] = "small letters, digits and _, a letter first"


class Sample(Parameters):
    """Points drawn from ranges and lists."""

    method: Literal["sobol", "latin_hypercube", "random"] = "sobol"
    """`sobol` and `latin_hypercube` cover the box more evenly than `random`."""
    count: Annotated[int, Field(ge=1, le=MOST_CELLS)]
    """How many points; without `paired`, how many for each combination of cases and values."""
    seed: Annotated[int, Field(ge=0, lt=2**53)] = 0
    """Seed of the drawing."""
    over: Annotated[dict[str, Draw], Field(min_length=1, max_length=64)]
    """Scenario keys or parameters, and the range of each, or a list of values that are equally likely; what a
    case sets is not drawn for it."""
    paired: bool = True
    """Whether all combinations of cases and values share the points, and all points the seeds; otherwise each
    combination has points of its own, and each point seeds of its own."""


class Limit(Parameters):
    """How large a study may be before it has to be confirmed."""

    runs: PositiveInt = 5000
    """Runs that are still to be made."""
    hours: PositiveFloat = 1.0
    """Time that they would take [h], judged by one of them."""


class Study(Parameters):
    """Many runs of one scenario: every cell of the design, with every seed."""

    study: Annotated[str, Field(pattern=RUN_NAME)]
    """Name of the study, of its folder and its report."""
    version: Literal[1] = 1
    """Version of this format."""
    description: Annotated[str, Field(max_length=4000, pattern=TEXT)] = ""
    """What the study is to find out."""
    scenario: str = ""
    """A scenario file beside this one, or the name of a shipped scenario; empty: each case names its own."""
    parameters: dict[Annotated[str, Field(pattern=PARAMETER)], float] = {}
    """Numbers by name: where a value of `set` or `cases` has the name in braces, as in "{amplitude}*sin(t)",
    it gets the number; what is varied or searched may name them like scenario keys."""
    set: dict[str, Any] = {}
    """Scenario keys and the value that they have in every run."""
    cases: Annotated[dict[Annotated[str, Field(pattern=LABEL)], dict[str, Any]], Field(max_length=1000)] = {}
    """Named alternatives, each a table of scenario keys and values; `scenario` among them is the case's own
    scenario, in place of the study's."""
    vary: Annotated[dict[str, Levels], Field(max_length=16)] = {}
    """Scenario keys and their values, a list or evenly spread; or what you like, and named alternatives, each
    a table of scenario keys and values. Every combination is a cell."""
    sample: Sample | None = None
    """Points drawn from ranges, beside the combinations above."""
    seeds: Annotated[int, Field(ge=1, le=100_000)] = 1
    """Seeds of every cell, the same for all cells: noise and random starts are paired."""
    first_seed: Annotated[int, Field(ge=0, lt=2**53)] | None = None
    """The first of them; null: the scenario's own."""
    traces: Literal["none", "failed", "all"] = "none"
    """Whose run folders are kept: of no run, of those that fail a verdict or break, of all."""
    at_most: Limit = Limit()
    """Beyond this the study has to be confirmed."""
    quantities: Annotated[tuple[ChosenMetric, ...], Field(max_length=40)] = ()
    """What tables and figures of the study show: metrics by name, or tables that also say over which part of
    each run; empty: the usual ones, and those that expectations bound."""
    expect: Annotated[tuple[CellsExpectation, ...], Field(max_length=200)] = ()
    """What is expected of cells, beside what scenarios expect of their runs."""
    apart: str = ""
    """Factor whose levels are judged each by itself; an answer then says in which of them a claim holds."""
    figures: Annotated[tuple[KeptFigure, ...], Field(max_length=100)] = ()
    """Figures of kept runs side by side, beside those that a report draws of any study."""
    tune: Tune | None = None
    """What `escort-mj tune` does with the study's cells and seeds."""
    falsify: Falsify | None = None
    """What `escort-mj falsify` does with the study's cells and seeds."""

    def asked(self) -> Iterator[tuple[Path, MetricOver]]:
        """Every metric that the study names, and where."""
        tables: list[tuple[Path, tuple[MetricOver, ...]]] = [(("quantities",), self.quantities)]
        if self.tune is not None:
            tables += [(("tune", "objectives"), self.tune.objectives), (("tune", "bounds"), self.tune.bounds)]
        for path, table in tables:
            yield from (((*path, place), one) for place, one in enumerate(table))
        for place, claim in enumerate(self.expect):
            yield from ((("expect", place, *path), one) for path, one in claim.asked())


class StudyFile:
    """A checked study with its text's places, for faults that show only when its cells are tried.

    Attributes:
        path: The file.
        study: What it says.
        text: The same as YAML.
    """

    def __init__(self, path: FilePath, study: Study, document: Document, text: str) -> None:
        self.path, self.study, self._document, self.text = path, study, document, text

    def fault(self, message: str, *path: str | int) -> Fault:
        """A fault with its place in the file."""
        return _fault(self._document, path, message)

    def is_overridden(self, *path: str | int) -> bool:
        """Whether what stands at a path was given beside the file."""
        return self._document.is_overridden(path)


def is_study(document: Document) -> bool:
    """Whether a YAML file is a study and not a scenario."""
    return isinstance(document.data, dict) and "study" in document.data


def load_study(given: str | os.PathLike[str] | Mapping[str, Any], overrides: Sequence[str] = ()) -> StudyFile:
    """Read and check a study; the scenario that it names is read by `design.Design`.

    Args:
        given: A file; or keys and values as in a file, whose scenario is looked for from here.
        overrides: Texts `key.path=value` that are added to the study's `set`.

    Raises:
        UsageError: If there is no such file or it cannot be read.
        ScenarioError: With every fault found.
    """
    if isinstance(given, Mapping):
        source, document = "study", document_of(given)
        values = ((path, reduce(getitem, path, document.data)) for path in document.values)
        if strange := [(path, value) for path, value in values if not isinstance(value, PLAIN)]:
            words = "expected text, a number, true, false, a list, a table or None"
            raise ScenarioError(
                [Fault(f"found {shown(one)}; {words}", key_path(path)) for path, one in strange]
            )
        text = _written(document.data)
    else:
        source = os.fspath(given)
        text = read_text(FilePath(source))
        document = read_document(text, source)
    if not is_study(document):
        message = "is no study: a study names itself with the key study, and its scenario with scenario"
        near = nearest("study", document.data if isinstance(document.data, dict) else ())
        message += instead("study", [near])
        raise ScenarioError([_fault(document, (near,) if near else (), message, at_key=True)])
    if overrides:
        _override(document, overrides)
        text = _written(document.data)
    try:
        study = Study.model_validate(tuples(document.data), strict=True)
    except ValidationError as error:
        findings = explain.findings_of(error, document.data, Study)
    else:
        findings = list(_findings(study))
        if not findings:
            return StudyFile(FilePath(source), study, document, text)
    faults = [_fault(document, finding.path, finding.message, finding.at_key) for finding in findings]
    raise ScenarioError(sorted(faults, key=lambda fault: (fault.line, fault.column)))


def _fault(document: Document, path: Path, message: str, at_key: bool = False) -> Fault:
    """A fault with its place in a study; what an override sets has the key that the override names."""
    place = document.place(path, at_key)
    key = key_path(path[1:] if document.is_overridden(path) else path)
    return Fault(message, key, place.line, place.column, place.source)


def _override(document: Document, overrides: Sequence[str]) -> None:
    """Add overrides to what a study sets, each with the override as its place.

    Raises:
        ScenarioError: If one is none.
    """
    before = document.data.get("set")
    table = document.data["set"] = dict(before) if isinstance(before, dict) else {}
    faults: list[Fault] = []
    for place, key, value in read_overrides(overrides, faults):
        path = "set", key_path(key)
        table[path[1]] = value
        for places in (document.values, document.keys):
            for stale in [known for known in places if known[:2] == path]:
                del places[stale]
            places[path] = place
        document.overridden.add(path)
    if faults:
        raise ScenarioError(faults)


def _written(data: Mapping[str, Any]) -> str:
    """Return a study as YAML."""
    return "".join(f"{key}: {flow(value)}\n" for key, value in data.items())


def _findings(study: Study) -> list[Finding]:
    """What is wrong between the keys of a study."""
    found = [*_scenario_findings(study), *_key_findings(study), *_parameter_findings(study)]
    for where, table in ((("vary",), study.vary), (("sample", "over"), draws_of(study))):
        found += [Finding((*where, key), "has no values") for key, values in table.items() if values == ()]
    for key, levels in study.vary.items():
        if isinstance(levels, Range):
            found += levels.findings(("vary", key))
        elif isinstance(levels, tuple):
            for place, value in enumerate(levels):
                if any(_same(value, other) for other in levels[:place]):
                    words = f"found {shown(value)} again; one cell is enough"
                    found.append(Finding(("vary", key, place), words))
                    break
    cases = list(study.cases.items())
    for place, (name, case) in enumerate(cases):
        equal = next((other for other, its in cases[:place] if _same(case, its)), None)
        if equal is not None:
            words = f"says the same as the case {shortened(equal, 80)}; one is enough"
            found.append(Finding(("cases", name), words, at_key=True))
    for path, box in _boxes(study):
        for key, bounds in box.items():
            found += bounds.findings((*path, key)) if isinstance(bounds, Range) else ()
    found += list(study.tune.findings()) if study.tune is not None else []
    found += list(_expectation_findings(study))
    keys = [one.key for one in study.quantities]
    for place, one in enumerate(study.quantities):
        found += one.findings(("quantities", place))
        if one.key in keys[:place]:
            found.append(Finding(("quantities", place), f"{one.key} is in the list already"))
    return found or list(_size_findings(study))


def _expectation_findings(study: Study) -> Iterator[Finding]:
    """What is wrong with what is expected of cells, and with figures of them."""
    for place, claim in enumerate(study.expect):
        yield from claim.findings(("expect", place))
    names = [shown.name for shown in study.figures]
    for place, name in enumerate(names):
        if name in names[:place]:
            yield Finding(("figures", place, "name"), f"{name} is in the list already")
    if study.figures and study.traces == "none":
        words = "found none; figures of runs need those that are kept: failed or all"
        yield Finding(("traces",), words)


def _same(one: Any, other: Any) -> bool:
    """Whether two values are equal; 1 is not true."""
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        return one.keys() == other.keys() and all(_same(one[key], other[key]) for key in one)
    if isinstance(one, list | tuple) and isinstance(other, list | tuple):
        return len(one) == len(other) and all(map(_same, one, other))
    return bool(one == other and isinstance(one, bool) == isinstance(other, bool))


def values_of(levels: tuple[Any, ...] | Steps | dict[str, Any]) -> list[Any]:
    """The values of one factor, or the names of its alternatives."""
    return levels.values() if isinstance(levels, Steps) else list(levels)


def draws_of(study: Study) -> Mapping[str, Any]:
    """What the points of a study are drawn from, by scenario key or parameter."""
    return study.sample.over if study.sample is not None else {}


def cells_of(study: Study) -> int:
    """How many cells a study has, counted without laying them out."""
    levels = math.prod(len(values_of(values)) for values in study.vary.values())
    return max(len(study.cases), 1) * levels * (study.sample.count if study.sample is not None else 1)


def _size_findings(study: Study) -> Iterator[Finding]:
    """More cells, or more runs, than can be laid out."""
    cells = cells_of(study)
    runs = cells * study.seeds
    if cells > MOST_CELLS:
        words = f"the study has {cells:,} cells; allowed are {MOST_CELLS:,} (sample draws from ranges)"
        yield Finding(("vary",) if study.vary else ("cases",), words)
    elif runs > MOST_RUNS:
        words = f"{cells:,} cells with {study.seeds:,} seeds each take {runs:,} runs"
        yield Finding(("seeds",), f"{words}; allowed are {MOST_RUNS:,}")


def _boxes(study: Study) -> Iterator[tuple[Path, Mapping[str, tuple[Any, ...] | Range]]]:
    """Every table of ranges and lists, and where it stands."""
    for name in ("sample", "tune", "falsify"):
        if (part := getattr(study, name)) is not None:
            yield (name, "over"), part.over


def _alternatives(study: Study) -> Iterator[tuple[Path, str, Any]]:
    """Every key that a named alternative sets, where, and its value."""
    named = {key: levels for key, levels in study.vary.items() if isinstance(levels, dict)}
    for path, tables in ((("cases",), study.cases), *((("vary", key), one) for key, one in named.items())):
        for name, table in tables.items():
            for key, value in table.items():
                if path != ("cases",) or key != SCENARIO:
                    yield (*path, name, key), key, value


def _scenario_findings(study: Study) -> Iterator[Finding]:
    """Cases without a scenario."""
    for name, case in study.cases.items():
        if not isinstance(case.get(SCENARIO, ""), str):
            yield Finding(("cases", name, SCENARIO), f"found {shown(case[SCENARIO])}; expected a scenario")
        elif not study.scenario and SCENARIO not in case:
            yield Finding(("cases", name), "has no scenario, and neither has the study", at_key=True)
    if not study.scenario and not study.cases:
        yield Finding(("study",), "has no scenario; scenario: main names one")


def _key_findings(study: Study) -> Iterator[Finding]:
    """Keys that are none, that are not a study's to set, or that are varied twice."""
    seen: dict[str, Path] = {}
    tables: list[tuple[Path, str]] = [(("set", key), key) for key in study.set]
    tables += [(("vary", key), key) for key, levels in study.vary.items() if not isinstance(levels, dict)]
    tables += [((*path, key), key) for path, box in _boxes(study) for key in box]
    tables += [(path, key) for path, key, _ in _alternatives(study)]
    for path, key in tables:
        searched = path[0] in ("tune", "falsify")
        if parse_key_path(key) is None:
            yield Finding(path, "is no key path of a scenario, such as robots.mass", at_key=True)
        elif key in ("name", "version") or (key == "seed" and path[0] != "falsify"):
            yield Finding(path, f"{key} cannot be varied; seeds and first_seed say which", at_key=True)
        elif key == "seed" and study.falsify is not None and not study.falsify.over[key].whole:
            yield Finding(path, "a seed is a whole number; add whole: true")
        elif path[0] in ("vary", "sample") and key in seen and seen[key][:2] != path[:2]:
            yield Finding(path, f"is given in {key_path(seen[key][:-1])} too", at_key=True)
        if not searched:
            seen.setdefault(key, path)


def _parameter_findings(study: Study) -> Iterator[Finding]:
    """Parameters that hide a scenario key, and names in braces that are no parameters."""
    for name in study.parameters:
        if name in Scenario.model_fields:
            yield Finding(("parameters", name), "is a key of scenarios; choose another name", at_key=True)
    values: list[tuple[Path, Any]] = [(("set", key), value) for key, value in study.set.items()]
    values += [(path, value) for path, _, value in _alternatives(study)]
    for key, draw in draws_of(study).items():
        if not isinstance(draw, Range):
            values += [(("sample", "over", key), draw)]
            if key in study.parameters and not all(isinstance(one, int | float) for one in draw):
                yield Finding(("sample", "over", key), "is a parameter; expected numbers")
    lists = [levels for levels in study.vary.values() if isinstance(levels, tuple)]
    used = {name for levels in lists for name in names_in_braces(levels)}
    for path, value in values if study.parameters else ():
        for name in names_in_braces(value):
            used.add(name)
            if name not in study.parameters:
                message = f"found {{{name}}}; the parameters are {listed([*study.parameters])}"
                yield Finding(path, message + did_you_mean(name, study.parameters))
    varied: list[tuple[tuple[str | int, ...], str]] = [(("vary", key), key) for key in study.vary]
    varied += [((*path, key), key) for path, box in _boxes(study) for key in box]
    for path, key in varied:
        if key in study.parameters and key not in used:
            words = f"changes nothing: no value of set or cases names this parameter, as {{{key}}}"
            yield Finding(path, words, at_key=True)
