"""The design of a study: its cells, the runs that they take, and the key that tells runs apart."""

from __future__ import annotations

import hashlib
import json
import math
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from importlib.metadata import version
from itertools import chain, islice, product
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from escort_mj.errors import Fault, ScenarioError
from escort_mj.metrics import METRICS
from escort_mj.metrics.metric import Metric
from escort_mj.native.shipped import numba_version
from escort_mj.recognize import scenario_names
from escort_mj.scenario.findings import did_you_mean, listed, parse_key_path, shortened
from escort_mj.scenario.reader.catalog import catalog_of, resolve_plugins
from escort_mj.scenario.reader.dump import flow
from escort_mj.scenario.reader.load import Template, read_text
from escort_mj.scenario.reader.plugins import placed_in
from escort_mj.scenario.schema.scenario import Physics, Recording, Scenario
from escort_mj.study.sweeps.definition import MOST_RUNS, SCENARIO, Sample, Study, StudyFile, Tune, values_of
from escort_mj.study.sweeps.quantities import Measured
from escort_mj.study.sweeps.values import drawn, filled, in_order
from escort_mj.world.model.parts import models_folder

AROUND = {"cli", "conformance", "environments", "report", "study", "view"}  # rooms that no run comes from
CASE, SAMPLE, SEED = "case", "point", "seed"
MOST_BESIDE = 4  # runs in one figure
MOST_FAULTS = 20
Point = tuple[dict[str, Any], dict[str, Any]]
"""Number of a drawn point, and its values by key."""
DIGITS = 32
_NO_NAME = re.compile(r"[^\w.+-]+", re.ASCII)  # what names of folders leave out


class Cell(NamedTuple):
    """One combination of what a study varies.

    Attributes:
        labels: What tells it from other cells: the case's name, values by key, number of the drawn point.
        settings: Scenario keys and values, in the order in which they are set.
        scenario: What the study calls the scenario that they are set in.
    """

    labels: dict[str, Any]
    settings: dict[str, Any]
    scenario: str = ""


class Clock(NamedTuple):
    """How often a run is looked at.

    Attributes:
        timestep: Time between physics steps [s].
        interval: Time between samples [s].
    """

    timestep: float
    interval: float


class Planned(NamedTuple):
    """A run that a study asks for.

    Attributes:
        cell: Number of its cell, from 0.
        seed: Of all its randomness.
        key: Digest of everything that the run depends on.
    """

    cell: int
    seed: int
    key: str


class Design:
    """All cells and runs of a study.

    Attributes:
        study: What the file says.
        cells: In the order of the file: cases, then combinations, then drawn points.
        templates: The scenarios that it names, by what it calls them.
        factors: What is varied: `case` and scenario keys.
    """

    def __init__(self, file: StudyFile, shipped: Path) -> None:
        """Lays out a study and tries each of its cells.

        Args:
            file: The checked study.
            shipped: Folder of the shipped scenarios.

        Raises:
            UsageError: If the scenario's file cannot be read.
            ScenarioError: With every cell that is impossible, by its place in the study.
        """
        self.file, self.study = file, file.study
        self.templates = {name: _template(file, shipped, name, place) for name, place in _named(file.study)}
        self.cells = tuple(_cells(file))
        self.factors = [CASE] * bool(self.study.cases) + list(self.study.vary)
        if self.study.sample is not None:
            self.factors += self.study.sample.over
        first = self._own_seed() if self.study.first_seed is None else self.study.first_seed
        self.seeds = tuple(range(first, first + self.study.seeds))
        of_cells = (self._cell_faults, self._level_faults)
        for stage in (of_cells, (self._metric_faults, self._search_faults)):  # these need cells that can be
            faults = chain.from_iterable(each() for each in stage)
            if found := list(islice(dict.fromkeys(faults), MOST_FAULTS)):
                raise ScenarioError(sorted(found, key=lambda fault: (fault.line, fault.column)))

    def scenario(self, cell: Cell, seed: int | None = None) -> Scenario:
        """The checked scenario of a cell, with a seed or with its own.

        Raises:
            ScenarioError: If it is impossible.
        """
        return self.template_of(cell).scenario(cell.settings | ({} if seed is None else {"seed": seed}))

    def template_of(self, cell: Cell) -> Template:
        """The scenario of a cell before what the cell sets."""
        return self.templates[cell.scenario]

    def runs(self) -> Iterator[Planned]:
        """Every run, seed by seed through all cells: a study that is cut short has all cells alike."""
        digests = [self._digest(cell) for cell in self.cells]
        for seed in self.seeds:
            for index, digest in enumerate(digests):
                own = seed + self._apart(self.cells[index])
                yield Planned(index, own, _with_seed(digest, own))

    def folder_of(self, run: Planned) -> str:
        """Name of a run's folder: what tells its cell from others, its seed, and the start of its key."""
        told = "-".join(word(value) for value in self.cells[run.cell].labels.values())[:80]
        words = [*([_NO_NAME.sub("_", told)] if told else []), f"seed{run.seed}", run.key[:8]]
        return "-".join(words)

    def cells_at(self, point: Mapping[str, Any]) -> tuple[Cell, ...]:
        """All cells with what a search sets beside them: scenario keys or parameters, and their values."""
        return tuple(_cells(self.file, point))

    def key(self, cell: Cell, seed: int) -> str:
        """Digest of everything that a run of a cell depends on."""
        return _with_seed(self._digest(cell), seed)

    def _digest(self, cell: Cell) -> hashlib._Hash:
        """Digest of a cell's scenario, but for its seed, and of all else that its runs depend on."""
        template = self.template_of(cell)
        data = {key: value for key, value in template.overridden(cell.settings).items() if key != "seed"}
        if data.get("plugins"):  # their content counts, not where they are
            kind, _ = resolve_plugins(data, Path(template.source).parent)
            data["plugins"] = [plugin.source.sha256 for plugin in catalog_of(kind).plugins]
        text = json.dumps([_versions(), sources_digest(), data], sort_keys=True, default=str)
        digest = hashlib.sha256(text.encode())
        if measured := self.measured():
            digest.update(json.dumps(measured).encode())
        return digest

    def clock(self, cell: Cell) -> Clock:
        """How often a cell's runs are looked at."""
        data = self.template_of(cell).overridden(cell.settings)
        physics, recording = (data.get(name) or {} for name in ("physics", "recording"))
        timestep = physics.get("timestep", Physics().timestep)
        return Clock(timestep, 1.0 / recording.get("rate", Recording().rate))

    def _apart(self, cell: Cell) -> int:
        """How far its seeds are from the first ones: points that are not paired have seeds of their own."""
        sample = self.study.sample
        return 0 if sample is None or sample.paired else int(cell.labels[SAMPLE]) * len(self.seeds)

    def _own_seed(self) -> int:
        """The first scenario's own seed; what is wrong with it shows when cells are tried."""
        seed = next(iter(self.templates.values())).overridden().get("seed", 0)
        return seed if isinstance(seed, int) else 0

    def __len__(self) -> int:
        return len(self.cells) * len(self.seeds)

    def _cell_faults(self) -> Iterator[Fault]:
        """What is wrong with cells, each tried with its first seed."""
        self._shortest, told, wrong = math.inf, set[tuple[object, ...]](), 0
        for cell in self.cells:
            try:
                tried = self.scenario(cell, self.seeds[0] + self._apart(cell))
                self._shortest = min(self._shortest, tried.duration)
            except ScenarioError as error:
                wrong += 1
                for fault, placed in ((fault, self._placed(fault, cell)) for fault in error.faults):
                    its = placed.line, placed.column, fault.key, fault.message
                    if its not in told:  # other values may bring the same about
                        yield placed
                    told.add(its)
            if wrong > MOST_FAULTS:
                break

    def measured(self) -> tuple[Measured, ...]:
        """What is measured of each run beside the metrics that it has anyway, each once."""
        asked = [one for _, one in self.study.asked()]
        found = [Measured(one.key, one.metric, one.span) for one in asked if one.span is not None]
        return tuple(dict.fromkeys(found))

    def _metric_faults(self) -> Iterator[Fault]:
        """Metrics that the study names and neither the package nor a plugin has, and windows without runs."""
        asked = list(self.study.asked())
        if not asked:
            return
        scenario = self.scenario(self.cells[0], self.seeds[0])
        metrics = catalog_of(type(scenario)).of(Metric)
        known, moments = [one.name for one in metrics], {one.name for one in metrics if one.moment}
        for path, one in asked:
            if one.metric not in known:
                words = f"found {one.metric!r}; the metrics are {listed(known)}"
                yield self.file.fault(words + did_you_mean(one.metric, known), *path, "metric")
            if one.span is not None:
                latest = max(one.span.after, one.span.before or 0.0)
                if one.span.after >= self._shortest or latest > self._shortest:
                    words = f"found {latest:g} s; the run ends at {self._shortest:g} s"
                    yield self.file.fault(words, *path)
            if one.over == "tail" and one.metric in moments:
                words = f"found tail; {one.metric} is a moment of the run, looked for in all of it"
                yield self.file.fault(words, *path, "over")

    def _level_faults(self) -> Iterator[Fault]:
        """Factors and levels by which expectations and figures choose cells, and that do not exist."""
        study, sound = self.study, True
        chosen: list[tuple[tuple[str | int, ...], Mapping[str, Any]]]
        chosen = [(("expect", place, "where"), claim.where) for place, claim in enumerate(study.expect)]
        chosen += [
            (("expect", place, "better", "than"), claim.better.than)
            for place, claim in enumerate(study.expect)
            if claim.better is not None
        ]
        chosen += [(("figures", place, "where"), shown.where) for place, shown in enumerate(study.figures)]
        varied = listed(self.factors) if self.factors else "nothing"
        for path, where in chosen:
            for name, levels in where.items():
                known = list(dict.fromkeys(word(cell.labels.get(name)) for cell in self.cells))
                for level in levels if isinstance(levels, list | tuple) else [levels]:
                    if name not in self.factors:
                        words, sound = f"is no factor; this study varies {varied}", False
                        yield self.file.fault(words + did_you_mean(name, self.factors), *path, name)
                        break
                    if word(level) not in known:
                        words, sound = f"found {_short(level)}; the levels are {listed(known)}", False
                        yield self.file.fault(words + did_you_mean(word(level), known), *path, name)
        if study.apart and study.apart not in self.factors:
            words, sound = f"found {shortened(study.apart)}; this study varies {varied}", False
            yield self.file.fault(words, "apart")
        for place, shown in enumerate(study.figures):
            count = len(cells_where(self.cells, shown.where))
            if sound and not 0 < count <= MOST_BESIDE:
                words = f"chooses {count} cells; a figure has room for 1 to {MOST_BESIDE}"
                yield self.file.fault(words, "figures", place, "where")

    def _search_faults(self) -> Iterator[Fault]:
        """What is wrong with searches: keys tried at both their bounds, and too many runs made at once.

        Bounds may be impossible together with other keys; such points are passed over by a search.
        """
        study = self.study
        for section, search in (("tune", study.tune), ("falsify", study.falsify)):
            if search is None:
                continue
            sizes = {"batch": search.batch * len(self)}
            if isinstance(search, Tune):
                sizes["held_out"] = 2 * search.held_out * len(self.cells)
            for key, runs in sizes.items():
                if runs > MOST_RUNS:
                    words = f"takes {runs:,} runs at once in {len(self.cells):,} cells"
                    yield self.file.fault(f"{words}; allowed are {MOST_RUNS:,}", section, key)
            for key, bounds in search.over.items():
                if key in study.parameters or key == SEED:
                    continue
                for side in ("low", "high"):
                    bound = getattr(bounds, side)
                    cell = self.cells_at({key: int(bound) if bounds.whole else bound})[0]
                    if about := self._faults_about(key, cell):
                        yield self.file.fault(about[0], section, "over", key, side)
                        break

    def _faults_about(self, key: str, cell: Cell) -> list[str]:
        """What is wrong with a cell because of one key by itself."""
        try:
            self.scenario(cell, self.seeds[0])
        except ScenarioError as error:
            return [
                fault.message
                for fault in error.faults
                if fault.source == key or parse_key_path(fault.key) == parse_key_path(key)
            ]
        return []

    def own_metrics(self) -> list[Metric]:
        """Metrics that the plugins of its scenarios bring."""
        one_each = {str(cell.settings.get("plugins")): cell for cell in reversed(self.cells)}
        known = [
            metric
            for cell in reversed(one_each.values())
            for metric in catalog_of(type(self.scenario(cell, self.seeds[0]))).of(Metric)
        ]
        return list({metric.name: metric for metric in known if metric not in METRICS}.values())

    def _placed(self, fault: Fault, cell: Cell) -> Fault:
        """A fault of a cell's scenario, at the place in the study that brought it about."""
        at = parse_key_path(fault.key) or ()
        for key in reversed(cell.settings):
            path = parse_key_path(key) or ()
            if fault.source == key or (at and (at[: len(path)] == path or path[: len(at)] == at)):
                where = _place_of(key, cell, self.file)
                value = cell.settings[key]
                words = f"with {key} = {_short(value)}: {fault.key}: {fault.message}"
                placed = self.file.fault(words, *where, *at[len(path) :])
                if self.file.is_overridden(*where):  # its place says already what is set
                    placed = replace(placed, key=fault.key or key, message=fault.message)
                return placed
        words = ", ".join(f"{name} = {_short(value)}" for name, value in cell.labels.items())
        message = f"{self.template_of(cell).source}: {fault.key}: {fault.message}"
        case = cell.labels.get(CASE, "")
        own = ("cases", case, SCENARIO) if SCENARIO in self.study.cases.get(case, {}) else (SCENARIO,)
        return self.file.fault(f"with {words}: {message}" if words else message, *own)


def _with_seed(digest: hashlib._Hash, seed: int) -> str:
    """Key of the run with a seed."""
    whole = digest.copy()
    whole.update(f";seed={seed}".encode())
    return whole.hexdigest()[:DIGITS]


@cache
def _versions() -> dict[str, str]:
    return {name: version(name) for name in ("escort-mj", "mujoco", "numpy")} | {"numba": numba_version()}


@cache
def sources_digest() -> str:
    """Digest of the code and models that runs come from: in a checkout they change without a new version."""
    package = Path(__file__).parents[2]
    files = [file for file in package.rglob("*.py") if AROUND.isdisjoint(file.relative_to(package).parts)]
    digest = hashlib.sha256()
    for file in sorted([*files, *models_folder().glob("*.xml")]):
        digest.update(file.read_bytes())
    return digest.hexdigest()[:DIGITS]


def _short(value: Any) -> str:
    text = f"{value:g}" if isinstance(value, float) else flow(value)
    return text if len(text) <= 60 else text[:57] + "..."


def word(value: Any) -> str:
    """A level in few words: a number, a name, the name that a table gives itself."""
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, dict):
        return next((str(value[tag]) for tag in ("law", "loop", "behavior") if tag in value), flow(value))
    return value if isinstance(value, str) else flow(value)


def cells_where(cells: Sequence[Cell], where: Mapping[str, Any]) -> list[int]:
    """Return the numbers of the cells that have these levels of these factors, each one level or several."""
    wanted = {
        name: {word(one) for one in (levels if isinstance(levels, list | tuple) else [levels])}
        for name, levels in where.items()
    }
    return [
        index
        for index, cell in enumerate(cells)
        if all(word(cell.labels.get(name)) in levels for name, levels in wanted.items())
    ]


def _named(study: Study) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Every scenario that a study names, and where."""
    if study.scenario:
        yield study.scenario, (SCENARIO,)
    for name, case in study.cases.items():
        if SCENARIO in case:
            yield case[SCENARIO], ("cases", name, SCENARIO)


def _template(file: StudyFile, shipped: Path, name: str, place: tuple[str, ...]) -> Template:
    """A scenario that stands at some place of a study: a file beside it, or shipped.

    Raises:
        UsageError: If its file cannot be read.
        ScenarioError: If there is none.
    """
    path, names = file.path.parent / name, scenario_names(shipped)
    if not os.path.isfile(path):
        if name not in names:
            message = f"found {shortened(name)}; there is no such file beside the study"
            message += f" and no such shipped scenario{did_you_mean(name, names)}"
            raise ScenarioError([file.fault(message, *place)])
        path = shipped / f"{name}.yaml"
    return Template(read_text(path), str(path))


def _place_of(key: str, cell: Cell, file: StudyFile) -> tuple[str | int, ...]:
    """Where the study sets a key."""
    study = file.study
    for factor, alternatives in study.vary.items():
        if isinstance(alternatives, dict) and key in alternatives[cell.labels[factor]]:
            return "vary", factor, cell.labels[factor], key
    if key in study.vary:
        values, value = study.vary[key], cell.settings[key]
        return (
            ("vary", key, values.index(value))
            if isinstance(values, tuple) and value in values
            else ("vary", key)
        )
    if study.sample is not None and key in study.sample.over:
        return "sample", "over", key
    case = cell.labels.get(CASE)
    if case is not None and key in study.cases[case]:
        return "cases", case, key
    for name, search in (("tune", study.tune), ("falsify", study.falsify)):
        if search is not None and key in search.over and key not in study.set:
            return name, "over", key
    return "set", key


def _cells(file: StudyFile, searched: Mapping[str, Any] = MappingProxyType({})) -> Iterator[Cell]:
    """Every combination of cases, values and drawn points, with what a search adds to each."""
    study = file.study
    cases: list[tuple[dict[str, Any], dict[str, Any]]]
    cases = [({CASE: name}, case) for name, case in study.cases.items()] or [({}, {})]
    levels = [_levels(key, values) for key, values in study.vary.items()]
    rounds = [(case, combination) for case in cases for combination in product(*levels)]
    for ((label, case), varied), points in zip(rounds, _points(study.sample, len(rounds)), strict=True):
        for number, point in points:
            own = {key: case.get(key, value) for key, value in point.items()}
            labels = dict(label)
            settings = dict(study.set) | {key: value for key, value in case.items() if key != SCENARIO}
            for told, table in varied:
                labels |= told
                settings |= table
            labels |= own
            settings |= own | dict(searched)
            settled = _settled(study, settings)
            if "plugins" in settled:
                settled["plugins"] = placed_in(file.path.parent, settled["plugins"])
            yield Cell(labels | number, settled, case.get(SCENARIO, study.scenario))


def _levels(key: str, levels: Any) -> list[tuple[dict[str, Any], dict[str, Any]]]:
    """What tells each level of a factor from the others, and what it sets."""
    if isinstance(levels, dict):
        return [({key: name}, table) for name, table in levels.items()]
    return [({key: value}, {key: value}) for value in values_of(levels)]


def _settled(study: Study, given: Mapping[str, Any]) -> dict[str, Any]:
    """Scenario keys and values in the order in which they are set, parameters filled in."""
    numbers = {name: given.get(name, number) for name, number in study.parameters.items()}
    ordered = in_order({key: value for key, value in given.items() if key not in numbers})
    return {key: filled(value, numbers) if numbers else value for key, value in ordered.items()}


def _points(sample: Sample | None, rounds: int) -> Iterator[list[Point]]:
    """Points of each combination of cases and values, each with its number."""
    if sample is None:
        for _ in range(rounds):
            yield [({}, {})]
        return
    from scipy.stats import qmc

    size, count = len(sample.over), sample.count * (1 if sample.paired else rounds)
    if sample.method == "random":
        unit = np.random.Generator(np.random.Philox(sample.seed)).random((count, size))
    elif sample.method == "latin_hypercube":
        unit = qmc.LatinHypercube(size, rng=sample.seed).random(count)
    else:
        unit = qmc.Sobol(size, rng=sample.seed).random_base2(math.ceil(math.log2(count)))[:count]
    points: list[Point] = [
        (
            {SAMPLE: number},
            {key: drawn(draw, float(u)) for (key, draw), u in zip(sample.over.items(), row, strict=True)},
        )
        for number, row in enumerate(unit)
    ]
    for one in range(rounds):
        first = 0 if sample.paired else one * sample.count
        yield points[first : first + sample.count]
